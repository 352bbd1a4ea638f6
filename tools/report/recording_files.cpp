#include "tools/report/recording_files.hpp"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <optional>
#include <string_view>
#include <utility>

#include <fcntl.h>
#include <unistd.h>

#include "daemon/shell/system/owned_fd.hpp"
#include "tools/common/byte_order_mark.hpp"
#include "tools/common/clock_set.hpp"
#include "tools/common/line_reader.hpp"

namespace bmu::report {

namespace {

constexpr std::string_view part_begins = "# bmud-recording ";
/// A head has about 4 MB, and a black box a few lines before it.
constexpr std::size_t look_bytes_max = std::size_t{32} << 20;
constexpr std::int64_t us_per_s = 1'000'000;

std::string name_of(const std::string& path) {
  return path == "-" ? "standard input" : std::filesystem::path(path).filename().string();
}

OwnedFd open_file(const std::string& path) {
  return OwnedFd(path == "-" ? ::dup(STDIN_FILENO) : ::open(path.c_str(), O_RDONLY | O_CLOEXEC));
}

tl::unexpected<std::string> cannot_read(const std::string& path) {
  return failure("cannot read '" + path + "': " + std::strerror(errno));
}

/// The time of a line that starts with "(1700000000.123456)", or has it after "# ".
std::optional<std::int64_t> time_of(std::string_view line) {
  if (line.starts_with("# ")) line.remove_prefix(2);
  if (!line.starts_with('(')) return std::nullopt;
  std::int64_t seconds = 0;
  std::int64_t micros = 0;
  const char* const end = line.data() + line.size();
  const auto [point, error] = std::from_chars(line.data() + 1, end, seconds);
  if (error != std::errc{} || point == end || *point != '.') return std::nullopt;
  const auto [behind, also] = std::from_chars(point + 1, end, micros);
  const bool is_one = also == std::errc{} && behind - point == 7 && behind != end && *behind == ')';
  return is_one ? std::optional(seconds * us_per_s + micros) : std::nullopt;
}

/// Start of a recording: the time of the first line after a head. If the clock was not set then, the time by the clock
/// as it is set first in the same session of the daemon; for that a file is read up to there, or to its end.
class FirstTime {
 public:
  /// False: no further line is needed.
  [[nodiscard]] bool take(std::string_view line) {
    seen_ += line.size();
    has_head_ = has_head_ || line.starts_with(part_begins);
    if (!has_head_) return seen_ < look_bytes_max;
    if (const auto life = word_behind("# part ", line)) {
      if (first_us_ && life != life_) return false;
      life_ = life;
    }
    if (const auto ahead_us = word_behind("# ahead_us ", line)) {
      if (first_us_ && is_clock_set(*first_us_ - ahead_us_ + *ahead_us)) {
        first_us_ = *first_us_ - ahead_us_ + *ahead_us;
        return false;
      }
      if (!first_us_) ahead_us_ = *ahead_us;
    }
    if (!first_us_) first_us_ = time_of(line);
    const bool is_set = first_us_ && is_clock_set(*first_us_);
    return !is_set && (first_us_ || seen_ < look_bytes_max);
  }
  [[nodiscard]] std::optional<std::int64_t> first_us() const { return first_us_; }

 private:
  static std::optional<std::int64_t> word_behind(std::string_view begin, std::string_view line) {
    std::int64_t number = 0;
    if (!line.starts_with(begin)) return std::nullopt;
    const char* const end = line.data() + line.size();
    const bool is_one = std::from_chars(line.data() + begin.size(), end, number).ec == std::errc{};
    return is_one ? std::optional(number) : std::nullopt;
  }

  std::size_t seen_ = 0;
  bool has_head_ = false;
  std::optional<std::int64_t> life_;
  std::int64_t ahead_us_ = 0;  // of the clock of the first time
  std::optional<std::int64_t> first_us_;
};

/// None: there is no head, or nothing after it.
Result<std::optional<std::int64_t>, std::string> first_time(const std::string& path) {
  const OwnedFd in = open_file(path);
  if (!in.is_open()) return cannot_read(path);
  LineReader lines(in.get());
  LineReader::Line line;
  FirstTime first;
  while (true) {
    while (lines.take(line)) {
      if (!first.take(without_byte_order_mark(line.text))) return first.first_us();
    }
    const LineReader::Filled filled = lines.fill();
    if (filled == LineReader::Filled::error) return cannot_read(path);
    if (filled == LineReader::Filled::end) return first.first_us();
  }
}

/// Feeds the lines of a file to a report.
class Feed {
 public:
  Feed(int fd, RecordingReport& reading, const std::function<void(std::size_t bytes)>& progress)
      : lines_(fd), reading_(reading), progress_(progress) {}

  /// False: the read failed.
  [[nodiscard]] bool run() {
    LineReader::Line line;
    while (true) {
      while (lines_.take(line)) take(line);
      switch (lines_.fill()) {
        case LineReader::Filled::more:
        case LineReader::Filled::interrupted: break;
        case LineReader::Filled::end: return true;
        case LineReader::Filled::damaged: break_off(words_for(lines_.damage())); break;
        case LineReader::Filled::error: return false;
      }
    }
  }

 private:
  void take(const LineReader::Line& line) {
    progress_(line.text.size() + 1);
    const std::string_view text = without_byte_order_mark(line.text);
    if (is_in_hole_ && !text.starts_with(part_begins)) return;
    const std::string place = "line " + std::to_string(lines_.line_number());
    if (std::exchange(is_in_hole_, false)) reading_.go_on(place);
    if (line.is_too_long) return break_off(place + ": too long for a recording");
    // A truncated line could pass for another decision.
    if (!line.has_end) return break_off("its last line, " + std::to_string(lines_.line_number()) + ", has no end");
    if (!reading_.take(text)) break_off(reading_.trouble(lines_.line_number()));
  }

  [[nodiscard]] std::string words_for(const PackedText::Damage& damage) const {
    return "damaged behind line " + std::to_string(lines_.line_number()) + ", from byte " +
           std::to_string(damage.begin) + " to byte " + std::to_string(damage.end) + ": " + damage.what;
  }

  void break_off(const std::string& why) {
    reading_.break_off(why);
    is_in_hole_ = true;
  }

  LineReader lines_;
  RecordingReport& reading_;
  const std::function<void(std::size_t bytes)>& progress_;
  bool is_in_hole_ = false;  // the following lines cannot be replayed before the next head
};

}  // namespace

Result<RecordingFiles, std::string> in_order_of_time(const std::vector<std::string>& paths) {
  RecordingFiles files;
  if (paths.size() == 1) {
    files.recordings.push_back({.path = paths.front()});
    return files;
  }
  for (const std::string& path : paths) {
    const auto first_us = first_time(path);
    if (!first_us) return failure(first_us.error());
    if (*first_us) {
      files.recordings.push_back({.path = path, .first_us = **first_us});
    } else {
      files.left_out.push_back(name_of(path) + " is left out: no recording is in it.");
    }
  }
  if (files.recordings.empty()) return failure("none of the files is a recording");
  std::stable_sort(files.recordings.begin(), files.recordings.end(),
                   [](const RecordingFile& a, const RecordingFile& b) { return a.first_us < b.first_us; });
  return files;
}

Result<void, std::string> read_recording(const RecordingFile& file, RecordingReport& reading,
                                         const std::function<void(std::size_t bytes)>& progress) {
  const OwnedFd in = open_file(file.path);
  if (!in.is_open()) return cannot_read(file.path);
  reading.begin_file(name_of(file.path));
  if (!Feed(in.get(), reading, progress).run()) return cannot_read(file.path);
  return {};
}

}  // namespace bmu::report

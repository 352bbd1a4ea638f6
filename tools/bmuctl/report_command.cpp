#include "tools/bmuctl/report_command.hpp"

#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string_view>
#include <utility>

#include <fcntl.h>
#include <unistd.h>

#include "daemon/history/history_reader.hpp"
#include "daemon/shell/owned_fd.hpp"
#include "protocol/result.hpp"
#include "tools/bmuctl/history_file.hpp"
#include "tools/bmuctl/time_words.hpp"
#include "tools/common/line_reader.hpp"
#include "tools/common/terminal.hpp"
#include "tools/report/report_from_history.hpp"
#include "tools/report/report_from_recording.hpp"
#include "tools/report/report_page.hpp"
#include "tools/report/report_time.hpp"

namespace bmu {

namespace {

constexpr int exit_ok = 0;
constexpr int exit_failed = 1;
constexpr int exit_usage = 2;
constexpr int exit_damaged = 3;
constexpr std::int64_t us_per_ms = 1000;
constexpr std::int64_t us_per_day = 86'400'000'000;
/// What every SQLite database begins with (sqlite.org/fileformat2.html).
constexpr std::string_view sqlite_mark{"SQLite format 3\0", 16};

int fail(const std::string& what, int status = exit_failed) {
  std::fprintf(stderr, "bmuctl: %s\n", what.c_str());
  return status;
}

/// How far it is, on a terminal, four times a second.
class Progress {
 public:
  Progress() : is_shown_(::isatty(STDERR_FILENO) != 0) {}
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  ~Progress() {
    if (has_shown_) std::fputs("\r\033[K", stderr);
  }

  void take(std::size_t bytes) {
    done_ += bytes;
    if (!is_shown_ || ++lines_ % lines_between_looks != 0) return;
    const auto now = std::chrono::steady_clock::now();
    if (now - told_at_ < std::chrono::milliseconds(250)) return;
    told_at_ = now;
    has_shown_ = true;
    std::fprintf(stderr, "\rreading, %.0f MB", static_cast<double>(done_) * 1e-6);
  }

 private:
  static constexpr unsigned lines_between_looks = 256;

  std::uintmax_t done_ = 0;
  bool is_shown_;
  bool has_shown_ = false;
  unsigned lines_ = 0;
  std::chrono::steady_clock::time_point told_at_ = std::chrono::steady_clock::now();
};

/// As far as it can be read; what was wrong behind that, "" if nothing was.
Result<std::string, std::string> take_lines(int fd, report::RecordingReport& reading) {
  Progress progress;
  LineReader lines(fd);
  LineReader::Line line;
  while (true) {
    while (lines.take(line)) {
      progress.take(line.text.size() + 1);
      // What is missing of a last line would pass for another decision.
      if (!line.has_end) return "in its last line, " + std::to_string(lines.line_number()) + ", which has no end";
      if (!reading.take(line.text)) return std::string();
    }
    switch (lines.fill()) {
      case LineReader::Filled::more:
      case LineReader::Filled::interrupted: break;
      case LineReader::Filled::end: return std::string();
      case LineReader::Filled::damaged:
        return "from byte " + std::to_string(lines.damage().begin) + " on: " + lines.damage().what;
      case LineReader::Filled::error: return failure(std::string(std::strerror(errno)));
    }
  }
}

Result<report::ReportData, std::string> read_recording(const std::string& file, report::RecordingReport& reading,
                                                       std::string& damage) {
  const OwnedFd in(file == "-" ? ::dup(STDIN_FILENO) : ::open(file.c_str(), O_RDONLY | O_CLOEXEC));
  if (!in.is_open()) return failure("cannot read '" + file + "': " + std::strerror(errno));
  auto read = take_lines(in.get(), reading);
  if (!read) return failure("cannot read '" + file + "': " + read.error());
  damage = std::move(*read);
  const auto problem = reading.problem();
  report::ReportData data = std::move(reading).finish();
  if (!data.is_empty()) return data;
  if (problem) return failure(file + ":" + std::to_string(problem->line) + ": " + problem->text);
  return failure("'" + file + "' has nothing to show: no decision is in it, or none between --from and --to");
}

std::string beside(const std::string& file) {
  std::filesystem::path path(file);
  // "drive.log.zst" has two.
  if (path.extension() == ".zst") path.replace_extension();
  return path.replace_extension(".html").string();
}

bool write_page(const std::string& page, const std::string& path) {
  if (path == "-") {
    write_out(page);
    return true;
  }
  std::ofstream out(path, std::ios::binary);
  out << page;
  out.close();
  return !out.fail();
}

/// What is shown, and whether all of it could be read.
struct Loaded {
  report::ReportData data;
  bool is_whole = true;
};

struct Span {
  std::optional<std::int64_t> from_us;
  std::optional<std::int64_t> to_us;
};

std::int64_t now_us() {
  const auto since_1970 = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::microseconds>(since_1970).count();
}

/// UTC as the page has it; words that count from now are the same everywhere.
std::optional<std::int64_t> time_us_of(const std::string& text) {
  if (const auto time = report::parse_time(text)) return time;
  const auto time_ms = time_from_words(text, now_us() / us_per_ms);
  return time_ms ? std::optional(*time_ms * us_per_ms) : std::nullopt;
}

bool is_database(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  std::string begin(sqlite_mark.size(), '\0');
  in.read(begin.data(), static_cast<std::streamsize>(begin.size()));
  return begin == sqlite_mark;
}

Result<Loaded, std::string> load_recording(const std::string& file, const Span& span) {
  report::RecordingReport reading(
      {.name = std::filesystem::path(file).filename().string(), .from_us = span.from_us, .to_us = span.to_us});
  std::string damage;
  auto data = read_recording(file, reading, damage);
  if (!data) return failure(data.error());
  Loaded loaded{.data = std::move(*data), .is_whole = damage.empty() && !reading.problem()};
  if (!damage.empty()) loaded.data.notes.push_back("The recording is damaged " + damage + ".");
  return loaded;
}

Result<Loaded, std::string> load_history(const std::string& file, Span span) {
  auto history = HistoryReader::open(file);
  if (!history) return failure(history.error());
  if (!span.from_us && !span.to_us) span.from_us = now_us() - us_per_day;
  Loaded loaded;
  loaded.data = report::report_from_history(*history, {.from_us = span.from_us, .to_us = span.to_us});
  loaded.is_whole = history->problems().empty();
  if (loaded.data.is_empty()) return failure("'" + file + "' has no minute between these times");
  return loaded;
}

std::string page_of(const report::ReportData& data) {
  return report::page_html(data, {.made_by = "bmuctl " BMUD_VERSION, .made_at_us = now_us()});
}

}  // namespace

int write_report(const ReportOptions& options) {
  Span span;
  for (const auto& [text, time] : {std::pair{&options.from, &span.from_us}, std::pair{&options.to, &span.to_us}}) {
    if (text->empty()) continue;
    *time = time_us_of(*text);
    if (!*time)
      return fail("'" + *text + "' is no time; wanted one like \"2026-03-01 17:05\", UTC, or -2h", exit_usage);
  }
  const bool is_of_history = options.file.empty() || is_database(options.file);
  const std::string file = options.file.empty() ? history_file(options.socket) : options.file;
  const std::string beside_it = options.file.empty() ? "history.html" : beside(file);
  const std::string out = options.out.empty() ? beside_it : options.out;
  if (out == file && out != "-")
    return fail("the page would be written over '" + out + "'; wanted another --out", exit_usage);
  const auto loaded = is_of_history ? load_history(file, span) : load_recording(file, span);
  if (!loaded) return fail(loaded.error());
  const report::ReportData& data = loaded->data;
  if (!write_page(page_of(data), out)) return fail("cannot write '" + out + "'");
  if (out != "-") std::printf("%s: %s\n", out.c_str(), report::span_text(data.to_us() - data.from_us()).c_str());
  for (const std::string& note : data.notes) std::fprintf(stderr, "bmuctl: %s\n", note.c_str());
  return loaded->is_whole ? exit_ok : exit_damaged;
}

}  // namespace bmu

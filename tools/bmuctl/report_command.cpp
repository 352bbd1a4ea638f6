#include "tools/bmuctl/report_command.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string_view>
#include <utility>

#include <unistd.h>

#include "daemon/history/history_reader.hpp"
#include "daemon/shell/cli/exit_codes.hpp"
#include "daemon/shell/system/whole_file.hpp"
#include "protocol/result.hpp"
#include "tools/bmuctl/history_file.hpp"
#include "tools/bmuctl/history_text.hpp"
#include "tools/bmuctl/time_words.hpp"
#include "tools/common/standard_output.hpp"
#include "tools/report/from_history.hpp"
#include "tools/report/from_recording.hpp"
#include "tools/report/holes.hpp"
#include "tools/report/page.hpp"
#include "tools/report/recording_files.hpp"
#include "tools/report/time.hpp"

namespace bmu {

namespace {

using exit_codes::exit_damaged;
using exit_codes::exit_ok;
using exit_codes::exit_system;
using exit_codes::exit_usage;
constexpr std::int64_t us_per_ms = 1000;
constexpr std::int64_t us_per_day = 86'400'000'000;
constexpr std::size_t holes_told_max = 10;
/// First bytes of every SQLite database (sqlite.org/fileformat2.html).
constexpr std::string_view sqlite_mark{"SQLite format 3\0", 16};

int fail(const std::string& what, int status = exit_system) {
  std::fprintf(stderr, "bmuctl: %s\n", what.c_str());
  return status;
}

/// Shows the progress on a terminal, four times a second.
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

std::string beside(const std::string& file) {
  std::filesystem::path path(file);
  // "drive.log.zst" has two extensions.
  if (path.extension() == ".zst" || path.extension() == ".gz") path.replace_extension();
  return path.replace_extension(".html").string();
}

Result<void, std::string> write_page(const std::string& page, const std::string& path) {
  if (path != "-") return write_whole_file(path, page);
  write_out(page);
  return {};
}

/// The data to show, and whether all of it could be read.
struct Loaded {
  report::ReportData data;
  bool is_whole = true;
};

struct ReportSpan {
  std::optional<std::int64_t> from_us;
  std::optional<std::int64_t> to_us;
};

std::optional<std::int64_t> us_of(const std::optional<std::int64_t>& unix_ms) {
  return unix_ms ? std::optional(*unix_ms * us_per_ms) : std::nullopt;
}

bool is_database(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  std::string begin(sqlite_mark.size(), '\0');
  in.read(begin.data(), static_cast<std::streamsize>(begin.size()));
  // A database with a damaged header is recognised by its name.
  return begin == sqlite_mark || std::filesystem::path(file).filename().string().find(".sqlite") != std::string::npos;
}

std::string nothing_in(const report::RecordingFiles& files, const report::ReportData& data) {
  const std::string what =
      files.recordings.size() == 1 ? "'" + files.recordings.front().path + "' has" : "the recordings have";
  if (data.holes.empty()) {
    return what + " nothing to show: no decision is in them, or none between --from and --to";
  }
  return what + " nothing to show: " + data.holes.front().text;
}

Result<Loaded, std::string> load_recordings(const report::RecordingFiles& files, const ReportSpan& span) {
  report::RecordingReport reading({.from_us = span.from_us, .to_us = span.to_us});
  {
    Progress progress;
    for (const report::RecordingFile& file : files.recordings) {
      auto read = report::read_recording(file, reading, [&](std::size_t bytes) { progress.take(bytes); });
      if (!read) return failure(read.error());
    }
  }
  Loaded loaded{.data = std::move(reading).finish()};
  report::ReportData& data = loaded.data;
  if (data.is_empty()) return failure(nothing_in(files, data));
  data.notes.insert(data.notes.begin(), files.left_out.begin(), files.left_out.end());
  const bool is_damaged =
      std::any_of(data.holes.begin(), data.holes.end(), [](const report::HoleReport& hole) { return hole.is_damage; });
  loaded.is_whole = !is_damaged && files.left_out.empty();
  return loaded;
}

Result<Loaded, std::string> load_history(const std::string& file, ReportSpan span, bool has_span) {
  auto history = HistoryReader::open(file);
  if (!history) return failure(history.error());
  if (!has_span) span.from_us = now_in_unix_ms() * us_per_ms - us_per_day;
  Loaded loaded;
  loaded.data = report::report_from_history(*history, {.from_us = span.from_us, .to_us = span.to_us});
  const std::vector<std::string> problems = history->problems();
  loaded.is_whole = problems.empty();
  if (!loaded.data.is_empty()) return loaded;
  if (history->has_no_minute_yet()) {
    return failure("nothing " + recorded_yet_text(history->path(), history->period_s()));
  }
  if (problems.empty()) return failure("'" + file + "' has no minute between these times");
  return failure("'" + file + "' is damaged, no minute between these times can be read: " + problems.front() +
                 (problems.size() == 1 ? "" : "; and more, see bmuctl history"));
}

std::string page_of(const report::ReportData& data) {
  return report::page_html(data, {.made_by = "bmuctl " BMUD_VERSION, .made_at_us = now_in_unix_ms() * us_per_ms});
}

/// "drive.html: 2 min 30 s, 2026-03-01 17:05:09+01:00 to 2026-03-01 17:07:39+01:00".
void tell(const report::ReportData& data, const std::string& out) {
  const std::string missing =
      report::missing_us(data) > 0 ? ", of which " + report::span_text(report::missing_us(data)) + " are missing" : "";
  std::printf("%s: %s, %s to %s%s\n", out.c_str(), report::span_text(data.to_us() - data.from_us()).c_str(),
              local_time_text(data.from_us() / us_per_ms).c_str(), local_time_text(data.to_us() / us_per_ms).c_str(),
              missing.c_str());
}

void warn(const report::ReportData& data) {
  for (const std::string& note : data.notes) std::fprintf(stderr, "bmuctl: %s\n", note.c_str());
  const std::size_t shown = std::min(data.holes.size(), holes_told_max);
  const auto local = [](std::int64_t at_us) { return local_time_text(at_us / us_per_ms); };
  for (std::size_t i = 0; i < shown; ++i) {
    std::fprintf(stderr, "bmuctl: %s\n", report::hole_text(data.holes[i], local).c_str());
  }
  if (shown < data.holes.size()) std::fprintf(stderr, "bmuctl: and %zu more such holes\n", data.holes.size() - shown);
}

/// The files to read, and the output of the page.
struct Sources {
  std::string history;  // "": recordings
  report::RecordingFiles files;
  std::string out;
};

Result<Sources, std::string> sources_of(const ReportOptions& options) {
  Sources sources;
  sources.out = options.out;
  if (options.files.empty() || (options.files.size() == 1 && is_database(options.files.front()))) {
    sources.history = options.files.empty() ? history_file(options.socket) : options.files.front();
    if (options.out.empty()) sources.out = options.files.empty() ? "history.html" : beside(sources.history);
    return sources;
  }
  auto files = report::in_order_of_time(options.files);
  if (!files) return failure(files.error());
  sources.files = std::move(*files);
  if (options.out.empty()) sources.out = beside(sources.files.recordings.front().path);
  return sources;
}

/// The error of a contradictory command line; "" for none.
std::string contradiction(const ReportOptions& options) {
  if (options.files.size() < 2) return "";
  for (const std::string& file : options.files) {
    if (file == "-") return "standard input cannot be combined with other files";
    if (is_database(file)) return "'" + file + "' is a history database and cannot be combined with other files";
  }
  return "";
}

}  // namespace

int write_report(const ReportOptions& options) {
  const auto words = time_span_from_words(options.from, options.to, now_in_unix_ms());
  if (!words) return fail("report: " + words.error(), exit_usage);
  if (const std::string wrong = contradiction(options); !wrong.empty()) return fail("report: " + wrong, exit_usage);
  const auto sources = sources_of(options);
  if (!sources) return fail(sources.error());
  const std::string& out = sources->out;
  std::vector<std::string> read = options.files;
  read.push_back(sources->history);
  if (const std::string same = out == "-" ? "" : same_file_among(out, read); !same.empty())
    return fail("--out: '" + same + "' is an input file, expected another path", exit_usage);
  const ReportSpan span{.from_us = us_of(words->from_unix_ms), .to_us = us_of(words->to_unix_ms)};
  const bool has_span = !options.from.empty() || !options.to.empty();
  const auto loaded =
      sources->history.empty() ? load_recordings(sources->files, span) : load_history(sources->history, span, has_span);
  if (!loaded) return fail(loaded.error());
  const auto written = write_page(page_of(loaded->data), out);
  if (!written) return fail("cannot write '" + out + "': " + written.error());
  if (out != "-") tell(loaded->data, out);
  warn(loaded->data);
  return loaded->is_whole ? exit_ok : exit_damaged;
}

}  // namespace bmu

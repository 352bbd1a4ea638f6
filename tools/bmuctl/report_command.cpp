#include "tools/bmuctl/report_command.hpp"

#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>

#include <fcntl.h>
#include <unistd.h>

#include "daemon/shell/owned_fd.hpp"
#include "protocol/result.hpp"
#include "tools/common/line_reader.hpp"
#include "tools/common/terminal.hpp"
#include "tools/report/report_from_recording.hpp"
#include "tools/report/report_page.hpp"
#include "tools/report/report_time.hpp"

namespace bmu {

namespace {

constexpr int exit_ok = 0;
constexpr int exit_failed = 1;
constexpr int exit_usage = 2;
constexpr int exit_damaged = 3;

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
      if (!reading.take(line.text)) return std::string();
    }
    switch (lines.fill()) {
      case LineReader::Filled::more:
      case LineReader::Filled::interrupted: break;
      case LineReader::Filled::end:
        if (!lines.take(line)) return std::string();
        static_cast<void>(reading.take(line.text));
        return std::string();
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

}  // namespace

int write_report(const ReportOptions& options) {
  report::RecordingOptions wanted{.name = std::filesystem::path(options.file).filename().string()};
  for (const auto& [text, time] : {std::pair{&options.from, &wanted.from_us}, std::pair{&options.to, &wanted.to_us}}) {
    if (text->empty()) continue;
    *time = report::parse_time(*text);
    if (!*time) return fail("'" + *text + "' is no time; wanted one like \"2026-03-01 17:05\", UTC", exit_usage);
  }
  const std::string out = options.out.empty() ? beside(options.file) : options.out;
  if (out == options.file)
    return fail("the page would be written over '" + out + "'; wanted another --out", exit_usage);
  report::RecordingReport reading(wanted);
  std::string damage;
  const auto data = read_recording(options.file, reading, damage);
  if (!data) return fail(data.error());
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  const std::string page =
      report::page_html(*data, {.made_by = "bmuctl " BMUD_VERSION,
                                .made_at_us = std::chrono::duration_cast<std::chrono::microseconds>(now).count()});
  if (!write_page(page, out)) return fail("cannot write '" + out + "'");
  if (out != "-") std::printf("%s: %s\n", out.c_str(), report::span_text(data->to_us() - data->from_us()).c_str());
  for (const std::string& note : data->notes) std::fprintf(stderr, "bmuctl: %s\n", note.c_str());
  if (!damage.empty())
    std::fprintf(stderr, "bmuctl: %s: the page ends where it is damaged, %s\n", options.file.c_str(), damage.c_str());
  return reading.problem() || !damage.empty() ? exit_damaged : exit_ok;
}

}  // namespace bmu

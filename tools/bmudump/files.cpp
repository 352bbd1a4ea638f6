#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <utility>

#include <fcntl.h>
#include <unistd.h>

#include "tools/bmudump/dump.hpp"
#include "tools/bmudump/follow_screen.hpp"
#include "tools/bmudump/log_times.hpp"
#include "tools/common/byte_order_mark.hpp"
#include "tools/common/line_reader.hpp"

namespace bmu::dump {
namespace {

/// Damaged lines of one file above this number are counted, but not reported one by one.
constexpr std::uint64_t damage_told_max = 1'000;
constexpr std::uint64_t clock_jumps_reported_max = 1'000;

std::string found_text(std::string_view line, std::size_t column) {
  if (column >= line.size()) return "the end of the line";
  const auto code = static_cast<unsigned char>(line[column]);
  if (code > 0x20 && code < 0x7F) return std::string("'") + line[column] + "'";
  std::array<char, 16> text{};
  std::snprintf(text.data(), text.size(), "byte %02Xh", static_cast<unsigned>(code));
  return code == ' ' ? "a space" : text.data();
}

/// One log: its lines and their damage.
class LogFile {
 public:
  LogFile(const std::string& name, int fd) : name_(name == "-" ? "standard input" : name), reader_(fd) {}

  int read(Dump& dump, FollowScreen& screen);

 private:
  void take_lines(Dump& dump);
  void take_line(const LineReader::Line& line, Dump& dump);
  void take_unusual_line(const LineReader::Line& line, const Result<LogLine, LogLineDamage>& parsed, Dump& dump);
  void take_other_line(const LineReader::Line& line, const LogLineDamage& log_damage, Dump& dump);
  void take_lost(const LostFrames& lost, std::string_view text, Dump& dump);
  void take_frame(const LogLine& line, LogTimeForm form, std::string_view text, Dump& dump);
  void show(const LogLine& line, std::string_view text, Dump& dump);
  void tell_bus_too_many(std::string_view bus, std::string_view text);
  void report_clock(const ClockJump& jump);
  void correct_time(LogLine& line, LogTimeForm form);
  void look_ahead(const LogLine& first);
  void tell_torn();
  void tell_damage(const LogLineDamage& damage, std::string_view text);
  void tell_damage(std::size_t column, const std::string& found, std::string_view wanted);
  void tell_packed_damage();

  std::string name_;
  LineReader reader_;
  std::uint64_t damaged_ = 0;
  std::uint64_t lost_lines_ = 0;
  std::uint64_t clock_jumps_ = 0;
  LogTimes times_;
  bool has_time_ = false;      // a frame with a time in seconds was read, so that are_absolute_ is valid
  bool are_absolute_ = false;  // its times need no correction
  bool is_missing_told_ = false;
  bool is_adding_told_ = false;
  bool is_below_error_frame_ = false;
  ScreenRoom screen_room_{};
};

/// For the last line of a log without a line end: the writer may have been interrupted, and the remaining text may look
/// like a shorter frame. Text after its bytes, or their number, shows that it is complete.
bool is_torn(const LogLine& line, std::string_view text, Dump& dump) {
  const std::string_view payload = text.substr(text.rfind('#'));
  return payload.find_first_of(" \r") == std::string_view::npos && !dump.is_whole(line);
}

int LogFile::read(Dump& dump, FollowScreen& screen) {
  while (!dump.is_done() && !is_stop_requested()) {
    take_lines(dump);
    dump.flush();  // before a read that may wait: the reader of a pipe sees each batch at once
    if (dump.follow() != nullptr) screen.draw_if_due(dump.follow()->newest_us());
    const LineReader::Filled filled = reader_.fill();
    if (filled == LineReader::Filled::end) break;
    if (filled == LineReader::Filled::damaged) tell_packed_damage();
    if (filled == LineReader::Filled::error) {
      std::fprintf(stderr, "bmudump: cannot read %s: %s\n", name_.c_str(), std::strerror(errno));
      return exit_system;
    }
  }
  if (damaged_ > damage_told_max) {
    std::fprintf(stderr, "bmudump: %s: %llu damaged lines in total, the first %llu shown\n", name_.c_str(),
                 static_cast<unsigned long long>(damaged_), static_cast<unsigned long long>(damage_told_max));
  }
  if (lost_lines_ > damage_told_max) {
    std::fprintf(stderr, "bmudump: %s: frames lost at %llu places in total, the first %llu shown\n", name_.c_str(),
                 static_cast<unsigned long long>(lost_lines_), static_cast<unsigned long long>(damage_told_max));
  }
  if (clock_jumps_ > clock_jumps_reported_max) {
    std::fprintf(stderr, "bmudump: %s: the clock jumps at %llu places in all, the first %llu are reported\n",
                 name_.c_str(), static_cast<unsigned long long>(clock_jumps_),
                 static_cast<unsigned long long>(clock_jumps_reported_max));
  }
  return damaged_ > 0 ? exit_damaged : exit_ok;
}

void LogFile::take_lines(Dump& dump) {
  LineReader::Line line;
  while (!dump.is_done() && reader_.take(line)) take_line(line, dump);
}

void LogFile::take_line(const LineReader::Line& line, Dump& dump) {
  if (line.is_too_long) {
    return tell_damage(line.text.size(), "more than " + std::to_string(line.text.size()) + " characters", "a newline");
  }
  const auto parsed = parse_log_line(line.text);
  const bool is_usual = parsed && are_absolute_ && line.has_end && parsed->kind != LogLineKind::nothing;
  if (is_usual) return show(*parsed, line.text, dump);
  take_unusual_line(line, parsed, dump);
}

void LogFile::take_unusual_line(const LineReader::Line& line, const Result<LogLine, LogLineDamage>& parsed,
                                Dump& dump) {
  if (!parsed) return take_other_line(line, parsed.error(), dump);
  if (parsed->kind == LogLineKind::nothing) return;
  if (!line.has_end && is_torn(*parsed, line.text, dump)) return tell_torn();
  take_frame(*parsed, LogTimeForm::seconds, line.text, dump);
}

/// Handles a line that is not in the log format.
void LogFile::take_other_line(const LineReader::Line& line, const LogLineDamage& log_damage, Dump& dump) {
  const std::string_view text = line.text;
  if (text.starts_with(byte_order_mark)) {
    LineReader::Line unmarked = line;
    unmarked.text = without_byte_order_mark(text);
    return take_unusual_line(unmarked, parse_log_line(unmarked.text), dump);
  }
  if (is_below_error_frame_ && is_error_text(text)) return;
  if (text.starts_with(lost_frames_begin)) {
    if (const auto lost = parse_lost_frames(text)) return take_lost(*lost, text, dump);
    return line.has_end ? tell_damage(log_damage, text) : tell_torn();
  }
  const auto parsed = parse_screen_line(text, screen_room_);
  if (parsed) {
    const bool may_be_torn = !line.has_end && !parsed->has_length;
    if (may_be_torn && is_torn(parsed->line, text, dump)) return tell_torn();
    return take_frame(parsed->line, parsed->time_form, text, dump);
  }
  is_below_error_frame_ = text.find("ERRORFRAME") != std::string_view::npos;
  if (!line.has_end && std::max(log_damage.column, parsed.error().column) + 1 >= text.size()) return tell_torn();
  tell_damage(is_of_screen(text) ? parsed.error() : log_damage, text);
}

/// Not damage: the log is complete as recorded.
void LogFile::take_lost(const LostFrames& lost, std::string_view text, Dump& dump) {
  if (!dump.count_lost(lost.bus, lost.count)) return tell_bus_too_many(lost.bus, text);
  if (++lost_lines_ > damage_told_max) return;
  std::fprintf(stderr, "bmudump: %s:%llu: %.*s: %lu frames lost when this was recorded\n", name_.c_str(),
               static_cast<unsigned long long>(reader_.line_number()), static_cast<int>(lost.bus.size()),
               lost.bus.data(), static_cast<unsigned long>(lost.count));
}

void LogFile::take_frame(const LogLine& line, LogTimeForm form, std::string_view text, Dump& dump) {
  if (form == LogTimeForm::seconds && !has_time_) {
    has_time_ = true;
    are_absolute_ = LogTimes::are_absolute(text);
    if (!are_absolute_) look_ahead(line);
  }
  if (form == LogTimeForm::seconds && are_absolute_) return show(line, text, dump);
  LogLine corrected = line;
  correct_time(corrected, form);
  show(corrected, text, dump);
}

/// Corrects the time and reports the kind of correction once.
void LogFile::correct_time(LogLine& line, LogTimeForm form) {
  const auto tell = [this](const char* what) {
    std::fprintf(stderr, "bmudump: %s:%llu: %s\n", name_.c_str(),
                 static_cast<unsigned long long>(reader_.line_number()), what);
  };
  times_.take(line, form);
  if (times_.are_missing() && !std::exchange(is_missing_told_, true)) {
    tell("no time; frames without a time have a number in its place");
  }
  if (times_.are_added_up() && !std::exchange(is_adding_told_, true)) {
    tell("times since the line before (candump -t d); added up");
  }
}

void LogFile::show(const LogLine& line, std::string_view text, Dump& dump) {
  is_below_error_frame_ = line.frame.is_error;
  times_.note(line.time_us);
  if (!dump.show(line)) return tell_bus_too_many(line.bus, text);
  if (dump.clock_jump().is_found()) report_clock(dump.clock_jump());
}

/// Reports the position and the size of a jump.
void LogFile::report_clock(const ClockJump& jump) {
  if (++clock_jumps_ > clock_jumps_reported_max) return;
  const char* const also = jump.is_certain ? "" : ", or no bus had a frame for so long";
  std::fprintf(stderr, "bmudump: %s:%llu: the clock goes %s by %.6f s here%s; left out of rates, gaps and loads\n",
               name_.c_str(), static_cast<unsigned long long>(reader_.line_number()),
               jump.by_us < 0 ? "back" : "forward", static_cast<double>(std::abs(jump.by_us)) * 1e-6, also);
}

void LogFile::tell_bus_too_many(std::string_view bus, std::string_view text) {
  tell_damage(text.find(bus), "one more bus name",
              "at most " + std::to_string(BusTable::bus_count_max) + " buses in all");
}

/// Called once, at the first time that may be a difference: the following frames may show that it is one.
void LogFile::look_ahead(const LogLine& first) {
  constexpr int lines_max = 1'000;
  times_.look_ahead(first);
  std::string_view ahead = reader_.ahead();
  ScreenRoom room{};  // separate from that of `first`
  for (int count = 0; count < lines_max; ++count) {
    const std::size_t end = ahead.find('\n');
    if (end == std::string_view::npos) break;
    const std::string_view text = ahead.substr(0, end);
    ahead.remove_prefix(end + 1);
    if (const auto parsed = parse_log_line(text)) {
      if (parsed->kind != LogLineKind::nothing) times_.look_ahead(*parsed);
    } else if (const auto screen = parse_screen_line(text, room); screen && screen->time_form == LogTimeForm::seconds) {
      times_.look_ahead(screen->line);
    }
  }
  times_.forget_order();
}

/// Reports by offset: line numbers exist only in decompressed text.
void LogFile::tell_packed_damage() {
  if (++damaged_ > damage_told_max) return;
  const PackedText::Damage& damage = reader_.damage();
  std::fprintf(stderr, "bmudump: %s: bytes %llu to %llu, behind line %llu: %s; skipped\n", name_.c_str(),
               static_cast<unsigned long long>(damage.begin), static_cast<unsigned long long>(damage.end),
               static_cast<unsigned long long>(reader_.line_number()), damage.what.c_str());
}

void LogFile::tell_torn() {
  if (++damaged_ > damage_told_max) return;
  std::fprintf(stderr, "bmudump: %s:%llu: last line without a line end, torn; line skipped\n", name_.c_str(),
               static_cast<unsigned long long>(reader_.line_number()));
}

void LogFile::tell_damage(const LogLineDamage& damage, std::string_view text) {
  tell_damage(damage.column, found_text(text, damage.column), to_text(damage.wanted));
}

void LogFile::tell_damage(std::size_t column, const std::string& found, std::string_view wanted) {
  if (++damaged_ > damage_told_max) return;
  std::fprintf(stderr, "bmudump: %s:%llu:%zu: found %s, expected %.*s; line skipped\n", name_.c_str(),
               static_cast<unsigned long long>(reader_.line_number()), column + 1, found.c_str(),
               static_cast<int>(wanted.size()), wanted.data());
}

}  // namespace

int dump_files(const Options& options, Dump& dump) {
  int code = exit_ok;
  FollowScreen screen(dump.follow(), options.is_coloured, false);
  for (const std::string& name : options.files) {
    if (dump.is_done() || is_stop_requested()) break;
    const bool is_standard_input = name == "-";
    const int fd = is_standard_input ? STDIN_FILENO : ::open(name.c_str(), O_RDONLY | O_CLOEXEC);
    if (fd < 0) {
      std::fprintf(stderr, "bmudump: cannot open %s: %s\n", name.c_str(), std::strerror(errno));
      code = exit_system;
      continue;
    }
    code = worse(code, LogFile(name, fd).read(dump, screen));
    if (!is_standard_input) ::close(fd);
  }
  return code;
}

}  // namespace bmu::dump

#include "tools/bmudump/dump.hpp"

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <limits>

#include <fcntl.h>
#include <unistd.h>

#include "tools/bmudump/line_reader.hpp"

namespace bmu::dump {
namespace {

volatile std::sig_atomic_t stop_requested = 0;

/// Damage of one file beyond this many lines is counted, not told line by line.
constexpr std::uint64_t damage_told_max = 1'000;

std::string found_text(std::string_view line, std::size_t column) {
  if (column >= line.size()) return "the end of the line";
  const auto code = static_cast<unsigned char>(line[column]);
  if (code > 0x20 && code < 0x7F) return std::string("'") + line[column] + "'";
  std::array<char, 16> text{};
  std::snprintf(text.data(), text.size(), "byte %02Xh", static_cast<unsigned>(code));
  return code == ' ' ? "a space" : text.data();
}

/// One log: its lines, and what is wrong with them.
class LogFile {
 public:
  LogFile(const std::string& name, int fd) : name_(name == "-" ? "standard input" : name), reader_(fd) {}

  int read(Dump& dump);

 private:
  void take_lines(Dump& dump);
  void take_line(const LineReader::Line& line, Dump& dump);
  void tell_damage(std::size_t column, const std::string& found, std::string_view wanted);

  std::string name_;
  LineReader reader_;
  std::uint64_t damaged_ = 0;
};

int LogFile::read(Dump& dump) {
  while (!dump.is_done() && !is_stop_requested()) {
    take_lines(dump);
    dump.flush();  // before a read that may wait: the reader of a pipe sees each batch at once
    const LineReader::Filled filled = reader_.fill();
    if (filled == LineReader::Filled::end) break;
    if (filled == LineReader::Filled::error) {
      std::fprintf(stderr, "bmudump: cannot read %s: %s\n", name_.c_str(), std::strerror(errno));
      return exit_system;
    }
  }
  if (damaged_ > damage_told_max) {
    std::fprintf(stderr, "bmudump: %s: %llu damaged lines in all, the first %llu told\n", name_.c_str(),
                 static_cast<unsigned long long>(damaged_), static_cast<unsigned long long>(damage_told_max));
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
  if (!parsed) {
    const LogLineDamage& damage = parsed.error();
    return tell_damage(damage.column, found_text(line.text, damage.column), to_text(damage.wanted));
  }
  if (parsed->kind == LogLineKind::nothing || dump.show(*parsed)) return;
  tell_damage(static_cast<std::size_t>(parsed->bus.data() - line.text.data()), "one more bus name",
              "at most " + std::to_string(BusTable::bus_count_max) + " buses in all");
}

void LogFile::tell_damage(std::size_t column, const std::string& found, std::string_view wanted) {
  if (++damaged_ > damage_told_max) return;
  std::fprintf(stderr, "bmudump: %s:%llu:%zu: found %s, wanted %.*s; line skipped\n", name_.c_str(),
               static_cast<unsigned long long>(reader_.line_number()), column + 1, found.c_str(),
               static_cast<int>(wanted.size()), wanted.data());
}

int worse(int one, int other) {
  // A run that could not be read to its end says less than one with damaged lines.
  if (one == exit_system || other == exit_system) return exit_system;
  return one == exit_ok ? other : one;
}

}  // namespace

Dump::Dump(const Options& options, const DumpCatalogue& catalogue, const Filter& filter)
    : options_(&options),
      filter_(&filter),
      buses_(catalogue.all()),
      summary_(catalogue, options.bit_rate),
      format_(catalogue, {.is_coloured = options.is_coloured, .is_brief = options.is_brief}),
      out_(STDOUT_FILENO),
      left_(options.count.value_or(std::numeric_limits<std::uint64_t>::max())),
      needs_counts_(options.output == Output::summary || options.is_strict) {}

bool Dump::show(const LogLine& line) {
  Bus* const bus = buses_.find(line.bus);
  if (bus == nullptr) return false;
  // Every frame is judged, also those not shown: whether an answer is late depends on the POLL before it.
  const CheckedFrame verdict = line.kind == LogLineKind::frame ? bus->check.check(line.frame) : CheckedFrame{};
  if (!filter_->passes(line.frame)) return true;
  const SeenFrame seen{line, verdict};
  if (needs_counts_) summary_.count(*bus, seen);
  print(seen);
  --left_;
  return true;
}

void Dump::print(const SeenFrame& seen) {
  switch (options_->output) {
    case Output::text: return format_.print_text(seen, out_);
    case Output::json: return format_.print_json(seen, out_);
    case Output::summary: return;
    case Output::log: break;
  }
  std::array<char, log_line_length_max> text{};
  out_.begin_line();
  out_.text({text.data(), print_log_line(seen.line, text)});
  out_.letter('\n');
}

void Dump::forget_counters(std::string_view bus) {
  if (Bus* const known = buses_.find(bus)) known->check.forget_counters();
}

int Dump::finish(int code) {
  if (options_->output == Output::summary) {
    const std::string text = summary_.text();
    for (std::size_t at = 0; at < text.size(); at += TextWriter::line_room) {
      out_.begin_line();
      out_.text(std::string_view(text).substr(at, TextWriter::line_room));
    }
  }
  out_.flush();
  if (out_.is_closed() && out_.error() != EPIPE) {
    std::fprintf(stderr, "bmudump: cannot write: %s\n", std::strerror(out_.error()));
    return exit_system;
  }
  const bool is_suspect = options_->is_strict && summary_.suspect_count() > 0;
  return worse(code, is_suspect ? exit_suspect : exit_ok);
}

int dump_files(const Options& options, Dump& dump) {
  int code = exit_ok;
  for (const std::string& name : options.files) {
    if (dump.is_done() || is_stop_requested()) break;
    const bool is_standard_input = name == "-";
    const int fd = is_standard_input ? STDIN_FILENO : ::open(name.c_str(), O_RDONLY | O_CLOEXEC);
    if (fd < 0) {
      std::fprintf(stderr, "bmudump: cannot open %s: %s\n", name.c_str(), std::strerror(errno));
      code = exit_system;
      continue;
    }
    code = worse(code, LogFile(name, fd).read(dump));
    if (!is_standard_input) ::close(fd);
  }
  return code;
}

void catch_stop_signals() {
  struct sigaction action {};
  action.sa_handler = [](int) { stop_requested = 1; };  // no SA_RESTART: a waiting read or poll returns
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
  action.sa_handler = SIG_IGN;  // a closed output is an answer of write(), not a death
  ::sigaction(SIGPIPE, &action, nullptr);
}

bool is_stop_requested() {
  return stop_requested != 0;
}

}  // namespace bmu::dump

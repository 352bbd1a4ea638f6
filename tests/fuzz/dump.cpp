// The output of bmudump for a log: a line of text, and one of valid JSON, for every frame; and summary and table of all
// of them.
//
// Input: lines of a log or of a screen.
#include <string>

#include <nlohmann/json.hpp>

#include "tests/fuzz/fuzz.hpp"
#include "tools/bmudump/follow.hpp"
#include "tools/bmudump/log_times.hpp"
#include "tools/bmudump/summary.hpp"

using namespace bmu;
using namespace bmu::dump;

namespace {

constexpr std::uint32_t bit_rate = 500'000;
constexpr std::size_t log_max = 8'192;  // its output stays within the writer's buffer

/// Tables that take longer to make than a log takes to show; an input changes only `start`.
struct Tables {
  DumpCatalogue catalogue{{}};
  LineStart start{{}};
  std::vector<FrameText> formats{FrameText(catalogue, {.has_letters = true}, start)};
};

Tables& tables() {
  static Tables made;
  return made;
}

/// Checks each line by itself.
bool are_json(std::string_view text) {
  const auto lines = fuzz::lines_of(text);
  return std::all_of(lines.begin(), lines.end(), [](std::string_view line) { return nlohmann::json::accept(line); });
}

class Shown {
 public:
  explicit Shown(TimeForm time_form) { format_.start = LineStart({.time = time_form, .has_direction = true}); }

  void take(const LogLine& line) {
    Bus* const bus = buses_.find(line.bus);
    if (bus == nullptr) return;  // too many buses
    ++frames_;
    static_cast<void>(line.kind == LogLineKind::frame && bus->dialect.note(line.frame));
    const CheckedFrame verdict = line.kind == LogLineKind::frame ? bus->check.check(line.frame) : CheckedFrame{};
    const SeenFrame seen{line, verdict};
    follow_.note(*bus, seen, bus->statistics.count(line, verdict));
    format_.formats[0].print_text(seen, text_);
    format_.formats[0].print_json(seen, json_);
    until_us_ = std::max(until_us_, bus->statistics.last_us);
  }

  void check() {
    FUZZ_CHECK(fuzz::lines_of(text_.pending()).size() == frames_);
    FUZZ_CHECK(fuzz::lines_of(json_.pending()).size() == frames_ && are_json(json_.pending()));
    json_.drop_pending();
    const Summary as_json(bit_rate, until_us_, clock_jumps, json_);
    as_json.print_json(buses_.buses());
    FUZZ_CHECK(are_json(json_.pending()));
    const Summary as_text(bit_rate, until_us_, clock_jumps, text_);
    as_text.print_text(buses_.buses());
    text_.drop_pending();
    follow_.print_last(false, text_);
    FUZZ_CHECK(frames_ == 0 || !text_.pending().empty());
    FUZZ_CHECK(!text_.is_closed() && !json_.is_closed());
  }

 private:
  static constexpr int no_file = -1;
  static constexpr std::uint64_t clock_jumps = 2;

  Tables& format_ = tables();
  BusTable buses_{format_.catalogue, 0, dialect_table, {}};
  Follow follow_{buses_, format_.formats, bit_rate};
  TextWriter text_{no_file};
  TextWriter json_{no_file};
  std::size_t frames_ = 0;
  std::int64_t until_us_ = 0;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view log = fuzz::text_of(data, std::min(size, log_max));
  LogTimes times;
  static ScreenRoom room;
  Shown shown(size % 2 == 0 ? TimeForm::absolute : TimeForm::delta);
  for (const std::string_view line : fuzz::lines_of(log)) {
    if (const auto parsed = parse_log_line(line)) {
      if (parsed->kind != LogLineKind::nothing) shown.take(*parsed);
    } else if (auto screen = parse_screen_line(line, room)) {
      times.take(screen->line, screen->time_form);
      shown.take(screen->line);
    }
  }
  shown.check();
  return 0;
}

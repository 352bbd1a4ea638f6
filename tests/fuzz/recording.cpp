// Recordings: the reader, the replay and the replay with another configuration, on recordings modified by users, disks
// and editors.
//
// A complete one consists mainly of the state of a core, 2 MB of it, with checksums that random bytes do not match. So
// the input is a text that refers to pieces of a real one, made here of a pack that closes its contactors, with
// arbitrary lines between them:
//
//   @head 0          all lines of the head of part 0; there are two parts, and the second continues the first
//   @lines 0 12 40   lines 12 to 40 after that head, from 0
//   @part 0          head and lines, all of them
//   @what-if         from here on also for the second core
//   anything else    is a line of the recording
#include <charconv>
#include <optional>
#include <string>

#include "config/pack_config.hpp"
#include "daemon/recording/record_writer.hpp"
#include "daemon/recording/what_if.hpp"
#include "tests/fuzz/fuzz.hpp"
#include "tests/support/folders.hpp"
#include "tools/common/virtual_run.hpp"

using namespace bmu;

namespace {

struct RealPart {
  std::vector<std::string> head;
  std::vector<std::string> lines;
};

RealPart split(const std::string& text) {
  RealPart part;
  std::vector<std::string>* to = &part.head;
  for (const std::string_view line : fuzz::lines_of(text)) {
    to->emplace_back(line);
    if (line.starts_with("# core-end")) to = &part.lines;
  }
  return part;
}

/// A recording of a pack just before it closes, and then closed.
std::vector<RealPart> make_recording() {
  const auto pack = load_pack_config(test::in_source("config/packs/lipo-6s-24v.json"));
  const auto script = parse_scenario("0.5 vehicle on\n1.5 load current_A 5");
  FUZZ_CHECK(pack && script);
  VirtualRun run(pack->core, simulator_config(pack->core), *script);
  RecordWriter writer({.version = "0.1.0",
                       .buses = {.internal = "vcan0", .vehicle = "vcan0"},
                       .sources = pack->sources,
                       .hash = pack->core.hash,
                       .life = 1,
                       .part = 1});
  constexpr std::int64_t from_us = 1'700'000'000'000'000;
  std::vector<RealPart> parts;
  for (const Duration begin : {Duration{500ms}, Duration{1'300ms}}) {
    while (run.elapsed() < begin) run.step();
    const bool goes_on = !parts.empty();
    if (goes_on) parts.push_back(split(writer.text()));
    writer.clear();
    const auto elapsed = std::chrono::duration_cast<std::chrono::microseconds>(run.elapsed());
    writer.begin(run.core(), run.now(), from_us + elapsed.count(), goes_on);
    run.set_tap(&writer);
    if (goes_on) break;
    parts.emplace_back();
  }
  parts.erase(parts.begin());
  while (run.elapsed() < 1'700ms) run.step();
  parts.push_back(split(writer.text()));
  return parts;
}

const std::vector<RealPart>& recording() {
  static const std::vector<RealPart> parts = make_recording();
  return parts;
}

/// The input, expanded to lines.
class Script {
 public:
  explicit Script(std::string_view text) {
    for (const std::string_view line : fuzz::lines_of(text)) {
      if (!line.starts_with('@') || !obey(fuzz::pieces_of(line, " "))) add(line);
    }
  }

  [[nodiscard]] const std::vector<std::string_view>& lines() const { return lines_; }
  /// Line from which on the second core receives lines, too.
  [[nodiscard]] std::optional<std::size_t> what_if_from() const { return what_if_from_; }
  /// True if the input consists of whole parts only.
  [[nodiscard]] bool is_as_written() const { return is_as_written_; }

 private:
  static constexpr std::size_t lines_max = 4'000;  // besides those of heads, each of which has thousands
  static constexpr int heads_max = 3;

  bool obey(const std::vector<std::string_view>& words) {
    const auto number = [&](std::size_t index) {
      std::size_t value = 0;
      if (index < words.size()) std::from_chars(words[index].data(), words[index].data() + words[index].size(), value);
      return value;
    };
    if (words[0] == "@what-if") {
      if (!what_if_from_) what_if_from_ = lines_.size();
      return true;
    }
    const RealPart& part = recording()[number(1) % recording().size()];
    const bool is_whole = words[0] == "@part";
    if (is_whole || words[0] == "@head") {
      if (++heads_ > heads_max) return true;
      lines_.insert(lines_.end(), part.head.begin(), part.head.end());
      head_lines_ += part.head.size();
      is_as_written_ = is_as_written_ && is_whole;
      if (is_whole) add_all(part.lines, 0, part.lines.size());
      return true;
    }
    if (words[0] != "@lines") return false;
    is_as_written_ = false;
    add_all(part.lines, number(2), number(3));
    return true;
  }

  void add_all(const std::vector<std::string>& lines, std::size_t first, std::size_t end) {
    for (std::size_t index = first; index < std::min(end, lines.size()); ++index) push(lines[index]);
  }
  void add(std::string_view line) {
    is_as_written_ = false;
    push(line);
  }
  void push(std::string_view line) {
    if (lines_.size() < lines_max + head_lines_) lines_.push_back(line);
  }

  std::vector<std::string_view> lines_;
  std::optional<std::size_t> what_if_from_;
  int heads_ = 0;
  std::size_t head_lines_ = 0;
  bool is_as_written_ = true;
};

void check_problem(const std::optional<RecordProblem>& problem, std::uint64_t lines) {
  FUZZ_CHECK(problem && !problem->text.empty() && problem->line <= lines);
}

void replay(const Script& script) {
  std::uint64_t told_different = 0;
  std::uint64_t told_altered = 0;
  Replay replay({.differs =
                     [&](const ReplayDifference& difference) {
                       ++told_different;
                       FUZZ_CHECK(difference.line >= 1 && difference.line <= script.lines().size());
                     },
                 .altered =
                     [&](const RecordProblem& alteration) {
                       ++told_altered;
                       FUZZ_CHECK(alteration.line >= 1 && alteration.line <= script.lines().size());
                     }});
  bool has_failed = false;
  for (const std::string_view line : script.lines()) {
    // It may continue after a problem, at the next head.
    if (replay.take(line)) continue;
    has_failed = true;
    check_problem(replay.problem(), script.lines().size());
  }
  replay.end();
  const ReplayCounts& counts = replay.counts();
  FUZZ_CHECK(counts.lines == script.lines().size() && counts.ticks_different == told_different);
  FUZZ_CHECK(counts.ticks_different <= counts.ticks && counts.covered >= Duration::zero());
  FUZZ_CHECK((counts.ticks == 0 && counts.observations == 0) || counts.begun > 0);
  if (!script.is_as_written() || script.lines().empty()) return;
  FUZZ_CHECK(!has_failed && counts.begun > 0 && counts.ticks > 0 && told_different == 0 && told_altered == 0);
}

/// With the recorded configuration: unmodified input gives the same result.
void replay_beside(const Script& script) {
  std::uint64_t moves = 0;
  WhatIf beside({.other = [](const PackConfig& recorded) -> Result<CoreConfig, std::string> { return recorded.core; },
                 .moves = [&](const WhatIfMove&) { ++moves; }});
  for (std::size_t index = *script.what_if_from(); index < script.lines().size(); ++index) {
    if (beside.take(script.lines()[index])) continue;
    check_problem(beside.problem(), script.lines().size());
    beside.break_off();
  }
  beside.end();
  if (script.is_as_written()) FUZZ_CHECK(moves == 0);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const Script script(fuzz::text_of(data, size));
  replay(script);
  if (script.what_if_from()) replay_beside(script);
  return 0;
}

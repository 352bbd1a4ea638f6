// The script language of the emulated pack: each problem has its position in the text, a script without one can be laid
// out and played, and an event of a script means the same by itself.
//
// Input: a script.
#include <algorithm>

#include "config/pack_config.hpp"
#include "tests/fuzz/fuzz.hpp"
#include "tests/support/folders.hpp"
#include "tools/common/virtual_run.hpp"

using namespace bmu;

namespace {

const SimulatorConfig& emulated_pack() {
  static const SimulatorConfig config = [] {
    const auto pack = load_pack_config(test::in_source("config/packs/lipo-6s-24v.json"));
    FUZZ_CHECK(pack.has_value());
    return simulator_config(pack->core);
  }();
  return config;
}

void check_problems(const ScenarioProblems& problems, const std::vector<std::string_view>& lines) {
  std::uint32_t line_before = 0;
  for (const ScenarioProblem& problem : problems) {
    FUZZ_CHECK(problem.line >= std::max(1U, line_before) && problem.line <= lines.size());
    line_before = problem.line;
    FUZZ_CHECK(problem.column >= 1 && problem.column <= lines[problem.line - 1].size() + 1);
    FUZZ_CHECK(!problem.found.empty() && !problem.wanted.empty());
  }
}

bool is_same(const ScenarioValue& one, const ScenarioValue& other) {
  return one.kind == other.kind && one.is_random == other.is_random && one.number == other.number &&
         one.from == other.from && one.over == other.over && one.word == other.word;
}

void check_event(const ScenarioEvent& event) {
  const auto alone = parse_event(event.text, core_vocabulary());
  FUZZ_CHECK(alone && alone->property == event.property && alone->place == event.place);
  FUZZ_CHECK(is_same(alone->value, event.value) && alone->text == event.text);
}

void check_lines(const Scenario& scenario, const std::vector<std::string_view>& lines) {
  for (const ScenarioLine& line : scenario.lines) {
    FUZZ_CHECK(line.line >= 1 && line.line <= lines.size() && line.time.from <= line.time.to);
    if (line.verb == ScenarioVerb::event) check_event(line.event);
  }
}

void check_plan(const Scenario& scenario) {
  const ScenarioPlan plan = plan_scenario(scenario, 1);
  FUZZ_CHECK(plan.steps.size() <= plan_steps_max && plan.section_begins.back() == plan.steps.size());
  for (const ScenarioStep& step : plan.steps) {
    FUZZ_CHECK(step.line_index < scenario.lines.size() && step.at >= Duration::zero());
  }
}

/// Plays the first events; the others must not interfere.
void play(const Scenario& scenario) {
  Simulator simulator(emulated_pack(), scenario, TimePoint{1s});
  for (TimePoint now{1s}; now < TimePoint{1s} + 40ms; now += 1ms) static_cast<void>(simulator.advance(now));
  const ScriptVerdict verdict = simulator.script().conclude(TimePoint{1s} + 40ms);
  FUZZ_CHECK(verdict != ScriptVerdict::open);
  const bool is_told = !simulator.script().failure().empty();
  FUZZ_CHECK(is_told == (verdict == ScriptVerdict::failed || verdict == ScriptVerdict::unfinished));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text = fuzz::text_of(data, size);
  std::vector<std::string_view> lines = fuzz::lines_of(text);
  lines.emplace_back();  // after the last line feed
  static_cast<void>(parse_scenario(text));
  const ScenarioReading reading = read_scenario(text, core_vocabulary());
  check_problems(reading.problems, lines);
  check_lines(reading.scenario, lines);
  const auto scenario = parse_scenario(text, core_vocabulary());
  if (!scenario) {
    check_problems(scenario.error(), lines);
    return 0;
  }
  FUZZ_CHECK(reading.problems.empty());
  check_plan(*scenario);
  const ScenarioProblems misfits = check_against(*scenario, emulated_pack());
  check_problems(misfits, lines);
  if (misfits.empty()) play(*scenario);
  return 0;
}

#include "mmu/scenario/scenario_plan.hpp"

#include <algorithm>
#include <cmath>

#include "mmu/scenario/scenario_words.hpp"
#include "protocol/assert.hpp"

namespace bmu {

using scenario_text::duration_of;
using scenario_text::number_text;
using scenario_text::time_max_s;

namespace {

/// A separate sequence for the script: the world draws its noise from the same seed.
constexpr std::uint64_t script_sequence = 0x5C12'1977'0000'0001U;

/// Uniform, both ends included.
std::int64_t draw(RandomSource& random, std::int64_t from, std::int64_t to) {
  const auto span = static_cast<std::uint64_t>(to - from) + 1;
  return from + static_cast<std::int64_t>(random.next() % span);
}

/// Expands the lines. Without a seed every random time takes its latest value.
class Layout {
 public:
  Layout(const Scenario& scenario, std::optional<std::uint64_t> seed) : lines_(&scenario.lines) {
    if (seed) random_.emplace(*seed ^ script_sequence);
  }

  ScenarioPlan run() {
    lay_out(0, lines_->size());
    std::stable_sort(plan_.steps.begin(), plan_.steps.end(), [](const ScenarioStep& one, const ScenarioStep& other) {
      return one.section != other.section ? one.section < other.section : one.at < other.at;
    });
    for (std::uint32_t section = 0; section <= section_; ++section) {
      const auto first =
          std::lower_bound(plan_.steps.begin(), plan_.steps.end(), section,
                           [](const ScenarioStep& step, std::uint32_t wanted) { return step.section < wanted; });
      plan_.section_begins.push_back(static_cast<std::size_t>(first - plan_.steps.begin()));
    }
    plan_.section_begins.push_back(plan_.steps.size());
    return std::move(plan_);
  }
  [[nodiscard]] const std::optional<ScenarioProblem>& problem() const { return problem_; }

 private:
  void lay_out(std::size_t first, std::size_t last) {
    for (std::size_t index = first; index < last && !problem_; ++index) {
      const ScenarioLine& line = (*lines_)[index];
      before_ = time_of(line);
      if (line.verb == ScenarioVerb::repeat) {
        repeat(index);
        index = line.partner;
      } else if (!refuse(line)) {
        add(index);
      }
    }
  }

  void repeat(std::size_t index) {
    const ScenarioLine& line = (*lines_)[index];
    const bool has_every = line.every > Duration::zero();
    const Duration zero_outside = zero_;
    const std::uint32_t section_outside = section_;
    for (std::uint32_t turn = 0; turn < line.count && !problem_; ++turn) {
      const Duration begins = before_;
      zero_ = begins;
      lay_out(index + 1, line.partner);
      if (has_every) before_ = begins + line.every;
    }
    if (section_ == section_outside) zero_ = zero_outside;
  }

  void add(std::size_t index) {
    const ScenarioLine& line = (*lines_)[index];
    plan_.steps.push_back({static_cast<std::uint32_t>(index), section_, before_, line.event});
    if (random_) draw_value(*random_, plan_.steps.back().event);
    if (line.verb != ScenarioVerb::wait) return;
    ++section_;
    zero_ = before_ = Duration::zero();
  }

  [[nodiscard]] Duration time_of(const ScenarioLine& line) {
    if (line.time.kind == ScenarioTime::Kind::as_before) return before_;
    const Duration from = line.time.kind == ScenarioTime::Kind::relative ? before_ : zero_;
    if (!random_ || line.time.from == line.time.to) return from + line.time.to;
    return from + std::chrono::milliseconds(draw(*random_, to_ms(line.time.from), to_ms(line.time.to)));
  }

  /// Reports a line that is beyond the limits, which ends the layout.
  bool refuse(const ScenarioLine& line) {
    if (plan_.steps.size() >= plan_steps_max) {
      problem_ = {line.line, line.column, "'" + line.text + "'",
                  "at most " + std::to_string(plan_steps_max) + " lines, counted as often as they are repeated"};
    } else if (before_ > duration_of(time_max_s)) {
      problem_ = {line.line, line.column, "'" + line.text + "'",
                  "a time up to " + number_text(time_max_s) + " s; this one comes at " + number_text(to_s(before_))};
    }
    return problem_.has_value();
  }

  const std::vector<ScenarioLine>* lines_;
  std::optional<RandomSource> random_;
  ScenarioPlan plan_;
  std::optional<ScenarioProblem> problem_;
  std::uint32_t section_ = 0;
  Duration zero_{};    // origin of absolute times, in the section
  Duration before_{};  // time of the previous line, in the section
};

}  // namespace

ScenarioPlan plan_scenario(const Scenario& scenario, std::uint64_t seed) {
  Layout layout(scenario, seed);
  ScenarioPlan plan = layout.run();
  BMU_ASSERT(!layout.problem());
  return plan;
}

std::optional<ScenarioProblem> check_length(const Scenario& scenario) {
  Layout layout(scenario, std::nullopt);
  (void)layout.run();
  return layout.problem();
}

void draw_value(RandomSource& random, ScenarioEvent& event) {
  ScenarioValue& value = event.value;
  const double steps_per_unit = is_count(spec_of(event.property).kind) ? 1.0 : 1e3;
  if (!value.is_random) return;
  const auto drawn = static_cast<double>(
      draw(random, std::llround(value.from * steps_per_unit), std::llround(value.number * steps_per_unit)));
  value.number = std::clamp(drawn / steps_per_unit, value.from, value.number);
  value.is_random = false;
  event.text = event.text.substr(0, event.text.rfind("random")) + number_text(value.number);
}

}  // namespace bmu

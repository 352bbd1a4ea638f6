// A scenario laid out for one run: every turn of every repeat, with what is random drawn from a seed.
//
// Steps stand in sections. The first counts its times from the start of the run, each other one from the moment the
// wait before it was met; so a step's place is known before the run, its hour is not. The same scenario and seed give
// the same plan with every compiler. Draws are made in the order of the lines and turns, whatever happens in the run,
// and from their own sequence: the noise of a measurement does not change them.
#pragma once

#include "mmu/devices/random.hpp"
#include "mmu/scenario/scenario.hpp"

namespace bmu {

inline constexpr std::size_t plan_steps_max = 100'000;

struct ScenarioStep {
  std::uint32_t line_index = 0;  // in Scenario::lines
  std::uint32_t section = 0;
  Duration at{};        // from the beginning of its section
  ScenarioEvent event;  // of an event: its own copy, with the number that was drawn
};

struct ScenarioPlan {
  std::vector<ScenarioStep> steps;          // by section, then time; those of the same time in the order of the lines
  std::vector<std::size_t> section_begins;  // index of each section's first step, and the number of steps
};

/// `scenario` comes from the parser.
[[nodiscard]] ScenarioPlan plan_scenario(const Scenario& scenario, std::uint64_t seed);

/// What makes the plan too long or too late, whatever is drawn; at its line.
[[nodiscard]] std::optional<ScenarioProblem> check_length(const Scenario& scenario);

/// A value to be drawn, drawn in thousandths; others stay as they are.
void draw_value(RandomSource& random, ScenarioEvent& event);

}  // namespace bmu

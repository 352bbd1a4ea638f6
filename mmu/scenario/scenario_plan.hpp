// A scenario expanded for one run: every repetition of every repeat, with random values drawn from a seed.
//
// Steps are in sections. The first counts its times from the start of the run, every other one from the instant at
// which the wait before it was met; a step's position is therefore known before the run, its time is not. The same
// scenario and seed give the same plan with every compiler. Values are drawn in the order of the lines and repetitions,
// regardless of the run, and from their own sequence: the noise of a measurement does not change them.
#pragma once

#include "mmu/devices/random.hpp"
#include "mmu/scenario/scenario.hpp"

namespace bmu {

inline constexpr std::size_t plan_steps_max = 100'000;

struct ScenarioStep {
  std::uint32_t line_index = 0;  // in Scenario::lines
  std::uint32_t section = 0;
  Duration at{};        // from the start of its section
  ScenarioEvent event;  // of an event: its own copy, with the number that was drawn
};

struct ScenarioPlan {
  std::vector<ScenarioStep> steps;          // by section, then time; those of the same time in the order of the lines
  std::vector<std::size_t> section_begins;  // index of each section's first step, and the number of steps
};

/// Precondition: `scenario` comes from the parser.
[[nodiscard]] ScenarioPlan plan_scenario(const Scenario& scenario, std::uint64_t seed);

/// Problem that makes the plan too long, or too late with the latest draws; at its line.
[[nodiscard]] std::optional<ScenarioProblem> check_length(const Scenario& scenario);

/// Draws a random value in thousandths (a count in whole numbers); others stay as they are.
void draw_value(RandomSource& random, ScenarioEvent& event);

}  // namespace bmu

// Resistance of one cell by the 2013 method: the change of the voltage by a current step, divided by the step, averaged
// over the last steps (BMS_F.6). The caller decides whether two samples make a step, and whether they belong together.
//
// Cost: two divisions a step.
#pragma once

#include <cstdint>

namespace bmu {

/// Minimum number of steps before a resistance is reported.
inline constexpr std::uint8_t resistance_steps_min = 3;

struct StepAverage {
  std::int32_t resistance_uOhm = 0;  // 0: no step yet
  std::uint8_t steps = 0;            // counted up to resistance_steps_min

  /// Adds a step. `drop_uV`: decrease of the voltage as the current rose by `step_mA` (not 0, either sign). A result
  /// not above 0, or more than twenty times `model_uOhm`, is a loose bolt or an error, not a measurement, and is
  /// ignored.
  void take(std::int64_t drop_uV, std::int64_t step_mA, std::int64_t model_uOhm) {
    constexpr std::int64_t absurd_factor = 20;
    constexpr std::int32_t average_over = 4;
    const std::int64_t told_uOhm = drop_uV * 1'000 / step_mA;
    if (told_uOhm <= 0 || told_uOhm > absurd_factor * model_uOhm) return;
    const auto sample_uOhm = static_cast<std::int32_t>(told_uOhm);
    resistance_uOhm = steps == 0 ? sample_uOhm : resistance_uOhm + (sample_uOhm - resistance_uOhm) / average_over;
    if (steps < resistance_steps_min) ++steps;
  }
  [[nodiscard]] bool is_known() const { return steps >= resistance_steps_min; }
};

}  // namespace bmu

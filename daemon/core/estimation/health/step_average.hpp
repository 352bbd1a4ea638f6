// One cell's resistance as the 2013 method has it: what a step of the current did to the voltage, divided by the step,
// averaged over the last steps (BMS_F.6). Whether two samples make a step, and whether they belong together, is for the
// caller to say.
//
// Cost: two divisions a step.
#pragma once

#include <cstdint>

namespace bmu {

/// Steps a resistance is averaged over before it is told.
inline constexpr std::uint8_t resistance_steps_min = 3;

struct StepAverage {
  std::int32_t resistance_uOhm = 0;  // 0: no step yet
  std::uint8_t steps = 0;            // counted up to resistance_steps_min

  /// `drop_uV`: by how much the voltage fell as the current rose by `step_mA` (not 0, either sign). What is not above
  /// 0, or more than twenty times `model_uOhm`, is a loose bolt or a mistake, not a measurement, and is passed over.
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

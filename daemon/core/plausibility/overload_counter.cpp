#include "daemon/core/plausibility/overload_counter.hpp"

#include <algorithm>

namespace bmu {

namespace {

constexpr Duration gap_max = 1s;

constexpr std::int64_t square_cA2(std::int32_t current_mA) {
  const std::int64_t current_cA = (std::int64_t{current_mA} + 9) / 10;  // rounded up: never less heat than in reality
  return current_cA * current_cA;
}

std::int32_t magnitude_out(std::int32_t current_mA) {
  return std::max(current_mA, 0);
}
std::int32_t magnitude_in(std::int32_t current_mA) {
  return std::max(-current_mA, 0);
}

}  // namespace

void OverloadCounter::Heat::init(std::int32_t continuous_mA, std::int32_t peak_mA, Duration peak_for) {
  const std::int64_t peak_us = std::chrono::duration_cast<std::chrono::microseconds>(peak_for).count();
  continuous_cA2 = square_cA2(continuous_mA);
  budget = std::max<std::int64_t>(square_cA2(peak_mA) - continuous_cA2, 0) * peak_us;
  used = 0;
}

void OverloadCounter::Heat::count(std::int32_t magnitude_mA, std::int64_t span_us) {
  // Twice the budget is far beyond it, and bounds the time to cool down.
  const std::int64_t more = (square_cA2(magnitude_mA) - continuous_cA2) * span_us;
  used = static_cast<std::uint64_t>(std::clamp<std::int64_t>(static_cast<std::int64_t>(used) + more, 0, 2 * budget));
}

std::int64_t OverloadCounter::Heat::used_permille() const {
  return budget < 1'000 ? 0 : static_cast<std::int64_t>(used) / (budget / 1'000);
}

void OverloadCounter::init(const CurrentLimitConfig& config) {
  discharge_.init(config.discharge_continuous_mA, config.discharge_peak_mA, config.discharge_peak_for);
  charge_.init(config.charge_continuous_mA, config.charge_peak_mA, config.charge_peak_for);
  last_mA_ = {};
}

void OverloadCounter::observe(const Measured<std::int32_t>& current_mA) {
  const Duration span = current_mA.taken_at - last_mA_.taken_at;
  if (last_mA_.is_valid() && span > Duration{} && span <= gap_max) {
    const std::int64_t span_us = std::chrono::duration_cast<std::chrono::microseconds>(span).count();
    discharge_.count(std::min(magnitude_out(last_mA_.value), magnitude_out(current_mA.value)), span_us);
    charge_.count(std::min(magnitude_in(last_mA_.value), magnitude_in(current_mA.value)), span_us);
  }
  last_mA_ = current_mA;
}

}  // namespace bmu

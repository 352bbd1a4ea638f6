#include "daemon/core/limits/limit_ramp.hpp"

#include <algorithm>

namespace bmu {

namespace {

constexpr std::int64_t uA_per_mA = 1'000;
constexpr Duration passed_max = 1s;
constexpr Duration patience = 1s;

std::int64_t way_uA(std::int32_t rate_mA_per_s, Duration passed) {
  return rate_mA_per_s * (passed / 1us) / uA_per_mA;
}

/// Protection: no current may flow from this instant on. And a pause for a measurement by a step has to be a step.
bool falls_at_once(const CurrentLimit& target) {
  return target.limit_mA == 0 && (is_protection(target.cause) || target.cause == LimitCause::measuring);
}

/// Minimum distance of the target above the limit for a rise to start. A cause that is not measured has no noise.
std::int64_t band_uA(const CurrentLimit& target) {
  constexpr std::int64_t parts = 20;
  return is_measured_cause(target.cause) ? target.unhindered_mA * uA_per_mA / parts : 0;
}

CurrentLimit rising_to(const CurrentLimit& target) {
  return {.cause = LimitCause::rising, .unhindered_mA = target.limit_mA};
}

}  // namespace

CurrentLimit LimitRamp::follow(const CurrentLimit& target, Duration since, const RampRates& rates) {
  const Duration passed = std::clamp(since, Duration{}, passed_max);
  const std::int64_t target_uA = target.limit_mA * uA_per_mA;
  const bool was_begun = is_begun_;
  is_begun_ = target.cause != LimitCause::not_connected;
  if (!was_begun || falls_at_once(target)) {
    worth_for_ = Duration{};
    limit_uA_ = target_uA;
    return target;
  }
  const std::int64_t above_uA = target_uA - limit_uA_;
  const bool is_rising = waits_no_longer(above_uA, target, passed, rates);
  if (is_rising) {
    limit_uA_ += rates.rise_mA_per_s == 0 ? above_uA : std::min(above_uA, way_uA(rates.rise_mA_per_s, passed));
  } else if (above_uA < 0) {
    limit_uA_ += rates.fall_mA_per_s == 0 ? above_uA : std::max(above_uA, -way_uA(rates.fall_mA_per_s, passed));
  }
  const bool is_on_its_way_up = is_rising && limit_uA_ < target_uA;
  if (!is_on_its_way_up && is_rising) worth_for_ = Duration{};  // target reached
  CurrentLimit limit = is_on_its_way_up ? rising_to(target) : target;
  limit.limit_mA = static_cast<std::int32_t>(limit_uA_ / uA_per_mA);
  return limit;
}

bool LimitRamp::waits_no_longer(std::int64_t above_uA, const CurrentLimit& target, Duration passed,
                                const RampRates& rates) {
  if (rates.rise_mA_per_s == 0) return above_uA > 0;
  const bool was_rising = worth_for_ >= patience;
  const bool is_worth_it = above_uA > (was_rising ? 0 : band_uA(target));
  worth_for_ = is_worth_it ? std::min(worth_for_ + passed, patience) : Duration{};
  return worth_for_ >= patience;
}

CurrentLimits LimitRamps::follow(const CurrentLimits& targets, TimePoint now, const LimitRampConfig& config) {
  const Duration passed = now - followed_at_;
  followed_at_ = now;
  const RampRates out{config.discharge_fall_mA_per_s, config.discharge_rise_mA_per_s};
  const RampRates in{config.charge_fall_mA_per_s, config.charge_rise_mA_per_s};
  return {.discharge = discharge_.follow(targets.discharge, passed, out),
          .charge = charge_.follow(targets.charge, passed, in),
          .discharge_continuous = discharge_continuous_.follow(targets.discharge_continuous, passed, out),
          .charge_continuous = charge_continuous_.follow(targets.charge_continuous, passed, in)};
}

}  // namespace bmu

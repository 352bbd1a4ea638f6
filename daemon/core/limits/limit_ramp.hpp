// Ramp of a limit: bounds its rate of fall and of rise, so that a device that follows the limit can keep up, and does
// not oscillate with it.
//
// A limit that is answered with less current removes its own cause: the voltage recovers, and the limit rises again.
// Followed with a delay, and sent once a second, it would oscillate between all and nothing permanently. A fast fall
// and a slow rise end that: the limit settles where its cause just applies, and the remaining oscillation is the rise
// within the delay.
//
// Protection does not wait: a limit falls at once where a fault or a threshold leaves nothing, or the contactors are
// not closed.
//
// Nor does a limit follow the noise of a measured value: it starts to rise once its target has been above it for a
// second without interruption, by a twentieth of the limit without its cause; then it rises all the way. Causes without
// noise, a component or the user's limit, need the second only. After the contactors have closed a limit starts at its
// target, because no device has followed it yet.
#pragma once

#include <cstdint>

#include "daemon/core/limits/limits.hpp"
#include "protocol/fields.hpp"
#include "protocol/time.hpp"

namespace bmu {

/// Rates in one direction of the current; 0: at once.
struct RampRates {
  std::int32_t fall_mA_per_s = 0;
  std::int32_t rise_mA_per_s = 0;
};

class LimitRamp {
 public:
  /// Limit after the time `since`, on its way to `target`. A time below 0 moves nothing, and one above a second, i.e. a
  /// stall, no more than a second does. A rate of 0 is no ramp: the limit is its target. On the way up the cause is
  /// `rising`, else the target's, although it may be less than its target.
  [[nodiscard]] CurrentLimit follow(const CurrentLimit& target, Duration since, const RampRates& rates);

 private:
  [[nodiscard]] bool waits_no_longer(std::int64_t above_uA, const CurrentLimit& target, Duration passed,
                                     const RampRates& rates);

  std::int64_t limit_uA_ = 0;  // finer than the published value: a short tick moves less than 1 mA
  Duration worth_for_{};       // time for which a rise has been justified
  bool is_begun_ = false;      // contactors are closed, and a device may follow it
  BMU_FIELDS(limit_uA_, worth_for_, is_begun_)
};

/// The four limits of a pack.
class LimitRamps {
 public:
  /// Once a tick.
  [[nodiscard]] CurrentLimits follow(const CurrentLimits& targets, TimePoint now, const LimitRampConfig& config);

 private:
  LimitRamp discharge_;
  LimitRamp charge_;
  LimitRamp discharge_continuous_;
  LimitRamp charge_continuous_;
  TimePoint followed_at_{};
  BMU_FIELDS(discharge_, charge_, discharge_continuous_, charge_continuous_, followed_at_)
};

}  // namespace bmu

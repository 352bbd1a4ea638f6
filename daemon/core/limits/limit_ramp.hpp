// Lets a limit fall and rise no faster than it may, so that who obeys it can follow, and does not swing with it.
//
// A limit that is answered with less current takes back its own reason: the voltage recovers, and the limit rises
// again. Obeyed with a delay, and told once a second, that swings between all and nothing for ever. Falling quickly
// and rising slowly ends it: the limit comes to rest where its reason just holds, and what is left of the swing is what
// it rises within the delay.
//
// What protects does not wait: a limit falls at once where a fault or a threshold leaves nothing, or the contactors are
// not closed.
//
// Nor does a limit follow the noise of what was measured: it begins to rise once its target has been above it for a
// second without a break, and by a twentieth of what there is without its reason; then it goes all the way. Reasons
// that stand still, a part or the user's wish, need the second only. And where contactors have just been closed a limit
// begins with what is allowed, for nobody has followed it yet.
#pragma once

#include <cstdint>

#include "daemon/core/limits/limits.hpp"
#include "protocol/fields.hpp"
#include "protocol/time.hpp"

namespace bmu {

/// In one direction of the current; 0: at once.
struct RampRates {
  std::int32_t fall_mA_per_s = 0;
  std::int32_t rise_mA_per_s = 0;
};

class LimitRamp {
 public:
  /// Where the limit is at the end of `passed`, on its way to `target`. Of a time below 0 nothing moves, and of one
  /// above a second, in which nobody looked, no more than in a second. A rate of 0 is none: the limit is its target.
  /// On the way up the cause is `rising`, else the target's, although it may be less than its target.
  [[nodiscard]] CurrentLimit follow(const CurrentLimit& target, Duration since, const RampRates& rates);

 private:
  [[nodiscard]] bool waits_no_longer(std::int64_t above_uA, const CurrentLimit& target, Duration passed,
                                     const RampRates& rates);

  std::int64_t limit_uA_ = 0;  // finer than what is told: a short tick moves less than 1 mA
  Duration worth_for_{};       // how long a rise has been worth it
  bool is_begun_ = false;      // contactors are closed, and somebody may obey it
  BMU_FIELDS(limit_uA_, worth_for_, is_begun_)
};

/// The four of a pack.
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

// Checks that a state of charge changes no faster than permitted: by the charge that can flow, and by the rate at which
// the published value follows the estimate (daemon/core/estimation/soc/published_soc.hpp), which is lower after the
// first five minutes. Used by the oracle of the short runs and by the long run.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>

#include "daemon/core/estimation/soc/published_soc.hpp"
#include "daemon/core/types/core_config.hpp"
#include "protocol/time.hpp"

namespace bmu::test {

class SocWatch {
 public:
  explicit SocWatch(const CoreConfig& config) : flow_permille_per_s_(flow_permille_per_s(config)) {}

  /// The next value is a start: it may be anything, and follows fast for its first minutes.
  void begin_anew() {
    band_.reset();
    began_at_.reset();
  }
  /// The next value may be anything, e.g. after a current that was measured wrongly; it is no start.
  void allow_step() { band_.reset(); }

  /// False: it has moved further than permitted, from any time before. `now` does not go back.
  [[nodiscard]] bool follow(double told_permille, TimePoint now) {
    if (!began_at_) began_at_ = now;
    if (!band_) {
      band_ = Band{told_permille, told_permille};
      followed_at_ = now;
    }
    const double rate = rate_permille_per_s(now);
    // The value is a whole number, and steps with the estimate, which without samples is made each second.
    const double step = 1.0 + rate * estimate_apart_s;
    const double passed_s = to_s(now - followed_at_);
    band_->low -= rate * passed_s;
    band_->high += rate * passed_s;
    followed_at_ = now;
    const bool is_possible = told_permille >= band_->low - step && told_permille <= band_->high + step;
    // A jump is reported once.
    if (!is_possible) band_ = Band{told_permille, told_permille};
    band_->low = std::max(band_->low, told_permille);
    band_->high = std::min(band_->high, told_permille);
    return is_possible;
  }

 private:
  static constexpr double permille = 1e3;
  static constexpr double estimate_apart_s = 1.1;
  /// The core counts its minutes from one estimate to the next.
  static constexpr double begin_slack_s = 2.0;

  /// Maximum of the charge that can flow in a second, as a share of the capacity.
  static double flow_permille_per_s(const CoreConfig& config) {
    constexpr double beyond_limit = 1.5;
    const double most_mA = std::max(config.limits.discharge_overcurrent.open, config.limits.charge_overcurrent.open);
    return beyond_limit * permille * most_mA * 1e3 / static_cast<double>(config.cell.capacity_uAs);
  }
  [[nodiscard]] double rate_permille_per_s(TimePoint now) const {
    const bool is_young = to_s(now - *began_at_) <= published_begin_s + begin_slack_s;
    return permille * (is_young ? published_begin_rate_per_s : published_rate_per_s) + flow_permille_per_s_;
  }

  struct Band {  // range of the next value without a jump
    double low = 0.0;
    double high = 0.0;
  };
  double flow_permille_per_s_;
  std::optional<TimePoint> began_at_;
  TimePoint followed_at_{};
  std::optional<Band> band_;
};

}  // namespace bmu::test

// Whether a state of charge moves no faster than it may: by what can flow, and by the rate at which what is told
// follows the estimate (daemon/core/estimation/soc/published_soc.hpp), which is lower once it has been told for five
// minutes. The oracle of short lives and the long life both ask it.
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

  /// What is told next is a beginning: it may be anything, and follows fast for its first minutes.
  void begin_anew() {
    band_.reset();
    began_at_.reset();
  }
  /// What is told next may be anything, as where what flowed was told wrongly; it is no beginning.
  void allow_step() { band_.reset(); }

  /// False: it has moved further than it may, from this or that moment before. `now` does not go back.
  [[nodiscard]] bool follow(double told_permille, TimePoint now) {
    if (!began_at_) began_at_ = now;
    if (!band_) {
      band_ = Band{told_permille, told_permille};
      followed_at_ = now;
    }
    const double rate = rate_permille_per_s(now);
    // The number is a whole one, and steps with the estimate, which where nothing comes is made each second.
    const double step = 1.0 + rate * estimate_apart_s;
    const double passed_s = to_s(now - followed_at_);
    band_->low -= rate * passed_s;
    band_->high += rate * passed_s;
    followed_at_ = now;
    const bool is_possible = told_permille >= band_->low - step && told_permille <= band_->high + step;
    // One that has stepped is said once.
    if (!is_possible) band_ = Band{told_permille, told_permille};
    band_->low = std::max(band_->low, told_permille);
    band_->high = std::min(band_->high, told_permille);
    return is_possible;
  }

 private:
  static constexpr double permille = 1e3;
  static constexpr double estimate_apart_s = 1.1;
  /// The core counts its minutes from an estimate to the next.
  static constexpr double begin_slack_s = 2.0;

  /// How much charge can flow in a second at the most, as a share of the capacity.
  static double flow_permille_per_s(const CoreConfig& config) {
    constexpr double beyond_limit = 1.5;
    const double most_mA = std::max(config.limits.discharge_overcurrent.open, config.limits.charge_overcurrent.open);
    return beyond_limit * permille * most_mA * 1e3 / static_cast<double>(config.cell.capacity_uAs);
  }
  [[nodiscard]] double rate_permille_per_s(TimePoint now) const {
    const bool is_young = to_s(now - *began_at_) <= published_begin_s + begin_slack_s;
    return permille * (is_young ? published_begin_rate_per_s : published_rate_per_s) + flow_permille_per_s_;
  }

  struct Band {  // where the next can be without a step
    double low = 0.0;
    double high = 0.0;
  };
  double flow_permille_per_s_;
  std::optional<TimePoint> began_at_;
  TimePoint followed_at_{};
  std::optional<Band> band_;
};

}  // namespace bmu::test

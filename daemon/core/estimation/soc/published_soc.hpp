// Published state of charge: it follows the current at once and the estimate slowly, so that it never steps.
//
//   published += charge that flowed + at most `rate` * dt of the difference to the estimate
//
// A driver, a charger and a vehicle's computer take a step for a fault. Soon after a start, while it is not in use yet,
// it may move faster.
#pragma once

#include <algorithm>
#include <cmath>

#include "protocol/fields.hpp"

namespace bmu {

inline constexpr double published_rate_per_s = 0.0002;      // 0.02 % a second
inline constexpr double published_begin_rate_per_s = 0.02;  // 2 % a second
inline constexpr double published_begin_s = 300.0;          // time after a start with that rate

class PublishedSoc {
 public:
  /// Sets the value directly: at the first start, and after a rest so long that an estimate from rest is better than
  /// the published value.
  void begin(double soc) {
    soc_ = soc;
    age_s_ = 0.0;
  }
  /// `flowed`: charge that left the cell since the last update, as a share of its capacity. Values that are not finite
  /// change nothing; with a time that is not above 0 and finite there is no update.
  void update(double passed_s, double flowed, double estimate) {
    if (!(passed_s > 0.0) || !std::isfinite(passed_s)) return;
    age_s_ += passed_s;
    const double rate_per_s = age_s_ <= published_begin_s ? published_begin_rate_per_s : published_rate_per_s;
    const double at_most = rate_per_s * passed_s;
    if (std::isfinite(flowed)) soc_ -= flowed;
    const double missing = std::isfinite(estimate) ? estimate - soc_ : 0.0;
    soc_ = std::clamp(soc_ + std::clamp(missing, -at_most, at_most), 0.0, 1.0);
  }
  [[nodiscard]] double soc() const { return soc_; }

 private:
  double soc_ = 0.0;
  double age_s_ = 0.0;
  [[nodiscard]] bool are_fields_possible() const { return is_within(soc_, 0.0, 1.0); }
  BMU_FIELDS(soc_, age_s_)
};

}  // namespace bmu

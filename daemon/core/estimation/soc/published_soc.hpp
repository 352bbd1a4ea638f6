// The state of charge that is told: it follows the current at once and the estimate slowly, so that it never steps.
//
//   told += what flowed + at most `rate` * dt of what it differs from the estimate by
//
// A driver, a charger and a vehicle's computer take a step for a fault. Soon after a start, while nobody has relied on
// it yet, it may move faster.
#pragma once

#include <algorithm>
#include <cmath>

#include "protocol/fields.hpp"

namespace bmu {

inline constexpr double published_rate_per_s = 0.0002;      // 0.02 % a second
inline constexpr double published_begin_rate_per_s = 0.02;  // 2 %
inline constexpr double published_begin_s = 300.0;          // while so young

class PublishedSoc {
 public:
  /// Set directly: at the first start, and after a rest so long that an estimate from rest is better than what was
  /// told.
  void begin(double soc) {
    soc_ = soc;
    age_s_ = 0.0;
  }
  /// `flowed`: what left the cell since the last update, as a share of its capacity. What is not a number moves
  /// nothing; a time that is none is no update.
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

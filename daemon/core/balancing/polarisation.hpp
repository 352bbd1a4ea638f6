// How far the part of a cell's voltage that follows the current late may be off: what its two pairs of resistance and
// capacitance hold back, either way, at the most.
//
//   bound of a pair = max(R * |I|, bound a moment ago * exp(-dt / tau))
//
// A pair's voltage runs after R * I with its time constant, so it never exceeds that: it rises at once and falls as
// slowly as the pair. Whatever flowed, in whichever order. All cells in series have carried the same current, so what
// two of them differ by is this times the difference of their resistances. While the current is not known it counts as
// the largest that is allowed. What flowed before it was known for the first time nobody knows, and it is not counted.
//
// Cost: two exponentials an update.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "daemon/core/cell/cell_model.hpp"
#include "daemon/core/types/measured.hpp"
#include "protocol/fields.hpp"
#include "protocol/time.hpp"

namespace bmu {

class PolarisationBound {
 public:
  /// `current_max_mA`: the largest that may flow for long, either way.
  void init(const CellModel& cell, std::int32_t current_max_mA) {
    *this = {};
    fast_ = {.resistance_Ohm = cell.rc_resistance_Ohm, .time_constant_s = cell.rc_time_constant_s};
    slow_ = {.resistance_Ohm = cell.slow_rc_resistance_Ohm, .time_constant_s = cell.slow_rc_time_constant_s};
    current_max_mA_ = current_max_mA;
  }
  /// Often: between two updates the current counts as that of the later one, so the gap must be shorter than it swings.
  void update(TimePoint now, const Measured<std::int32_t>& current_mA) {
    is_begun_ = is_begun_ || current_mA.is_valid();
    if (!is_begun_) return;
    const double passed_s = updated_at_ == TimePoint{} ? 0.0 : to_s(now - updated_at_);
    updated_at_ = now;
    const double at_most_mA = current_mA.is_valid() ? std::abs(current_mA.value) : current_max_mA_;
    fast_.update(passed_s, at_most_mA);
    slow_.update(passed_s, at_most_mA);
  }
  /// Of a cell with the file's resistances at 25 C; 0 or more.
  [[nodiscard]] double most_uV() const { return fast_.most_uV + slow_.most_uV; }

 private:
  struct Pair {
    double resistance_Ohm = 0.0;
    double time_constant_s = 0.0;
    double most_uV = 0.0;

    void update(double passed_s, double at_most_mA) {
      constexpr double uV_per_mV = 1e3;
      const double left = time_constant_s > 0.0 ? most_uV * std::exp(-passed_s / time_constant_s) : 0.0;
      most_uV = std::max(resistance_Ohm * at_most_mA * uV_per_mV, left);
    }
    [[nodiscard]] bool are_fields_possible() const { return is_within(most_uV, 0.0, 1e12); }
    BMU_FIELDS(skipped(resistance_Ohm), skipped(time_constant_s), most_uV)
  };

  Pair fast_;
  Pair slow_;
  std::int32_t current_max_mA_ = 0;
  bool is_begun_ = false;
  TimePoint updated_at_{};
  BMU_FIELDS(fast_, slow_, skipped(current_max_mA_), is_begun_, updated_at_)
};

}  // namespace bmu

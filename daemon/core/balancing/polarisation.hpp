// Upper bound of the polarisation of a cell: the voltage of its two RC elements, which follow the current with a delay,
// either way.
//
//   bound of an RC element = max(R * |I|, its previous bound * exp(-dt / tau))
//
// The voltage of an RC element follows R * I with its time constant, so it never exceeds that bound, which rises at
// once and falls as slowly as the element, whatever flowed in whichever order. All cells in series have carried the
// same current, so the difference of two of them is this times the difference of their resistances. While the current
// is unknown it counts as the largest permitted one. The current before it was known for the first time is unknown, and
// is not counted.
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
  /// `current_max_mA`: the largest continuous current, either way.
  void init(const CellModel& cell, std::int32_t current_max_mA) {
    *this = {};
    fast_ = {.resistance_Ohm = cell.rc_resistance_Ohm, .time_constant_s = cell.rc_time_constant_s};
    slow_ = {.resistance_Ohm = cell.slow_rc_resistance_Ohm, .time_constant_s = cell.slow_rc_time_constant_s};
    current_max_mA_ = current_max_mA;
  }
  /// Call often: between two updates the current counts as that of the later one, so the gap must be shorter than it
  /// swings.
  void update(TimePoint now, const Measured<std::int32_t>& current_mA) {
    is_begun_ = is_begun_ || current_mA.is_valid();
    if (!is_begun_) return;
    const double passed_s = updated_at_ == TimePoint{} ? 0.0 : to_s(now - updated_at_);
    updated_at_ = now;
    const double at_most_mA = current_mA.is_valid() ? std::abs(current_mA.value) : current_max_mA_;
    fast_.update(passed_s, at_most_mA);
    slow_.update(passed_s, at_most_mA);
  }
  /// For a cell with the file's resistances at 25 C; 0 or more.
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

// What an estimator of the state of charge is given, and what it says: the same for each, so that they run beside each
// other and can be compared. An estimator is a class with
//
//   void begin(const CellDynamics&, const CurrentSensorError&, const SocBegin&, double temperature_C);
//   void update(const CellSample&);
//   SocEstimate estimate() const;
//
// Pure: no clock, no allocation; the same samples give the same estimates. Before begin() samples are passed over and
// nothing is known.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string_view>

#include "daemon/core/types/soc_method.hpp"

namespace bmu {

/// Stands for what was not measured. Estimators never take a guess for it.
inline constexpr double not_measured = std::numeric_limits<double>::quiet_NaN();

/// No current, voltage or temperature is that large, and no time between two samples that long: whose square still is
/// a number.
inline constexpr double measured_most = 1e6;
inline constexpr double passed_most_s = 1e10;

/// More charge than any cell holds, for what is read from outside: 27 kAh.
inline constexpr double charge_most_As = 1e8;

[[nodiscard]] inline bool is_measured(double value) {
  return std::abs(value) < measured_most;  // not so if it is not a number
}

/// Of independent errors together. std::hypot() takes longer, for the sake of numbers too large or too small to be
/// squared, of which there are none here.
[[nodiscard]] inline double root_sum_square(double one, double other, double third = 0.0) {
  return std::sqrt(one * one + other * other + third * third);
}

/// One cell at one instant.
struct CellSample {
  double passed_s = 0.0;  // since the sample before; not above 0 (time ran backwards) or beyond all bounds: no sample
  double mean_current_A = not_measured;  // over that time, out of the cell: what was counted, divided by it
  double current_A = not_measured;       // when the voltage was taken
  double voltage_V = not_measured;
  double temperature_C = not_measured;
  double unseen_current_A = not_measured;  // what may have flowed uncounted; not given: what the sensor's error says

  [[nodiscard]] bool has_passed() const { return passed_s > 0.0 && passed_s < passed_most_s; }
};

/// Where an estimator starts: what is believed, and how well.
struct SocBegin {
  double soc = 0.5;         // 0 to 1; beyond counts as the end
  double sigma = 0.3;       // one standard deviation, above 0
  bool is_rested = true;    // false: what flowed before is not known, and the voltage still follows it
  double hysteresis = 0.0;  // -1: discharged last, 1: charged last
  /// It goes on where a filter of a former life ended, with its model_sigma(), so long ago (not known: not given).
  bool has_followed = false;
  double age_s = not_measured;
  /// Of this cell, where somebody has learned it, one standard deviation as a share of it; else that of the model.
  double capacity_As = not_measured;
  double capacity_sigma = 0.02;

  [[nodiscard]] double capacity_or(double model_As) const { return capacity_As > 0.0 ? capacity_As : model_As; }
};

/// What the current sensor may do wrong, one standard deviation.
struct CurrentSensorError {
  double gain = 0.01;
  double offset_A = 0.01;
  double unknown_current_A = 1.0;  // what may flow while it says nothing

  /// What may have flowed unseen during a sample: nothing if it was counted.
  [[nodiscard]] double unseen_A(const CellSample& sample) const {
    if (is_measured(sample.mean_current_A)) return 0.0;
    return is_measured(sample.unseen_current_A) ? std::abs(sample.unseen_current_A) : unknown_current_A;
  }
};

struct SocEstimate {
  bool is_known = false;
  double soc = 0.0;    // 0 to 1
  double sigma = 1.0;  // the truth lies within two of these in some 95 of 100 cases
};

}  // namespace bmu

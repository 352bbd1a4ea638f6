// Input and output of an estimator of the state of charge: the same for each, so that they run side by side and can be
// compared. An estimator is a class with
//
//   void begin(const CellDynamics&, const CurrentSensorError&, const SocBegin&, double temperature_C);
//   void update(const CellSample&);
//   SocEstimate estimate() const;
//
// Pure: no clock, no allocation; the same samples give the same estimates. Before begin() samples are ignored and the
// estimate is unknown.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string_view>

#include "daemon/core/types/soc_method.hpp"

namespace bmu {

/// Value of a quantity that was not measured. Estimators never replace it by a guess.
inline constexpr double not_measured = std::numeric_limits<double>::quiet_NaN();

/// Bounds of all currents, voltages and temperatures, and of the time between two samples: their squares are still
/// finite.
inline constexpr double measured_most = 1e6;
inline constexpr double passed_most_s = 1e10;

/// Upper bound of the charge of a cell, for values read from outside: 27 kAh.
inline constexpr double charge_most_As = 1e8;

[[nodiscard]] inline bool is_measured(double value) {
  return std::abs(value) < measured_most;  // false for not-a-number
}

/// Combined error of independent errors. std::hypot() takes longer, because it handles numbers too large or too small
/// to be squared; there are none here.
[[nodiscard]] inline double root_sum_square(double one, double other, double third = 0.0) {
  return std::sqrt(one * one + other * other + third * third);
}

/// Sample of one cell at one instant.
struct CellSample {
  double passed_s = 0.0;  // since the previous sample; not above 0 (time ran backwards) or beyond all bounds: no sample
  double mean_current_A = not_measured;  // over that time, out of the cell: the counted charge divided by it
  double current_A = not_measured;       // when the voltage was taken
  double voltage_V = not_measured;
  double temperature_C = not_measured;
  double unseen_current_A = not_measured;  // that may have flowed uncounted; not given: by the sensor's error

  [[nodiscard]] bool has_passed() const { return passed_s > 0.0 && passed_s < passed_most_s; }
};

/// Initial state of an estimator, and its uncertainty.
struct SocBegin {
  double soc = 0.5;         // 0 to 1; a value beyond counts as the end
  double sigma = 0.3;       // one standard deviation, above 0
  bool is_rested = true;    // false: the current before is unknown, and the voltage still contains its polarisation
  double hysteresis = 0.0;  // -1: discharged last, 1: charged last
  /// True: continues a filter of a previous session, with its model_sigma(), after this time (not known: not given).
  bool has_followed = false;
  double age_s = not_measured;
  /// Capacity of this cell, if it has been learned, and one standard deviation as a share of it; else that of the
  /// model.
  double capacity_As = not_measured;
  double capacity_sigma = 0.02;

  [[nodiscard]] double capacity_or(double model_As) const { return capacity_As > 0.0 ? capacity_As : model_As; }
};

/// Errors of the current sensor, one standard deviation.
struct CurrentSensorError {
  double gain = 0.01;
  double offset_A = 0.01;
  double unknown_current_A = 1.0;  // that may flow while the sensor is silent

  /// Current that may have flowed uncounted during a sample: 0 if it was counted.
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

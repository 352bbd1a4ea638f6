// Resistance that a cell is expected to show about a second after a step of the current, by its model: reference for a
// measured resistance, and conversion of one from one temperature to another.
//
//   expected(T) = R0 + V_kinetic(I1) / I1 + sum of Rk * t / (t + tau_k)       at half charge; I1: 1C
//
// t is two seconds: that share of an RC element is seen through high-passes of that time, as ResistanceTracker has
// them, by a fit of a straight line between the two (the integral of the remainder of both over that of the current's
// square). A single RC element would show as much of itself 1.1 to 2 s after a step. A cell has many RC elements of all
// time constants, and there t / (t + tau) is in the middle between the parts that show before and after t * exp(-0.577)
// = 1.1 s (0.577: Euler's constant).
//
// By the tables of CellDynamics and not by one Arrhenius factor: the part that shows within a second depends less on
// the temperature than the later part. For a cell without tables (dynamics_of) the two are the same.
//
// Computed once, when the cell is known, and shared by all cells of a kind. Pure; no error: every model has a value.
#pragma once

#include <array>
#include <cstddef>

#include "daemon/core/cell/cell_dynamics.hpp"

namespace bmu {

inline constexpr double resistance_reference_C = 25.0;
/// t above.
inline constexpr double resistance_pass_time_s = 2.0;

class ExpectedResistance {
 public:
  ExpectedResistance() = default;
  explicit ExpectedResistance(const CellDynamics& cell);

  /// At 25 C; above 0.
  [[nodiscard]] double at_reference_Ohm() const { return at_reference_Ohm_; }
  /// Factor for the resistance at 25 C; above 0. Between -50 and 100 C; beyond, that of the end. Without a temperature
  /// (not_measured) it is not a number, unless the model has the same resistance at every temperature. Cost: a table
  /// lookup, two multiplications.
  [[nodiscard]] double factor(double temperature_C) const;
  /// 1C: the current that empties the cell within the hour; above 0.
  [[nodiscard]] double hour_current_A() const { return hour_current_A_; }

 private:
  static constexpr double lowest_C = -50.0;
  static constexpr double step_C = 2.5;  // between two entries the factor is linear to some 0.2 %
  static constexpr std::size_t entries = 61;

  double at_reference_Ohm_ = 1.0;
  double hour_current_A_ = 1.0;
  bool is_same_everywhere_ = true;
  std::array<double, entries> factor_{};
};

}  // namespace bmu

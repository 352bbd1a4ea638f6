// Cell model for the estimators: voltage as a function of charge, temperature and current, in measured tables. Made by
// `bmucell fit` from test data and written into a cell file, or derived from the few numbers of a CellModel.
//
//   voltage = OCV(z, T) + h * H(z, T) - I * R0(z, T) - K(z, T) * asinh(I / I0(T)) * I0(T) - U1 - U2 - U3
//   dUk/dt  = (I * Rk(z, T) - Uk) / tau_k
//   dh/dq   = (-sign(I) - h) / q0
//
// z is the state of charge, 0 empty to 1 full; I is positive out of the cell; q the charge throughput in both
// directions. OCV is the middle between the curves of charging and discharging, H half of their difference. K is the
// charge transfer resistance, which falls as the current rises: the inverse of the Butler-Volmer equation with equal
// transfer coefficients. In the warm it acts as a plain resistance; in the cold, where I0 is small, it reduces the
// apparent resistance of a cell under load. (G. L. Plett, Battery Management Systems, Vol. I, Artech House 2015,
// chapter 2; A. Bard, L. Faulkner, Electrochemical Methods, 2nd ed., Wiley 2001, section 3.4.)
//
// Between the temperature rows all values are interpolated along the Arrhenius factor exp(a * (1/T - 1/298.15 K)), in
// which a resistance that follows Arrhenius' law is a straight line; beyond the rows the nearest row applies to the
// curves, and the law extrapolates the resistances.
#pragma once

#include <array>
#include <cstddef>

#include "daemon/core/cell/cell_model.hpp"
#include "protocol/fixed_vector.hpp"

namespace bmu {

/// Values at equal steps of the SOC from 0 to 1.
template <std::size_t Points>
using OverCharge = std::array<double, Points>;

struct CellDynamics {
  static constexpr std::size_t temperatures_max = 8;
  static constexpr std::size_t curve_points = 51;
  static constexpr std::size_t resistance_points = 21;
  static constexpr std::size_t pairs = 3;

  using Curve = OverCharge<curve_points>;
  using Resistance = OverCharge<resistance_points>;

  /// All tables at one temperature.
  struct Row {
    double temperature_C = 25.0;
    Curve ocv_V{};
    Resistance hysteresis_V{};
    Resistance series_Ohm{};
    Resistance kinetic_Ohm{};
    std::array<Resistance, pairs> pair_Ohm{};
    double exchange_current_A = 1.0;  // I0, above 0
    /// Model error, one standard deviation, and its correlation time: the residual of the fit, split into a part that
    /// lasts for minutes and one that decays within seconds.
    double slow_error_V = 0.01;
    double slow_error_time_s = 1500.0;
    double fast_error_V = 0.01;
    double fast_error_time_s = 20.0;
  };

  FixedVector<Row, temperatures_max> rows;  // at least one, by rising temperature
  std::array<double, pairs> pair_time_constant_s{10.0, 100.0, 1000.0};
  double activation_K = 0.0;              // a in the formula above
  double hysteresis_charge = 0.03;        // q0, a share of the capacity, above 0
  double charge_efficiency = 1.0;         // share of a charging current that is stored as charge
  double self_discharge_per_month = 0.0;  // share of the capacity at 25 C; twice as much every 10 K
  double capacity_As = 0.0;               // above 0
};

/// The model at one state of charge and temperature.
struct CellPoint {
  double ocv_V = 0.0;
  double ocv_slope_V = 0.0;  // per 1 of SOC
  double hysteresis_V = 0.0;
  double series_Ohm = 0.0;
  double kinetic_Ohm = 0.0;
  double exchange_current_A = 1.0;
  std::array<double, CellDynamics::pairs> pair_Ohm{};
  double slow_error_V = 0.0;
  double slow_error_time_s = 0.0;
  double fast_error_V = 0.0;
  double fast_error_time_s = 0.0;
};

/// Position of a value in a table of equal steps: `share` of the way from entry `from` to the next.
struct TablePlace {
  std::size_t from = 0;
  double share = 0.0;
};
[[nodiscard]] constexpr TablePlace table_place(std::size_t points, double soc) {
  const double bounded = soc > 0.0 ? (soc < 1.0 ? soc : 1.0) : 0.0;  // not-a-number is 0
  const double position = bounded * static_cast<double>(points - 1);
  const auto whole = static_cast<std::size_t>(position);
  const std::size_t from = whole < points - 2 ? whole : points - 2;
  return {from, position - static_cast<double>(from)};
}

/// Rows between which a temperature lies. Beyond the first and last row only that row applies, and its resistances are
/// multiplied by `resistance`.
struct RowPlace {
  std::size_t from = 0;
  double share = 0.0;
  double resistance = 1.0;
};
/// Cost: two or three exponentials.
[[nodiscard]] RowPlace row_place(const CellDynamics& cell, double temperature_C);

/// The whole cell at one temperature, for callers that evaluate many states of charge. Cost: that of row_place() and
/// some 400 multiplications.
[[nodiscard]] CellDynamics::Row row_at(const CellDynamics& cell, double temperature_C);

/// Minimum slope of the open-circuit voltage above full and below empty, where the slope of the last table step
/// continues: with a curve that is flat there, an overcharged cell could have any SOC.
inline constexpr double ocv_slope_beyond_min_V = 0.8;

/// `soc` from 0 to 1; beyond, the resistances at the end apply. Cost: some 10 multiplications.
[[nodiscard]] CellPoint at(const CellDynamics::Row& row, double soc);
/// The same, with the row computed first.
[[nodiscard]] CellPoint at(const CellDynamics& cell, double soc, double temperature_C);

/// Charge transfer current function I0 * asinh(I / I0), which times K is the overvoltage; it has the sign of the
/// current. It is the same at every SOC of one temperature, and by far the most expensive part of a voltage.
[[nodiscard]] double kinetic_A(double exchange_current_A, double current_A);
/// Charge transfer overvoltage at this current.
[[nodiscard]] double kinetic_V(const CellPoint& point, double current_A);

/// SOC of a relaxed cell, from 0 to 1, and exactly one of these for a voltage beyond the curve; `hysteresis` from -1
/// (last discharged) to 1. Cost: some 50 multiplications.
[[nodiscard]] double soc_from_ocv(const CellDynamics::Row& row, double ocv_V, double hysteresis);
/// The same, with the row computed first.
[[nodiscard]] double soc_from_ocv(const CellDynamics& cell, double ocv_V, double temperature_C, double hysteresis);

/// Only the open-circuit voltage, and its slope per 1 of SOC.
[[nodiscard]] double ocv_V(const CellDynamics::Row& row, double soc);
[[nodiscard]] double ocv_slope_V(const CellDynamics::Row& row, double soc);

/// The same cell from the few numbers of a data sheet: resistances by Arrhenius' law, no charge transfer, a model error
/// as large as the uncertainty of these numbers.
[[nodiscard]] CellDynamics dynamics_of(const CellModel& model);

/// Self-discharge current. Temperatures below -60 and above 150 C count as these.
[[nodiscard]] double self_discharge_A(const CellDynamics& cell, double temperature_C);

}  // namespace bmu

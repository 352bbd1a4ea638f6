// Parameters of a cell, or of a block of cells in parallel: data of the manufacturer and measured values. The daemon
// checks real cells by it, and the emulated pack is simulated with it. Filled from a cell file (config/cells/), which
// has been validated.
//
//   voltage = OCV(soc) + hysteresis - I * R0 - U1 - U2          I positive out of the cell
//   dU/dt   = (I * R - U) / tau                                 of each of the two RC elements
//   R(T)    = R(25 C) * exp(a * (1/T - 1/298.15 K))             a: resistance_activation_K (Arrhenius); taus stay
//   dh/dq   = (-sign(I) - h) / q0                               the hysteresis is h * hysteresis_V, h from -1 to 1, q
//                                                               the charge throughput in both directions, q0 a share of
//                                                               the capacity
//
// This is the enhanced self-correcting model with two RC elements: G. L. Plett, Battery Management Systems, Vol. I,
// Artech House 2015, chapter 2.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>

#include "protocol/fixed_vector.hpp"

namespace bmu {

struct OcvPoint {
  std::int32_t soc_permille = 0;
  std::int32_t ocv_uV = 0;
};

struct CellModel {
  FixedVector<OcvPoint, 64> ocv;  // at least two points from 0 to 1000 permille, both columns strictly rising
  std::int64_t capacity_uAs = 0;
  // Resistances at 25 C.
  double series_resistance_Ohm = 0.0;  // immediate response to a current step
  double rc_resistance_Ohm = 0.0;      // first RC element: later response
  double rc_time_constant_s = 0.0;
  double slow_rc_resistance_Ohm = 0.0;  // second RC element: diffusion, much later. 0: unknown
  double slow_rc_time_constant_s = 600.0;
  double resistance_activation_K = 0.0;    // 0: the same at every temperature
  double hysteresis_V = 0.0;               // half of the difference between the curves of charging and discharging
  double hysteresis_charge_permille = 30;  // charge in permille of the capacity for two thirds of the transition
  double self_discharge_permille_per_month = 0.0;  // of the capacity, at 25 C; twice as much every 10 K
  double heat_capacity_J_per_K = 0.0;
  double heat_transfer_W_per_K = 0.0;  // to the surrounding air
  // Absolute limits of the manufacturer. A pack file with limits outside these is rejected.
  std::int32_t voltage_min_uV = 0;
  std::int32_t voltage_max_uV = 0;
  std::int32_t temperature_min_dC = 0;
  std::int32_t temperature_max_dC = 0;
};

/// Open-circuit voltage at an SOC, linearly interpolated between the points of its table and extrapolated beyond the
/// first and last point. Precondition: the table has two points.
[[nodiscard]] constexpr double ocv_uV(const CellModel& cell, double soc_permille) {
  std::size_t next = 1;
  while (next + 1 < cell.ocv.size() && cell.ocv[next].soc_permille < soc_permille) ++next;
  const OcvPoint& from = cell.ocv[next - 1];
  const OcvPoint& to = cell.ocv[next];
  const double share = (soc_permille - from.soc_permille) / static_cast<double>(to.soc_permille - from.soc_permille);
  return from.ocv_uV + (to.ocv_uV - from.ocv_uV) * share;
}

/// Factor of all resistances of a cell at this temperature: 1 at 25 C, more in the cold. Temperatures below -60 and
/// above 150 C count as these.
[[nodiscard]] inline double resistance_factor(double activation_K, double temperature_C) {
  constexpr double zero_celsius_K = 273.15;
  constexpr double reference_K = zero_celsius_K + 25.0;
  const double bounded_C = std::fmin(std::fmax(temperature_C, -60.0), 150.0);
  return std::exp(activation_K * (1.0 / (bounded_C + zero_celsius_K) - 1.0 / reference_K));
}

}  // namespace bmu

// What the voltage of a cell that rests says of its charge by itself, whatever was counted: an anchor for the capacity.
// The state of charge that a filter tells of a rested cell will not do for that, as it rests on the counter, too.
//
//   open-circuit voltage = voltage + what the pairs still hold back
//   doubt of it          = the measurement, the model's lasting error, half of what the pairs hold back, half of the
//                          hysteresis
//
// Where that leaves more than `rest_sigma_max` of the charge open, as on the flat stretch of an LFP cell, or where the
// voltage is at an end of the curve or beyond, nothing is said.
//
// Cost: three searches in the curve.
#pragma once

#include <cmath>
#include <optional>

#include "daemon/core/estimation/soc/charge_ends.hpp"

namespace bmu {

inline constexpr double rest_sigma_max = 0.05;

/// `hysteresis` from -1 (last discharged) to 1; `held_back_V`: what the pairs hold back, above 0 after a discharge.
/// Nothing without a voltage or a temperature.
[[nodiscard]] inline std::optional<ChargeAnchor> rest_anchor(const CellDynamics& cell, double voltage_V,
                                                             double temperature_C, double hysteresis,
                                                             double held_back_V) {
  constexpr double measured_to_V = 0.002;
  constexpr double end_soc = 0.02;
  if (!is_measured(voltage_V) || !is_measured(temperature_C) || !is_measured(held_back_V)) return std::nullopt;
  const double open_V = voltage_V + held_back_V;
  const double soc = soc_from_ocv(cell, open_V, temperature_C, hysteresis);
  const CellPoint point = at(cell, soc, temperature_C);
  const double doubt_V =
      std::hypot(std::hypot(measured_to_V, point.slow_error_V), 0.5 * held_back_V, 0.5 * point.hysteresis_V);
  const double low = soc_from_ocv(cell, open_V - doubt_V, temperature_C, hysteresis);
  const double high = soc_from_ocv(cell, open_V + doubt_V, temperature_C, hysteresis);
  const double sigma = 0.5 * (high - low);
  const bool is_inside = low > end_soc && high < 1.0 - end_soc;
  if (!is_inside || !(sigma > 0.0) || sigma > rest_sigma_max) return std::nullopt;
  return ChargeAnchor{.soc = soc, .sigma = sigma};
}

}  // namespace bmu

// Anchor for the capacity: the state of charge of a cell at rest from its voltage alone, whatever was counted. The
// state of charge of a filter is not suitable for that, because it depends on the counter, too.
//
//   open-circuit voltage = voltage + polarisation of the RC elements
//   its uncertainty      = the measurement, the model's lasting error, half of that polarisation, half of the
//                          hysteresis
//
// Where that leaves more than `rest_sigma_max` of the charge uncertain, as on the flat stretch of an LFP cell, or where
// the voltage is at an end of the curve or beyond, there is no anchor.
//
// Cost: three searches in the curve.
#pragma once

#include <cmath>
#include <optional>

#include "daemon/core/estimation/soc/charge_ends.hpp"

namespace bmu {

inline constexpr double rest_sigma_max = 0.05;

/// `hysteresis` from -1 (last discharged) to 1; `held_back_V`: polarisation of the RC elements, above 0 after a
/// discharge. Returns nothing without a voltage or a temperature.
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

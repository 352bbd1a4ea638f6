#include "daemon/core/estimation/health/expected_resistance.hpp"

#include <algorithm>
#include <cmath>

#include "daemon/core/estimation/soc/soc_estimate.hpp"

namespace bmu {

namespace {

constexpr double half_charged = 0.5;
/// Prevents a division by zero for a model without resistance.
constexpr double resistance_least_Ohm = 1e-9;
/// Two factors this close are equal, and differ by the order of computation only.
constexpr double rounding = 1e-9;

double shown_Ohm(const CellDynamics& cell, double temperature_C, double current_A) {
  const CellPoint point = at(cell, half_charged, temperature_C);
  double sum_Ohm = point.series_Ohm + kinetic_V(point, current_A) / current_A;
  for (std::size_t pair = 0; pair < CellDynamics::pairs; ++pair) {
    sum_Ohm +=
        point.pair_Ohm[pair] * resistance_pass_time_s / (resistance_pass_time_s + cell.pair_time_constant_s[pair]);
  }
  return std::max(sum_Ohm, resistance_least_Ohm);
}

}  // namespace

ExpectedResistance::ExpectedResistance(const CellDynamics& cell) {
  constexpr double hour_s = 3600.0;
  hour_current_A_ = cell.capacity_As / hour_s;
  at_reference_Ohm_ = shown_Ohm(cell, resistance_reference_C, hour_current_A_);
  for (std::size_t entry = 0; entry < entries; ++entry) {
    const double temperature_C = lowest_C + step_C * static_cast<double>(entry);
    factor_[entry] = shown_Ohm(cell, temperature_C, hour_current_A_) / at_reference_Ohm_;
    is_same_everywhere_ = is_same_everywhere_ && std::abs(factor_[entry] - 1.0) < rounding;
  }
}

double ExpectedResistance::factor(double temperature_C) const {
  if (is_same_everywhere_) return 1.0;
  if (!is_measured(temperature_C)) return not_measured;
  constexpr double highest_C = lowest_C + step_C * (entries - 1);
  const double share = (std::clamp(temperature_C, lowest_C, highest_C) - lowest_C) / (highest_C - lowest_C);
  const TablePlace place = table_place(entries, share);
  return std::lerp(factor_[place.from], factor_[place.from + 1], place.share);
}

}  // namespace bmu

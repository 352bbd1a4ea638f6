#include "daemon/core/cell/cell_dynamics.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace bmu {

namespace {

struct Curves {
  double value = 0.0;
  double slope = 0.0;
};

template <std::size_t Points>
double value_at(const OverCharge<Points>& table, TablePlace place) {
  return table[place.from] + (table[place.from + 1] - table[place.from]) * place.share;
}

Curves ocv_at(const CellDynamics::Row& row, double soc) {
  const TablePlace place = table_place(CellDynamics::curve_points, soc);
  const double step = row.ocv_V[place.from + 1] - row.ocv_V[place.from];
  const double slope = step * static_cast<double>(CellDynamics::curve_points - 1);
  const double value = row.ocv_V[place.from] + step * place.share;
  const double beyond = soc - std::clamp(soc, 0.0, 1.0);
  if (beyond == 0.0) return {value, slope};
  const double steep = std::max(slope, ocv_slope_beyond_min_V);
  return {value + beyond * steep, steep};
}

/// One table of two rows, interpolated by `share` and multiplied by `factor`.
template <std::size_t Points>
void blend(OverCharge<Points>& to, const OverCharge<Points>& cold, const OverCharge<Points>& warm, double share,
           double factor = 1.0) {
  for (std::size_t point = 0; point < Points; ++point) {
    to[point] = (cold[point] + (warm[point] - cold[point]) * share) * factor;
  }
}

}  // namespace

RowPlace row_place(const CellDynamics& cell, double temperature_C) {
  const auto& rows = cell.rows;
  const double first_C = rows[0].temperature_C;
  const double last_C = rows.back().temperature_C;
  const double factor = resistance_factor(cell.activation_K, temperature_C);
  if (temperature_C <= first_C) {
    return {.resistance = factor / resistance_factor(cell.activation_K, first_C)};
  }
  if (temperature_C >= last_C) {
    return {.from = rows.size() - 1, .resistance = factor / resistance_factor(cell.activation_K, last_C)};
  }
  std::size_t from = 0;
  while (rows[from + 1].temperature_C <= temperature_C) ++from;
  const double cold = rows[from].temperature_C;
  const double warm = rows[from + 1].temperature_C;
  const double cold_factor = resistance_factor(cell.activation_K, cold);
  const double warm_factor = resistance_factor(cell.activation_K, warm);
  if (cold_factor == warm_factor) return {.from = from, .share = (temperature_C - cold) / (warm - cold)};
  return {.from = from, .share = (cold_factor - factor) / (cold_factor - warm_factor)};
}

CellDynamics::Row row_at(const CellDynamics& cell, double temperature_C) {
  const RowPlace place = row_place(cell, temperature_C);
  const CellDynamics::Row& cold = cell.rows[place.from];
  const CellDynamics::Row& warm = cell.rows[std::min(place.from + 1, cell.rows.size() - 1)];
  const double share = place.share;
  CellDynamics::Row row;
  row.temperature_C = temperature_C;
  blend(row.ocv_V, cold.ocv_V, warm.ocv_V, share);
  blend(row.hysteresis_V, cold.hysteresis_V, warm.hysteresis_V, share);
  blend(row.series_Ohm, cold.series_Ohm, warm.series_Ohm, share, place.resistance);
  blend(row.kinetic_Ohm, cold.kinetic_Ohm, warm.kinetic_Ohm, share, place.resistance);
  for (std::size_t pair = 0; pair < CellDynamics::pairs; ++pair) {
    blend(row.pair_Ohm[pair], cold.pair_Ohm[pair], warm.pair_Ohm[pair], share, place.resistance);
  }
  row.exchange_current_A = std::lerp(cold.exchange_current_A, warm.exchange_current_A, share) / place.resistance;
  row.slow_error_V = std::lerp(cold.slow_error_V, warm.slow_error_V, share);
  row.slow_error_time_s = std::lerp(cold.slow_error_time_s, warm.slow_error_time_s, share);
  row.fast_error_V = std::lerp(cold.fast_error_V, warm.fast_error_V, share);
  row.fast_error_time_s = std::lerp(cold.fast_error_time_s, warm.fast_error_time_s, share);
  return row;
}

CellPoint at(const CellDynamics& cell, double soc, double temperature_C) {
  return at(row_at(cell, temperature_C), soc);
}

CellPoint at(const CellDynamics::Row& row, double soc) {
  const TablePlace step = table_place(CellDynamics::resistance_points, soc);
  const Curves ocv = ocv_at(row, soc);
  CellPoint point{
      .ocv_V = ocv.value,
      .ocv_slope_V = ocv.slope,
      .hysteresis_V = value_at(row.hysteresis_V, step),
      .series_Ohm = value_at(row.series_Ohm, step),
      .kinetic_Ohm = value_at(row.kinetic_Ohm, step),
      .exchange_current_A = row.exchange_current_A,
      .slow_error_V = row.slow_error_V,
      .slow_error_time_s = row.slow_error_time_s,
      .fast_error_V = row.fast_error_V,
      .fast_error_time_s = row.fast_error_time_s,
  };
  for (std::size_t pair = 0; pair < CellDynamics::pairs; ++pair) {
    point.pair_Ohm[pair] = value_at(row.pair_Ohm[pair], step);
  }
  return point;
}

double kinetic_A(double exchange_current_A, double current_A) {
  return exchange_current_A * std::asinh(current_A / exchange_current_A);
}

double kinetic_V(const CellPoint& point, double current_A) {
  return point.kinetic_Ohm * kinetic_A(point.exchange_current_A, current_A);
}

double ocv_V(const CellDynamics::Row& row, double soc) {
  return ocv_at(row, soc).value;
}

double ocv_slope_V(const CellDynamics::Row& row, double soc) {
  return ocv_at(row, soc).slope;
}

namespace {

/// The slopes of both tables change only at multiples of this step.
constexpr std::size_t straight_pieces = std::lcm(CellDynamics::curve_points - 1, CellDynamics::resistance_points - 1);

}  // namespace

/// Between two neighbouring bends of the tables the voltage is linear: bisection finds the two bends, linear
/// interpolation the position between them.
double soc_from_ocv(const CellDynamics::Row& row, double ocv_V, double hysteresis) {
  const auto rested_V = [&](std::size_t bend) {
    const double soc = static_cast<double>(bend) / static_cast<double>(straight_pieces);
    const TablePlace step = table_place(CellDynamics::resistance_points, soc);
    return ocv_at(row, soc).value + hysteresis * value_at(row.hysteresis_V, step);
  };
  std::size_t low = 0;
  std::size_t high = straight_pieces;
  double low_V = rested_V(low);
  double high_V = rested_V(high);
  if (!(low_V < ocv_V)) return 0.0;
  if (high_V < ocv_V) return 1.0;
  while (high - low > 1) {
    const std::size_t middle = (low + high) / 2;
    const double middle_V = rested_V(middle);
    const bool is_below = middle_V < ocv_V;
    (is_below ? low : high) = middle;
    (is_below ? low_V : high_V) = middle_V;
  }
  // low_V is below, high_V is not: they differ.
  const double share = (ocv_V - low_V) / (high_V - low_V);
  return (static_cast<double>(low) + share) / static_cast<double>(straight_pieces);
}

double soc_from_ocv(const CellDynamics& cell, double ocv_V, double temperature_C, double hysteresis) {
  return soc_from_ocv(row_at(cell, temperature_C), ocv_V, hysteresis);
}

CellDynamics dynamics_of(const CellModel& model) {
  constexpr std::array temperatures_C{-20.0, 0.0, 25.0, 45.0};
  constexpr double model_error_V = 0.015;
  CellDynamics cell;
  cell.pair_time_constant_s = {model.rc_time_constant_s, model.slow_rc_time_constant_s, 1.0};
  cell.activation_K = model.resistance_activation_K;
  cell.hysteresis_charge = model.hysteresis_charge_permille / 1000.0;
  cell.self_discharge_per_month = model.self_discharge_permille_per_month / 1000.0;
  cell.capacity_As = static_cast<double>(model.capacity_uAs) * 1e-6;
  for (const double temperature_C : temperatures_C) {
    const double factor = resistance_factor(model.resistance_activation_K, temperature_C);
    CellDynamics::Row row{.temperature_C = temperature_C,
                          .slow_error_V = model_error_V * std::sqrt(factor),
                          .fast_error_V = model_error_V * std::sqrt(factor)};
    for (std::size_t point = 0; point < CellDynamics::curve_points; ++point) {
      row.ocv_V[point] = ocv_uV(model, 1000.0 * static_cast<double>(point) / (CellDynamics::curve_points - 1)) * 1e-6;
    }
    row.hysteresis_V.fill(model.hysteresis_V);
    row.series_Ohm.fill(model.series_resistance_Ohm * factor);
    row.pair_Ohm[0].fill(model.rc_resistance_Ohm * factor);
    row.pair_Ohm[1].fill(model.slow_rc_resistance_Ohm * factor);
    cell.rows.push_back(row);
  }
  return cell;
}

double self_discharge_A(const CellDynamics& cell, double temperature_C) {
  constexpr double month_s = 30.0 * 24.0 * 3600.0;
  const double bounded_C = std::clamp(temperature_C, -60.0, 150.0);
  return cell.self_discharge_per_month * cell.capacity_As / month_s * std::exp2((bounded_C - 25.0) / 10.0);
}

}  // namespace bmu

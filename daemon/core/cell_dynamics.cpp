#include "daemon/core/cell_dynamics.hpp"

#include <algorithm>
#include <cmath>

namespace bmu {

namespace {

template <std::size_t Points>
double value_at(const OverCharge<Points>& table, TablePlace place) {
  return table[place.from] + (table[place.from + 1] - table[place.from]) * place.share;
}

template <std::size_t Points>
double slope_at(const OverCharge<Points>& table, TablePlace place) {
  return (table[place.from + 1] - table[place.from]) * static_cast<double>(Points - 1);
}

struct Curves {
  double value = 0.0;
  double slope = 0.0;
};

/// One table of both rows, blended.
template <std::size_t Points>
double blend(const OverCharge<Points>& cold, const OverCharge<Points>& warm, double share, TablePlace place) {
  const double from = value_at(cold, place);
  return from + (value_at(warm, place) - from) * share;
}

Curves ocv_at(const CellDynamics::Row& cold, const CellDynamics::Row& warm, double share, double soc) {
  const TablePlace place = table_place(CellDynamics::curve_points, soc);
  const double slope = std::lerp(slope_at(cold.ocv_V, place), slope_at(warm.ocv_V, place), share);
  const double value = blend(cold.ocv_V, warm.ocv_V, share, place);
  const double beyond = soc - std::clamp(soc, 0.0, 1.0);
  if (beyond == 0.0) return {value, slope};
  const double steep = std::max(slope, ocv_slope_beyond_min_V);
  return {value + beyond * steep, steep};
}

}  // namespace

RowPlace row_place(const CellDynamics& cell, double temperature_C) {
  const auto& rows = cell.rows;
  const double first_C = rows[0].temperature_C;
  const double last_C = rows.back().temperature_C;
  const double factor = resistance_factor(cell.activation_K, temperature_C);
  if (temperature_C <= first_C) return {0, 0.0, factor / resistance_factor(cell.activation_K, first_C)};
  if (temperature_C >= last_C) {
    return {rows.size() - 1, 0.0, factor / resistance_factor(cell.activation_K, last_C)};
  }
  std::size_t from = 0;
  while (rows[from + 1].temperature_C <= temperature_C) ++from;
  const double cold = rows[from].temperature_C;
  const double warm = rows[from + 1].temperature_C;
  const double cold_factor = resistance_factor(cell.activation_K, cold);
  const double warm_factor = resistance_factor(cell.activation_K, warm);
  if (cold_factor == warm_factor) return {from, (temperature_C - cold) / (warm - cold), 1.0};
  return {from, (cold_factor - factor) / (cold_factor - warm_factor), 1.0};
}

CellPoint at(const CellDynamics& cell, double soc, double temperature_C) {
  return at(cell, row_place(cell, temperature_C), soc);
}

CellPoint at(const CellDynamics& cell, const RowPlace& place, double soc) {
  const CellDynamics::Row& cold = cell.rows[place.from];
  const CellDynamics::Row& warm = cell.rows[std::min(place.from + 1, cell.rows.size() - 1)];
  const double share = place.share;
  const TablePlace step = table_place(CellDynamics::resistance_points, soc);
  const Curves ocv = ocv_at(cold, warm, share, soc);
  CellPoint point{
      .ocv_V = ocv.value,
      .ocv_slope_V = ocv.slope,
      .hysteresis_V = blend(cold.hysteresis_V, warm.hysteresis_V, share, step),
      .series_Ohm = blend(cold.series_Ohm, warm.series_Ohm, share, step) * place.resistance,
      .kinetic_Ohm = blend(cold.kinetic_Ohm, warm.kinetic_Ohm, share, step) * place.resistance,
      .exchange_current_A = std::lerp(cold.exchange_current_A, warm.exchange_current_A, share) / place.resistance,
      .slow_error_V = std::lerp(cold.slow_error_V, warm.slow_error_V, share),
      .slow_error_time_s = std::lerp(cold.slow_error_time_s, warm.slow_error_time_s, share),
      .fast_error_V = std::lerp(cold.fast_error_V, warm.fast_error_V, share),
      .fast_error_time_s = std::lerp(cold.fast_error_time_s, warm.fast_error_time_s, share),
  };
  for (std::size_t pair = 0; pair < CellDynamics::pairs; ++pair) {
    point.pair_Ohm[pair] = blend(cold.pair_Ohm[pair], warm.pair_Ohm[pair], share, step) * place.resistance;
  }
  return point;
}

double kinetic_V(const CellPoint& point, double current_A) {
  return point.kinetic_Ohm * point.exchange_current_A * std::asinh(current_A / point.exchange_current_A);
}

double ocv_V(const CellDynamics& cell, const RowPlace& place, double soc) {
  const CellDynamics::Row& warm = cell.rows[std::min(place.from + 1, cell.rows.size() - 1)];
  return ocv_at(cell.rows[place.from], warm, place.share, soc).value;
}

double soc_from_ocv(const CellDynamics& cell, double ocv_V, double temperature_C, double hysteresis) {
  const RowPlace place = row_place(cell, temperature_C);
  const CellDynamics::Row& cold = cell.rows[place.from];
  const CellDynamics::Row& warm = cell.rows[std::min(place.from + 1, cell.rows.size() - 1)];
  const auto is_above = [&](double soc) {
    const TablePlace step = table_place(CellDynamics::resistance_points, soc);
    const double shift_V = hysteresis * blend(cold.hysteresis_V, warm.hysteresis_V, place.share, step);
    return ocv_at(cold, warm, place.share, soc).value + shift_V < ocv_V;
  };
  if (!is_above(0.0)) return 0.0;
  if (is_above(1.0)) return 1.0;
  double low = 0.0;
  double high = 1.0;
  constexpr int halvings = 20;  // to a millionth
  for (int turn = 0; turn < halvings; ++turn) {
    const double middle = 0.5 * (low + high);
    (is_above(middle) ? low : high) = middle;
  }
  return 0.5 * (low + high);
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

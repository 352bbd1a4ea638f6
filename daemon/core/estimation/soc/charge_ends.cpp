#include "daemon/core/estimation/soc/charge_ends.hpp"

#include <cmath>
#include <numeric>

namespace bmu {

namespace {

/// Relative uncertainty of the voltage drop by the current.
constexpr double resistance_doubt = 0.3;
/// A curve that is flat at its end would make the anchor useless; the current shows a full cell as much as the curve
/// does.
constexpr double slope_min_V = 0.5;

constexpr double full_current_share = 0.05;
constexpr double empty_current_share = 0.2;
/// Possible error of the voltages of the ends: the modules measure to a millivolt or two.
constexpr double end_voltage_margin_V = 0.005;

double sigma_at(const CellDynamics& cell, const CellSample& sample, double soc, double sigma) {
  constexpr double room_C = 25.0;
  const CellPoint point = at(cell, soc, is_measured(sample.temperature_C) ? sample.temperature_C : room_C);
  const double resistance_Ohm = std::accumulate(point.pair_Ohm.begin(), point.pair_Ohm.end(), point.series_Ohm);
  const double taken_V = resistance_Ohm * sample.current_A + kinetic_V(point, sample.current_A);
  return std::hypot(sigma, resistance_doubt * taken_V / std::fmax(point.ocv_slope_V, slope_min_V));
}

}  // namespace

ChargeEndConfig charge_ends_of(const CellDynamics& cell) {
  constexpr double hour_s = 3600.0;
  constexpr double room_C = 25.0;
  const double hour_rate_A = cell.capacity_As / hour_s;
  const CellDynamics::Curve& room = cell.rows[row_place(cell, room_C).from].ocv_V;
  return {.full_V = room.back() - end_voltage_margin_V,
          .full_current_A = full_current_share * hour_rate_A,
          .empty_V = room.front() + end_voltage_margin_V,
          .empty_current_A = empty_current_share * hour_rate_A};
}

bool ChargeEnds::End::step(bool holds, double passed_s) {
  if (!holds) {
    *this = {};
    return false;
  }
  held_s += passed_s;
  if (is_told || held_s < end_held_s) return false;
  is_told = true;
  return true;
}

std::optional<ChargeAnchor> ChargeEnds::update(const CellDynamics& cell, const ChargeEndConfig& config,
                                               const CellSample& sample) {
  if (!sample.has_passed()) return std::nullopt;
  const bool is_known = is_measured(sample.voltage_V) && is_measured(sample.current_A);
  const double out_A = sample.current_A;
  const bool is_full = is_known && sample.voltage_V >= config.full_V && out_A < 0.0 && -out_A <= config.full_current_A;
  const bool is_empty = is_known && sample.temperature_C >= empty_coldest_C && sample.voltage_V <= config.empty_V &&
                        out_A >= 0.0 && out_A <= config.empty_current_A;
  const bool has_filled = full_.step(is_full, sample.passed_s);
  const bool has_emptied = empty_.step(is_empty, sample.passed_s);
  if (has_filled) return ChargeAnchor{.soc = 1.0, .sigma = sigma_at(cell, sample, 1.0, full_sigma)};
  if (has_emptied) return ChargeAnchor{.soc = 0.0, .sigma = sigma_at(cell, sample, 0.0, empty_sigma)};
  return std::nullopt;
}

}  // namespace bmu

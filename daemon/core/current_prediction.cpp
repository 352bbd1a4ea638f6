#include "daemon/core/current_prediction.hpp"

#include <algorithm>
#include <cmath>

namespace bmu {

namespace {

constexpr double doubt_sigmas = 2.0;
/// Nobody knows how this cell differs from its model: that is how far cells of a kind and their ageing go apart.
constexpr double resistance_sigma_unknown = 0.25;
constexpr double resistance_share_min = -0.9;
constexpr double resistance_share_max = 9.0;
/// So close to the largest current that is allowed is close enough.
constexpr double good_enough_share = 1e-4;

bool is_at_least_0(double value) {
  return is_measured(value) && value >= 0.0;
}

/// What the step from one current to another does to the voltage at once.
double step_V(const CellPoint& point, double from_A, double to_A) {
  return (from_A - to_A) * point.series_Ohm + kinetic_V(point, from_A) - kinetic_V(point, to_A);
}

}  // namespace

CellForecast::CellForecast(const CellDynamics& cell, const CellForecastInput& input) : cell_(&cell), input_(input) {
  const bool is_model = !cell.rows.empty() && cell.capacity_As > 0.0 && cell.hysteresis_charge > 0.0;
  is_known_ =
      is_model && is_measured(input.voltage_V) && is_measured(input.current_A) && is_measured(input.temperature_C);
  if (!is_known_) return;
  const bool knows_soc = input.soc.is_known && is_measured(input.soc.soc) && is_at_least_0(input.soc.sigma);
  constexpr double middle = 0.5;
  believed_.soc = knows_soc ? std::clamp(input.soc.soc, 0.0, 1.0) : middle;
  doubt_ = knows_soc ? doubt_sigmas * input.soc.sigma : middle;
  const bool knows_share = is_measured(input.resistance_share);
  const double share =
      knows_share ? std::clamp(input.resistance_share, resistance_share_min, resistance_share_max) : 0.0;
  const double sigma =
      knows_share && is_at_least_0(input.resistance_sigma) ? input.resistance_sigma : resistance_sigma_unknown;
  resistance_more_ = 1.0 + share + doubt_sigmas * sigma;
  resistance_less_ = std::max(1.0 + share - doubt_sigmas * sigma, 0.0);
  place_ = row_place(cell, input.temperature_C);
  believed_.point = at(cell, place_, believed_.soc);
}

/// What the pairs add until the end of the horizon, where that is something bad.
double CellForecast::pairs_V(const CellPoint& from, const CellPoint& to, double horizon_s, double sign,
                             double current_A) const {
  const double now_A = sign * input_.current_A;
  double sum_V = 0.0;
  for (std::size_t pair = 0; pair < CellDynamics::pairs; ++pair) {
    const double most_Ohm = resistance_more_ * std::max(from.pair_Ohm[pair], to.pair_Ohm[pair]);
    const double known_V = input_.pair_V[pair];
    const double held_V = is_measured(known_V) ? sign * known_V : std::min(now_A * most_Ohm, 0.0);
    const double settled = -std::expm1(-horizon_s / cell_->pair_time_constant_s[pair]);
    sum_V += std::min((held_V - current_A * most_Ohm) * settled, 0.0);
  }
  return sum_V;
}

/// By how much the room grows, or shrinks, until the end of the horizon: without the present room.
double CellForecast::change_V(const Start& start, double horizon_s, double sign, double current_A) const {
  const double charge_share = current_A * horizon_s / cell_->capacity_As;
  const CellPoint& from = start.point;
  const CellPoint to = at(*cell_, place_, start.soc - sign * charge_share);
  const double curve_V = sign * (to.ocv_V - from.ocv_V);

  const double side = is_measured(input_.hysteresis) ? std::clamp(sign * input_.hysteresis, -1.0, 1.0) : 1.0;
  const double moved = -std::expm1(-charge_share / cell_->hysteresis_charge);
  const double hysteresis_V = -(1.0 + side) * moved * std::max(from.hysteresis_V, to.hysteresis_V);

  const double now_A = sign * input_.current_A;
  const double at_once_V = std::min(step_V(from, now_A, current_A), step_V(to, now_A, current_A));
  const double surely_V = at_once_V * (at_once_V < 0.0 ? resistance_more_ : resistance_less_);
  return curve_V + hysteresis_V + surely_V + pairs_V(from, to, horizon_s, sign, current_A);
}

double CellForecast::room_V(const ForecastBound& bound, double sign, double current_A) const {
  const double soc = believed_.soc - sign * doubt_;
  const Start doubted{soc, at(*cell_, place_, soc)};
  return sign * (input_.voltage_V - bound.voltage_V) + std::min(change_V(believed_, bound.horizon_s, sign, current_A),
                                                                change_V(doubted, bound.horizon_s, sign, current_A));
}

/// The room falls as the current rises. False position with the Illinois rule, and every third step in the middle, so
/// that no shape of the curve holds it up.
double CellForecast::most_A(const ForecastBound& bound, double sign) const {
  const bool is_bound = is_measured(bound.voltage_V) && is_measured(bound.horizon_s) && bound.horizon_s > 0.0;
  if (!is_known_ || !is_bound || !is_at_least_0(bound.at_most_A)) return 0.0;
  double high_A = bound.at_most_A;
  double high_V = room_V(bound, sign, high_A);
  if (high_V >= 0.0) return high_A;
  double low_A = 0.0;
  double low_V = room_V(bound, sign, low_A);
  if (!(low_V >= 0.0)) return 0.0;
  constexpr int halve_every = 3;
  constexpr double half = 0.5;
  bool was_good = false;
  for (int step = 1; step <= prediction_steps_max; ++step) {
    if (high_A - low_A <= good_enough_share * bound.at_most_A) break;
    const double share = step % halve_every == 0 ? half : low_V / (low_V - high_V);
    const double middle_A = low_A + share * (high_A - low_A);
    const double middle_V = room_V(bound, sign, middle_A);
    const bool is_good = middle_V >= 0.0;
    if (is_good) {
      if (was_good) high_V *= half;
      low_A = middle_A;
      low_V = middle_V;
    } else {
      if (!was_good) low_V *= half;
      high_A = middle_A;
      high_V = middle_V;
    }
    was_good = is_good;
  }
  return low_A;
}

}  // namespace bmu

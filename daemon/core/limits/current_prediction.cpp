#include "daemon/core/limits/current_prediction.hpp"

#include <algorithm>
#include <cmath>

namespace bmu {

namespace {

constexpr double doubt_sigmas = 2.0;
/// Used while the deviation of a cell from its model is unknown: spread of cells of a kind and of their ageing.
constexpr double resistance_sigma_unknown = 0.25;
constexpr double resistance_share_min = -0.9;
constexpr double resistance_share_max = 9.0;
/// Sufficient accuracy, as a share of the largest permitted current.
constexpr double good_enough_share = 1e-4;

bool is_at_least_0(double value) {
  return is_measured(value) && value >= 0.0;
}

bool has_row(const CellDynamics& cell, const CellForecastInput& input) {
  return !cell.rows.empty() && is_measured(input.temperature_C);
}

/// Share to which a quantity with this time constant has settled after a time, 0 to 1.
double settled_share(double time_s, double time_constant_s) {
  return -std::expm1(-time_s / time_constant_s);
}

}  // namespace

ForecastHorizon::ForecastHorizon(const CellDynamics& cell, double horizon_s) : s_(horizon_s) {
  for (std::size_t pair = 0; pair < CellDynamics::pairs; ++pair) {
    settled_[pair] = settled_share(horizon_s, cell.pair_time_constant_s[pair]);
  }
}

const ForecastHorizon::Flow& ForecastHorizon::flow(const CellDynamics& cell, double exchange_current_A,
                                                   double current_A) const {
  return flow_.of({exchange_current_A, current_A}, [&] {
    const double charge_share = current_A * s_ / cell.capacity_As;
    return Flow{.current_A = current_A,
                .kinetic_A = kinetic_A(exchange_current_A, current_A),
                .charge_share = charge_share,
                .hysteresis_moved = settled_share(charge_share, cell.hysteresis_charge)};
  });
}

CellDynamics::Row forecast_row(const CellDynamics& cell, const CellForecastInput& input) {
  return has_row(cell, input) ? row_at(cell, input.temperature_C) : CellDynamics::Row{};
}

CellForecast::CellForecast(const CellDynamics& cell, const CellDynamics::Row& row, const CellForecastInput& input)
    : cell_(&cell), input_(input), row_(&row) {
  const bool is_model = cell.capacity_As > 0.0 && cell.hysteresis_charge > 0.0;
  is_known_ = has_row(cell, input) && is_model && is_measured(input.voltage_V) && is_measured(input.current_A);
  if (!is_known_) return;
  const bool knows_soc = input.soc.is_known && is_measured(input.soc.soc) && is_at_least_0(input.soc.sigma);
  constexpr double middle = 0.5;
  const double believed_soc = knows_soc ? std::clamp(input.soc.soc, 0.0, 1.0) : middle;
  // Uncertainty of the state of charge: two standard deviations.
  const double doubt = knows_soc ? doubt_sigmas * input.soc.sigma : middle;
  const bool knows_share = is_measured(input.resistance_share);
  const double share =
      knows_share ? std::clamp(input.resistance_share, resistance_share_min, resistance_share_max) : 0.0;
  const double sigma =
      knows_share && is_at_least_0(input.resistance_sigma) ? input.resistance_sigma : resistance_sigma_unknown;
  resistance_more_ = 1.0 + share + doubt_sigmas * sigma;
  resistance_less_ = std::max(1.0 + share - doubt_sigmas * sigma, 0.0);
  kinetic_now_A_ = kinetic_A(row_->exchange_current_A, input.current_A);
  believed_ = start(believed_soc);
  less_ = start(believed_soc - doubt);
  more_ = start(believed_soc + doubt);
}

CellForecast::Start CellForecast::start(double soc) const {
  return {.soc = soc, .point = at(*row_, soc)};
}

/// Contribution of the RC elements until the end of the horizon, where it is adverse.
double CellForecast::pairs_V(const Question& question, const CellPoint& from, const CellPoint& to,
                             double current_A) const {
  const double now_A = question.sign * input_.current_A;
  double sum_V = 0.0;
  for (std::size_t pair = 0; pair < CellDynamics::pairs; ++pair) {
    const double most_Ohm = resistance_more_ * std::max(from.pair_Ohm[pair], to.pair_Ohm[pair]);
    const double known_V = input_.pair_V[pair];
    const double held_V = is_measured(known_V) ? question.sign * known_V : std::min(now_A * most_Ohm, 0.0);
    sum_V += std::min((held_V - current_A * most_Ohm) * question.horizon.settled()[pair], 0.0);
  }
  return sum_V;
}

/// Change of the margin until the end of the horizon, without the present margin.
double CellForecast::change_V(const Question& question, const Start& start, const ForecastHorizon::Flow& flow) const {
  const double sign = question.sign;
  const CellPoint& from = start.point;
  const CellPoint to = at(*row_, start.soc - sign * flow.charge_share);
  const double curve_V = sign * (to.ocv_V - from.ocv_V);

  const double side = is_measured(input_.hysteresis) ? std::clamp(sign * input_.hysteresis, -1.0, 1.0) : 1.0;
  const double hysteresis_V = -(1.0 + side) * flow.hysteresis_moved * std::max(from.hysteresis_V, to.hysteresis_V);

  const double less_A = sign * input_.current_A - flow.current_A;
  const double less_kinetic_A = sign * kinetic_now_A_ - flow.kinetic_A;
  const double at_once_V = std::min(less_A * from.series_Ohm + less_kinetic_A * from.kinetic_Ohm,
                                    less_A * to.series_Ohm + less_kinetic_A * to.kinetic_Ohm);
  const double surely_V = at_once_V * (at_once_V < 0.0 ? resistance_more_ : resistance_less_);
  return curve_V + hysteresis_V + surely_V + pairs_V(question, from, to, flow.current_A);
}

double CellForecast::room_V(const Question& question, double current_A) const {
  const ForecastHorizon::Flow& flow = question.horizon.flow(*cell_, row_->exchange_current_A, current_A);
  return question.present_V + std::min(change_V(question, believed_, flow), change_V(question, question.doubted, flow));
}

/// The margin falls as the current rises. False position with the Illinois rule, and every third step in the middle, so
/// that no shape of the curve delays it.
double CellForecast::most_A(const ForecastBound& bound, double sign) const {
  const bool is_bound = is_measured(bound.voltage_V) && is_measured(bound.horizon.s()) && bound.horizon.s() > 0.0;
  if (!is_known_ || !is_bound || !is_at_least_0(bound.at_most_A)) return 0.0;
  const Question asks{.sign = sign,
                      .horizon = bound.horizon,
                      .present_V = sign * (input_.voltage_V - bound.voltage_V),
                      .doubted = sign > 0.0 ? less_ : more_};
  double high_A = bound.at_most_A;
  double high_V = room_V(asks, high_A);
  if (high_V >= 0.0) return high_A;
  double low_A = 0.0;
  double low_V = room_V(asks, low_A);
  if (!(low_V >= 0.0)) return 0.0;
  constexpr int halve_every = 3;
  constexpr double half = 0.5;
  bool was_good = false;
  for (int step = 1; step <= prediction_steps_max; ++step) {
    if (high_A - low_A <= good_enough_share * bound.at_most_A) break;
    const double share = step % halve_every == 0 ? half : low_V / (low_V - high_V);
    const double middle_A = low_A + share * (high_A - low_A);
    const double middle_V = room_V(asks, middle_A);
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

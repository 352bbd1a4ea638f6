#include "daemon/core/estimation/soc/soc_filter.hpp"

#include <algorithm>
#include <cmath>

namespace bmu {

namespace {

constexpr double square(double value) {
  return value * value;
}

// Error of a voltage measurement itself: noise and resolution, and, as a share of the resistive drop, the change of the
// current between its own instant and the voltage's.
constexpr double voltage_noise_V = 0.003;
constexpr double resistance_noise_share = 0.03;
// Deviations of a cell from its model, one standard deviation, and the time constants with which they change. (SocBegin
// has that of the capacity.)
constexpr double resistance_share_sigma = 0.10;
constexpr double resistance_time_s = 5000.0;
constexpr double offset_time_s = 36000.0;
/// While the current before is unknown: initial voltage of an RC element, as a share of that which the present current
/// would cause, and its uncertainty, as a share of that which 1C would cause. The longer its time constant, the less
/// the present current determines it, and the more of the earlier current has cancelled out. Tried on drive cycles that
/// were started in their middle.
constexpr std::array<double, CellDynamics::pairs> pair_begin_share{0.5, 0.3, 0.0};
constexpr std::array<double, CellDynamics::pairs> pair_begin_doubt{0.7, 0.7, 0.3};
/// Bound of the state of charge beyond empty and full.
constexpr double soc_beyond = 0.05;
/// Bound of its uncertainty.
constexpr double soc_sigma_max = 1.0;
/// Beyond these a cell or a measurement is defective: half or twice the capacity, a fifth or five times the resistance.
/// Values beyond are not learned, because they could invert the model.
constexpr double counting_share_most = 0.5;
constexpr double resistance_share_least = -0.8;
constexpr double resistance_share_most = 4.0;
/// Minimum reach of the secant line: the tables of resistances have this step.
constexpr double chord_min = 0.05;
/// Share of the secant line's deviation that counts: over the possible range it is smaller than in the middle.
constexpr double bend_share = 0.7;
constexpr double pair_ratio_max = 4.0;
/// An innovation of more standard deviations than this counts with a variance that makes it exactly this many: the
/// model has a gap there, or the sample is wrong.
constexpr double surprise_sigmas = 3.0;
/// Maximum contribution of an improbable voltage to the model mismatch, and the averaging time: a cell of another model
/// deviates all the time, a damaged sample once.
constexpr double surprise_most_sigmas = 10.0;
constexpr double surprise_time_s = 120.0;
/// Factor of the model's error without a temperature.
constexpr double unknown_temperature_factor = 3.0;
/// The filter takes its model as right up to the errors that it contains. On recorded cells the true error is larger by
/// half: docs/accuracy.md.
constexpr double told_sigma_factor = 1.5;

}  // namespace

void SocFilter::begin(const CellDynamics& cell, const CurrentSensorError& sensor, const SocBegin& from,
                      double temperature_C) {
  *this = {};
  cell_.set(cell);
  sensor_ = sensor;
  capacity_As_ = from.capacity_or(cell.capacity_As);
  hysteresis_ = std::clamp(from.hysteresis, -1.0, 1.0);
  if (is_measured(temperature_C)) temperature_C_ = temperature_C;
  const CellPoint point = at(cell, from.soc, temperature_C_);
  const double hour_rate_A = cell.capacity_As / 3600.0;
  x_[soc_at] = std::clamp(from.soc, 0.0, 1.0);
  p_[soc_at][soc_at] = square(std::min(from.sigma, soc_sigma_max));
  for (std::size_t pair = 0; pair < CellDynamics::pairs && !from.is_rested; ++pair) {
    p_[pair_at + pair][pair_at + pair] = square(pair_begin_doubt[pair] * point.pair_Ohm[pair] * hour_rate_A);
  }
  p_[error_at][error_at] = square(point.slow_error_V);
  are_pairs_unknown_ = !from.is_rested;
  if (from.has_followed) share_error(point, from.age_s);
  p_[offset_at][offset_at] = square(sensor.offset_A);
  p_[counting_at][counting_at] = square(sensor.gain) + square(from.capacity_sigma);
  p_[resistance_at][resistance_at] = square(resistance_share_sigma);
}

/// The state of charge of a filter that has followed a cell is off by the error of its model: it absorbs the voltage
/// that this error adds. So the same voltage is no new information for a filter that continues from its record, until
/// the model's error has changed.
void SocFilter::share_error(const CellPoint& point, double age_s) {
  const double sigma = std::sqrt(p_[soc_at][soc_at]);
  const double kept = age_s > 0.0 ? std::exp(-age_s / point.slow_error_time_s) : 1.0;
  const double shared_V = std::min(std::max(point.ocv_slope_V, 0.0) * sigma, point.slow_error_V);
  p_[soc_at][error_at] = p_[error_at][soc_at] = -kept * sigma * shared_V;
}

bool SocFilter::are_fields_possible() const {
  constexpr double most = 1e6;
  const auto are_within = [](const Vector& values, double bound) {
    return std::all_of(values.begin(), values.end(), [&](double value) { return is_within(value, -bound, bound); });
  };
  return capacity_As_ > 0.0 && capacity_As_ <= charge_most_As && are_within(x_, most) &&
         std::all_of(p_.begin(), p_.end(), [&](const Vector& row) { return are_within(row, most * most); }) &&
         is_within(hysteresis_, -1.0, 1.0) && is_within(temperature_C_, -most, most) &&
         is_within(true_current_A_, -most, most);
}

/// With the first current: that before it is unknown.
void SocFilter::begin_pairs(const CellPoint& point, double current_A) {
  are_pairs_unknown_ = false;
  for (std::size_t pair = 0; pair < CellDynamics::pairs; ++pair) {
    x_[pair_at + pair] += pair_begin_share[pair] * point.pair_Ohm[pair] * current_A;
  }
}

void SocFilter::follow_hysteresis(double charge_As) {
  const double share = std::abs(charge_As) / (cell_->hysteresis_charge * cell_->capacity_As);
  const double towards = charge_As > 0.0 ? -1.0 : 1.0;
  hysteresis_ = towards + (hysteresis_ - towards) * std::exp(-share);
}

void SocFilter::count(const CellSample& sample) {
  const bool is_counted = is_measured(sample.mean_current_A);
  const double told_A = is_counted ? sample.mean_current_A : 0.0;
  // A silent sensor adds no offset.
  true_current_A_ = is_counted ? told_A - x_[offset_at] - told_A * x_[counting_at] : 0.0;
  const double efficiency = true_current_A_ < 0.0 ? cell_->charge_efficiency : 1.0;
  const double per_A = -sample.passed_s / capacity_As_ * efficiency;
  const double lost = self_discharge_A(*cell_, temperature_C_) * sample.passed_s / capacity_As_;
  x_[soc_at] = std::clamp(x_[soc_at] + per_A * true_current_A_ - lost, -soc_beyond, 1.0 + soc_beyond);
  // The covariance of the state of charge takes up the effect of the offset and of the share: its row, then its column.
  const double by_offset = is_counted ? -per_A : 0.0;
  const double by_share = -per_A * told_A;
  for (std::size_t k = 0; k < size; ++k) p_[soc_at][k] += by_offset * p_[offset_at][k] + by_share * p_[counting_at][k];
  for (std::size_t k = 0; k < size; ++k) p_[k][soc_at] += by_offset * p_[k][offset_at] + by_share * p_[k][counting_at];
  // An uncounted current may flow the same way all the time.
  const double unseen_A = sensor_.unseen_A(sample);
  if (unseen_A > 0.0) p_[soc_at][soc_at] = square(std::sqrt(p_[soc_at][soc_at]) + std::abs(per_A) * unseen_A);
  bound_doubt();
  follow_hysteresis(told_A * sample.passed_s);
}

/// Scales the row and the column of the state of charge, so that the matrix stays a covariance.
void SocFilter::bound_doubt() {
  const double sigma = std::sqrt(p_[soc_at][soc_at]);
  if (sigma <= soc_sigma_max) return;
  const double factor = soc_sigma_max / sigma;
  for (std::size_t k = 0; k < size; ++k) p_[soc_at][k] *= factor;
  for (std::size_t k = 0; k < size; ++k) p_[k][soc_at] *= factor;
}

void SocFilter::fade(const CellSample& sample, const CellPoint& point, ModelMemo& memo) {
  const double passed_s = sample.passed_s;
  const double unseen_A = sensor_.unseen_A(sample);
  Vector keeps{};
  Vector added{};
  keeps.fill(1.0);
  const auto& pairs_left = memo.pairs_left(*cell_, passed_s);
  for (std::size_t pair = 0; pair < CellDynamics::pairs; ++pair) {
    const double keep = pairs_left[pair];
    const double settled_V = point.pair_Ohm[pair] * true_current_A_;
    x_[pair_at + pair] = settled_V + (x_[pair_at + pair] - settled_V) * keep;
    keeps[pair_at + pair] = keep;
    added[pair_at + pair] = square(point.pair_Ohm[pair] * unseen_A) * (1.0 - square(keep));
  }
  using Fading = ModelMemo::Fading;
  const auto wander = [&](At which, Fading fading, double sigma, double time_s) {
    const double keep = memo.left(fading, passed_s, time_s);
    x_[which] *= keep;
    keeps[which] = keep;
    added[which] = square(sigma) * (1.0 - square(keep));
  };
  wander(error_at, Fading::error, point.slow_error_V, point.slow_error_time_s);
  wander(offset_at, Fading::offset, sensor_.offset_A, offset_time_s);
  wander(resistance_at, Fading::resistance, resistance_share_sigma, resistance_time_s);
  for (std::size_t row = 0; row < size; ++row) {
    for (std::size_t column = 0; column < size; ++column) p_[row][column] *= keeps[row] * keeps[column];
    p_[row][row] += added[row];
  }
}

/// Terminal voltage without the model's error, if the state of charge were that of `there`. An RC element would have
/// been charged through the resistance there, so its voltage would be larger in that ratio.
double SocFilter::voltage_V(const CellPoint& here, const CellPoint& there, const Current& current) const {
  double drop_V = there.series_Ohm * current.A + there.kinetic_Ohm * current.kinetic_A;
  for (std::size_t pair = 0; pair < CellDynamics::pairs; ++pair) {
    const double ratio = here.pair_Ohm[pair] > 0.0 ? there.pair_Ohm[pair] / here.pair_Ohm[pair] : 1.0;
    drop_V += x_[pair_at + pair] * std::clamp(ratio, 0.0, pair_ratio_max);
  }
  return there.ocv_V + hysteresis_ * there.hysteresis_V - (1.0 + x_[resistance_at]) * drop_V;
}

SocFilter::Chord SocFilter::chord(const CellPoint& here, const CellDynamics::Row& row, const Current& current) const {
  const double reach = std::max(std::sqrt(p_[soc_at][soc_at]), chord_min);
  const double from = std::max(x_[soc_at] - reach, -soc_beyond);
  const double to = std::min(x_[soc_at] + reach, 1.0 + soc_beyond);
  const double from_V = voltage_V(here, at(row, from), current);
  const double to_V = voltage_V(here, at(row, to), current);
  const double slope_V = (to_V - from_V) / (to - from);
  const double on_line_V = from_V + slope_V * (x_[soc_at] - from);
  return {.slope_V = slope_V, .bend_V = on_line_V - voltage_V(here, here, current)};
}

SocFilter::Errors SocFilter::errors(const CellSample& sample, const CellPoint& point, double current_A,
                                    double bend_V) const {
  const double model_V = point.fast_error_V * (is_measured(sample.temperature_C) ? 1.0 : unknown_temperature_factor);
  return {.sample_V2 = square(voltage_noise_V) + square(resistance_noise_share * point.series_Ohm * current_A),
          .model_V2 = square(model_V) + square(bend_share * bend_V)};
}

void SocFilter::correct(const CellSample& sample, const CellDynamics::Row& row, const CellPoint& point) {
  const double current_A = sample.current_A - x_[offset_at];
  const Current current{.A = current_A, .kinetic_A = kinetic_A(row.exchange_current_A, current_A)};
  if (are_pairs_unknown_) begin_pairs(point, current_A);
  double drop_V = point.series_Ohm * current.A + point.kinetic_Ohm * current.kinetic_A;
  for (std::size_t pair = 0; pair < CellDynamics::pairs; ++pair) drop_V += x_[pair_at + pair];
  const double share = 1.0 + x_[resistance_at];
  const double expected_V = point.ocv_V + hysteresis_ * point.hysteresis_V + x_[error_at] - share * drop_V;

  Vector by{};  // sensitivity of the voltage to each state
  const Chord line = chord(point, row, current);
  by[soc_at] = line.slope_V;
  for (std::size_t pair = 0; pair < CellDynamics::pairs; ++pair) by[pair_at + pair] = -share;
  by[error_at] = 1.0;
  by[offset_at] = share * point.series_Ohm;
  by[resistance_at] = -drop_V;
  innovation_V_ = sample.voltage_V - expected_V;
  const Errors off = errors(sample, point, current_A, line.bend_V);
  // An error that lasts for some seconds counts for as many samples as fit into that time.
  const double counted_V2 = off.sample_V2 + off.model_V2 * (1.0 + 2.0 * point.fast_error_time_s / sample.passed_s);
  const double by_states_V2 = learn(by, innovation_V_, counted_V2);
  innovation_variance_V2_ = by_states_V2 + off.sample_V2 + off.model_V2;
}

/// Adds the normalised innovation of the last voltage to the mean of those before.
void SocFilter::follow_surprise(double left) {
  const double news = std::min(square(innovation_V_) / innovation_variance_V2_, square(surprise_most_sigmas));
  surprise_ += (news - surprise_) * (1.0 - left);
}

double SocFilter::learn(const Vector& by, double innovation, double variance) {
  Vector covariance{};  // of each state with the voltage
  for (std::size_t row = 0; row < size; ++row) {
    for (std::size_t column = 0; column < size; ++column) covariance[row] += p_[row][column] * by[column];
  }
  double by_states = 0.0;
  for (std::size_t row = 0; row < size; ++row) by_states += by[row] * covariance[row];
  variance += by_states;
  const double surprise = square(innovation) / (square(surprise_sigmas) * variance);
  const double weight = 1.0 / (variance * std::max(surprise, 1.0));
  for (std::size_t row = 0; row < size; ++row) {
    x_[row] += covariance[row] * weight * innovation;
    for (std::size_t column = 0; column <= row; ++column) {
      p_[row][column] -= covariance[row] * covariance[column] * weight;
      p_[column][row] = p_[row][column];
    }
  }
  x_[soc_at] = std::clamp(x_[soc_at], -soc_beyond, 1.0 + soc_beyond);
  x_[counting_at] = std::clamp(x_[counting_at], -counting_share_most, counting_share_most);
  x_[resistance_at] = std::clamp(x_[resistance_at], resistance_share_least, resistance_share_most);
  return by_states;
}

void SocFilter::anchor(double soc, double sigma) {
  if (!cell_.is_set() || !(soc >= 0.0 && soc <= 1.0) || !(sigma > 0.0) || !std::isfinite(sigma)) return;
  Vector by{};
  by[soc_at] = 1.0;
  learn(by, soc - x_[soc_at], square(sigma));
}

double SocFilter::misfit() const {
  const double by_counting = std::abs(x_[counting_at]) / counting_share_most;
  const double share = x_[resistance_at];
  const double by_resistance = share / (share > 0.0 ? resistance_share_most : resistance_share_least);
  return std::max({by_counting, by_resistance, std::sqrt(surprise_) / surprise_sigmas});
}

void SocFilter::update(const CellSample& sample, ModelMemo& memo) {
  if (!cell_.is_set() || !sample.has_passed()) return;
  if (is_measured(sample.temperature_C)) temperature_C_ = sample.temperature_C;
  count(sample);
  const CellDynamics::Row& row = memo.row(*cell_, temperature_C_);
  const CellPoint point = at(row, x_[soc_at]);
  fade(sample, point, memo);
  if (!is_measured(sample.voltage_V) || !is_measured(sample.current_A)) return;
  correct(sample, row, point);
  follow_surprise(memo.left(ModelMemo::Fading::surprise, sample.passed_s, surprise_time_s));
}

SocEstimate SocFilter::estimate() const {
  // A state that is not a number, as an invalid covariance leads to, is not reported.
  if (!cell_.is_set() || std::isnan(x_[soc_at])) return {};
  return {.is_known = true,
          .soc = std::clamp(x_[soc_at], 0.0, 1.0),
          .sigma = std::min(told_sigma_factor * std::sqrt(p_[soc_at][soc_at]), soc_sigma_max)};
}

}  // namespace bmu

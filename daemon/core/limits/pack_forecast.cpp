#include "daemon/core/limits/pack_forecast.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

namespace bmu {

namespace {

constexpr double uV_per_V = 1e6;
constexpr double mA_per_A = 1e3;

/// Voltage at which a cell is held, so that it does not reach its opening threshold.
std::int32_t held_uV(const LimitConfig& limit) {
  constexpr std::int64_t all_permille = 1'000;
  const std::int64_t way_uV = std::int64_t{limit.derates_from()} - limit.open;
  return static_cast<std::int32_t>(limit.open + way_uV * forecast_holds_back_permille / all_permille);
}

using Ask = double (CellForecast::*)(const ForecastBound&) const;

struct QuestionRow {
  PredictedLimit PredictedLimits::*limit;
  Ask ask;
  double horizon_s;
};
constexpr std::array questions{
    QuestionRow{&PredictedLimits::discharge, &CellForecast::discharge_A, forecast_peak_s},
    QuestionRow{&PredictedLimits::charge, &CellForecast::charge_A, forecast_peak_s},
    QuestionRow{&PredictedLimits::discharge_continuous, &CellForecast::discharge_A, forecast_continuous_s},
    QuestionRow{&PredictedLimits::charge_continuous, &CellForecast::charge_A, forecast_continuous_s},
};

}  // namespace

CellForecastInput measured_only(const CellDynamics& cell, double voltage_V, double current_A, double temperature_C) {
  CellForecastInput input{.voltage_V = voltage_V, .current_A = current_A, .temperature_C = temperature_C};
  if (!is_measured(voltage_V) || !is_measured(current_A) || !is_measured(temperature_C) || cell.rows.empty()) {
    return input;
  }
  constexpr double middle = 0.5;
  constexpr double sigmas = 2.0;
  const CellPoint point = at(cell, middle, temperature_C);
  const double at_once_V = current_A * point.series_Ohm + kinetic_V(point, current_A);
  const double late_V = current_A * (point.pair_Ohm[0] + point.pair_Ohm[1] + point.pair_Ohm[2]);
  const double off_V = point.hysteresis_V + sigmas * point.slow_error_V;
  const double low_V = voltage_V + at_once_V + std::min(late_V, 0.0) - off_V;
  const double high_V = voltage_V + at_once_V + std::max(late_V, 0.0) + off_V;
  const double low = soc_from_ocv(cell, low_V, temperature_C, 0.0);
  const double high = soc_from_ocv(cell, high_V, temperature_C, 0.0);
  input.soc = {.is_known = true, .soc = (low + high) / 2.0, .sigma = (high - low) / (2.0 * sigmas)};
  return input;
}

PackForecast::PackForecast(const CellDynamics& cell, const CoreConfig& config) : cell_(cell) {
  static_assert(std::tuple_size_v<decltype(bounds_)> == questions.size());
  const std::int32_t low_uV = held_uV(config.limits.cell_undervoltage);
  const std::int32_t high_uV = held_uV(config.limits.cell_overvoltage);
  const CurrentLimitConfig most = carried(config);
  limits_.discharge = {.limit_mA = std::max(most.discharge_peak_mA, most.discharge_continuous_mA), .holds_uV = low_uV};
  limits_.charge = {.limit_mA = std::max(most.charge_peak_mA, most.charge_continuous_mA), .holds_uV = high_uV};
  limits_.discharge_continuous = {.limit_mA = most.discharge_continuous_mA, .holds_uV = low_uV};
  limits_.charge_continuous = {.limit_mA = most.charge_continuous_mA, .holds_uV = high_uV};
  for (std::size_t question = 0; question < questions.size(); ++question) {
    const QuestionRow& row = questions[question];
    bounds_[question] = {.voltage_V = (limits_.*row.limit).holds_uV / uV_per_V, .horizon = {cell, row.horizon_s}};
  }
}

void PackForecast::add(const CellForecastInput& input, const Element& element) {
  const CellDynamics::Row& row = rows_.of(input.temperature_C, [&] { return forecast_row(cell_, input); });
  const CellForecast forecast(cell_, row, input);
  if (!forecast.is_known()) {
    limits_.is_complete = false;
    return;
  }
  for (std::size_t question = 0; question < questions.size(); ++question) {
    const QuestionRow& asked = questions[question];
    PredictedLimit& limit = limits_.*asked.limit;
    bounds_[question].at_most_A = limit.limit_mA / mA_per_A;
    const double most_A = (forecast.*asked.ask)(bounds_[question]);
    const auto most_mA = static_cast<std::int32_t>(std::floor(most_A * mA_per_A + 1e-6));
    if (limit.is_known && most_mA >= limit.limit_mA) continue;
    limit.is_known = true;
    limit.limit_mA = std::min(most_mA, limit.limit_mA);
    limit.voltage_uV = static_cast<std::int32_t>(std::lround(input.voltage_V * uV_per_V));
    limit.element = element;
  }
}

}  // namespace bmu

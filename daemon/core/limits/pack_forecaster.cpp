#include "daemon/core/limits/pack_forecaster.hpp"

#include "daemon/core/limits/pack_forecast.hpp"

namespace bmu {

namespace {

constexpr double uV_per_V = 1e6;
constexpr double mA_per_A = 1e3;
constexpr double dC_per_C = 10.0;

}  // namespace

void PackForecaster::update(const ForecasterInputs& in, const CoreConfig& config) {
  if (in.estimate->pack().is_known) {
    ask_estimated(in, config);
  } else {
    ask_measured(in, config);
  }
}

void PackForecaster::keep(const PredictedLimits& limits, TimePoint now, const MeasuredAt& of) {
  limits_ = limits;
  asked_at_ = now;
  asked_for_ = of;
}

void PackForecaster::ask_estimated(const ForecasterInputs& in, const CoreConfig& config) {
  const PackEstimate& estimate = *in.estimate;
  const TimePoint pictured_at = estimate.pictured_at();
  const MeasuredAt measured_at{pictured_at, pictured_at};
  const bool is_fresh = in.now - pictured_at <= config.ages.cell_voltage;
  if (is_fresh && asked_for_ == measured_at) return;
  PackForecast forecast(estimate.model(), config);
  for (std::size_t cell = 0; cell < estimate.size(); ++cell) {
    forecast.add(is_fresh ? estimate.forecast_input(cell) : CellForecastInput{}, estimate.element(cell));
  }
  keep(forecast.limits(), in.now, measured_at);
}

/// The current of a sample set is known one sensor sample later; until then the previous prediction remains valid.
void PackForecaster::ask_measured(const ForecasterInputs& in, const CoreConfig& config) {
  constexpr Duration apart_max = 100ms;  // of a sample of the current from the sample set
  const Spread& cells = in.pack->cell_voltage_uV;
  const Spread& temperatures = in.pack->cell_temperature_dC;
  const CellDynamics& model = in.estimate->model();
  const MeasuredAt measured_at{cells.min_taken_at, cells.max_taken_at};
  if (model.rows.empty() || (measured_at == asked_for_ && limits_.is_complete)) return;
  const double coldest_C = temperatures.is_known() ? temperatures.min / dC_per_C : not_measured;
  PackForecast forecast(model, config);
  const auto add = [&](std::int32_t voltage_uV, TimePoint taken_at, const Element& element) {
    const auto current_mA = in.sensors->current_window.at(taken_at, apart_max);
    const double current_A = cells.is_known() && current_mA.has_value() ? *current_mA / mA_per_A : not_measured;
    forecast.add(measured_only(model, voltage_uV / uV_per_V, current_A, coldest_C), element);
  };
  add(cells.min, cells.min_taken_at, cells.min_at);
  add(cells.max, cells.max_taken_at, cells.max_at);
  if (!forecast.limits().is_complete && in.now - asked_at_ <= config.ages.cell_voltage) return;
  keep(forecast.limits(), in.now, measured_at);
}

}  // namespace bmu

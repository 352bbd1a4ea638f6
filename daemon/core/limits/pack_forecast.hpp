// Current limits by the predicted voltages of all cells, in both directions, for the peak and for continuous current:
// queries each cell (current_prediction.hpp) and keeps the smallest results with their cells.
//
//   PackForecast forecast(cell, config);
//   for each cell: forecast.add({.voltage_V = ..., ...}, element);
//   evaluate_limits(pack, config, {..., .predicted = forecast.limits()});
//
// Voltages are held before their opening thresholds, by a quarter of the way to where the linear derating starts, so
// that neither the uncertainty of a prediction nor a charger that receives a limit once a second leads to an opening.
//
// Each query of a cell only goes up to the result of the cells before it: where no cell is near its bounds that costs
// three evaluations of the model a cell, and two for each of the four queries.
#pragma once

#include <array>

#include "daemon/core/cell/cell_dynamics.hpp"
#include "daemon/core/limits/current_prediction.hpp"
#include "daemon/core/limits/limits.hpp"
#include "daemon/core/types/core_config.hpp"
#include "daemon/core/types/memo.hpp"

namespace bmu {

/// In permille of the way from `open` to `derates_from`.
inline constexpr std::int32_t forecast_holds_back_permille = 250;

/// State of a cell without an estimate: the measured values, and the states of charge that the model permits with them,
/// its RC elements at rest or settled, its hysteresis on either side, and the model off by two standard deviations of
/// its error. Cost: some 40 evaluations of the model.
[[nodiscard]] CellForecastInput measured_only(const CellDynamics& cell, double voltage_V, double current_A,
                                              double temperature_C);

class PackForecast {
 public:
  /// `cell` must outlive this.
  PackForecast(const CellDynamics& cell, const CoreConfig& config);

  /// Adds a cell. One that cannot be predicted makes the result incomplete.
  void add(const CellForecastInput& input, const Element& element);

  /// Not known before the first cell that can be predicted.
  [[nodiscard]] const PredictedLimits& limits() const { return limits_; }

 private:
  const CellDynamics& cell_;
  std::array<ForecastBound, 4> bounds_;   // one for each query
  Memo<double, CellDynamics::Row> rows_;  // by temperature
  PredictedLimits limits_;
};

}  // namespace bmu

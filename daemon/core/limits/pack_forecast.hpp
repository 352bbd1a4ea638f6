// What the voltages of all cells will bear, in both directions, for a moment and for long: asks each cell
// (current_prediction.hpp) and keeps the smallest answers and whose they are.
//
//   PackForecast forecast(cell, config);
//   for each cell: forecast.add({.voltage_V = ..., ...}, element);
//   evaluate_limits(pack, config, {..., .predicted = forecast.limits()});
//
// Voltages are held before their opening thresholds, by a quarter of the way from where the straight line of the limit
// begins: what is not sure of a prediction, and a charger that hears of a limit once a second, stay on this side of
// what opens.
//
// Each question is asked of a cell only up to what the cells before it left: where no cell is near its bounds that
// costs three looks at the model a cell, and two for each of the four questions.
#pragma once

#include <array>

#include "daemon/core/cell/cell_dynamics.hpp"
#include "daemon/core/limits/current_prediction.hpp"
#include "daemon/core/limits/limits.hpp"
#include "daemon/core/types/core_config.hpp"
#include "daemon/core/types/memo.hpp"

namespace bmu {

/// In permille of the way from `derates_from` to `open`, seen from `open`.
inline constexpr std::int32_t forecast_holds_back_permille = 250;

/// All that is known of a cell whose state nobody estimates: what was measured, and the states of charge that the model
/// finds possible with it, be its pairs at rest or settled, its hysteresis on either side, and the model off by what it
/// says it may be. Cost: some 40 looks at the model.
[[nodiscard]] CellForecastInput measured_only(const CellDynamics& cell, double voltage_V, double current_A,
                                              double temperature_C);

class PackForecast {
 public:
  /// `cell` must outlive this.
  PackForecast(const CellDynamics& cell, const CoreConfig& config);

  /// A cell of which nothing can be said makes the answer incomplete.
  void add(const CellForecastInput& input, const Element& element);

  /// Not known before the first cell of which something could be said.
  [[nodiscard]] const PredictedLimits& limits() const { return limits_; }

 private:
  const CellDynamics& cell_;
  std::array<ForecastBound, 4> bounds_;   // each question's
  Memo<double, CellDynamics::Row> rows_;  // by temperature
  PredictedLimits limits_;
};

}  // namespace bmu

// What a forecast of one cell begins with (limits/current_prediction.hpp).
#pragma once

#include <array>

#include "daemon/core/cell/cell_dynamics.hpp"
#include "daemon/core/estimation/soc/soc_estimate.hpp"

namespace bmu {

/// What is known of a cell at the moment its voltage was taken. Left out is not known.
struct CellForecastInput {
  double voltage_V = not_measured;
  double current_A = not_measured;  // at that moment, out of the cell
  double temperature_C = not_measured;
  SocEstimate soc{};
  double hysteresis = not_measured;  // -1: on the curve of discharging, 1: of charging
  std::array<double, CellDynamics::pairs> pair_V{not_measured, not_measured, not_measured};
  double resistance_share = not_measured;  // 0.4: this cell has 40 % more than its model; -0.9 to 9
  double resistance_sigma = not_measured;  // one standard deviation of that, 0 or more
};

}  // namespace bmu

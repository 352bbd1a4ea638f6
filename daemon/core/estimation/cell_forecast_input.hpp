// Initial state of one cell for a prediction (limits/current_prediction.hpp).
#pragma once

#include <array>

#include "daemon/core/cell/cell_dynamics.hpp"
#include "daemon/core/estimation/soc/soc_estimate.hpp"

namespace bmu {

/// State of a cell at the instant of its voltage sample. Members that are not given are unknown.
struct CellForecastInput {
  double voltage_V = not_measured;
  double current_A = not_measured;  // at that instant, out of the cell
  double temperature_C = not_measured;
  SocEstimate soc{};
  double hysteresis = not_measured;  // -1: on the discharge curve, 1: on the charge curve
  std::array<double, CellDynamics::pairs> pair_V{not_measured, not_measured, not_measured};
  double resistance_share = not_measured;  // 0.4: this cell has 40 % more than its model; -0.9 to 9
  double resistance_sigma = not_measured;  // one standard deviation of the share, 0 or more
};

}  // namespace bmu

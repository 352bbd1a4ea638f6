// A cell of 1 Ah with a voltage that rises linearly from 3 to 4 V, and one resistance: for tests with figures that can
// be worked out in the head.
#pragma once

#include "daemon/core/cell/cell_dynamics.hpp"
#include "daemon/core/estimation/soc/charge_ends.hpp"
#include "daemon/core/estimation/soc/soc_estimate.hpp"

namespace bmu::test {

inline CellDynamics plain_cell() {
  CellModel model;
  model.ocv.push_back({0, 3'000'000});
  model.ocv.push_back({1000, 4'000'000});
  model.capacity_uAs = 3'600'000'000;
  model.series_resistance_Ohm = 0.05;
  return dynamics_of(model);
}

inline constexpr ChargeEndConfig plain_ends{
    .full_V = 3.995, .full_current_A = 0.05, .empty_V = 3.005, .empty_current_A = 0.2};

/// Room temperature, constant current since the previous sample.
inline CellSample plain_sample(double voltage_V, double current_A, double passed_s = 1.0) {
  return {.passed_s = passed_s,
          .mean_current_A = current_A,
          .current_A = current_A,
          .voltage_V = voltage_V,
          .temperature_C = 25.0};
}

}  // namespace bmu::test

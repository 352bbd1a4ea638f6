// Health of the pack from that of its cells (cell_health.hpp): the weakest cell limits its capacity, the worst cell its
// power.
//
// Evaluated on request, without state. Cost: two square roots a cell, and CellHealth::health() of two.
#pragma once

#include <cstddef>

#include "daemon/core/estimation/health/pack_resistance.hpp"
#include "daemon/core/estimation/health/state_of_health.hpp"
#include "daemon/core/estimation/pack_estimate.hpp"

namespace bmu {

/// Cells by number through the pack, from 0; of equal cells the first.
struct PackHealth {
  HealthFigure by_capacity;    // of the cell that has lost most (FS_5); known once that of every cell is
  HealthFigure by_resistance;  // likewise
  std::size_t weakest_cell = 0;
  std::size_t worst_cell = 0;
  PackResistance resistance;  // each cell at its temperature; known once that of every cell is
  double cell_resistance_min_Ohm = 0.0;
  double cell_resistance_max_Ohm = 0.0;  // of resistance.worst_cell
  std::size_t cell_resistance_min_cell = 0;
};

[[nodiscard]] PackHealth pack_health(const PackEstimate& estimate);

}  // namespace bmu

// How a pack has aged, from its cells (cell_health.hpp): it holds what its weakest cell holds, and gives what its worst
// cell gives.
//
// Asked for, not followed. Cost: two square roots a cell, and CellHealth::health() of two.
#pragma once

#include <cstddef>

#include "daemon/core/estimation/health/pack_resistance.hpp"
#include "daemon/core/estimation/health/state_of_health.hpp"
#include "daemon/core/estimation/pack_estimate.hpp"

namespace bmu {

/// Cells by number through the pack, from 0; the first of those that are alike.
struct PackHealth {
  HealthFigure by_capacity;    // of the cell that has lost most (FS_5); known once it is of every cell
  HealthFigure by_resistance;  // likewise
  std::size_t weakest_cell = 0;
  std::size_t worst_cell = 0;
  PackResistance resistance;  // each cell at its temperature; known once it is of every cell
  double cell_resistance_min_Ohm = 0.0;
  double cell_resistance_max_Ohm = 0.0;  // of resistance.worst_cell
  std::size_t cell_resistance_min_cell = 0;
};

[[nodiscard]] PackHealth pack_health(const PackEstimate& estimate);

}  // namespace bmu

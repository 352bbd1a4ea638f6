// Resistance of a pack, and its worst cell, from those of its cells (BMS_F.6, BMS_F.7).
//
// Cost: one pass over the cells.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "daemon/core/estimation/health/resistance_tracker.hpp"

namespace bmu {

struct PackResistance {
  bool is_known = false;
  double resistance_Ohm = 0.0;  // of all cells in series, without the connections between them
  /// The errors of all cells have one cause (one sensor, one method), so they add up and do not average out.
  double sigma_Ohm = 0.0;
  std::size_t worst_cell = 0;       // the first of those with the highest resistance
  std::int64_t worst_permille = 0;  // its resistance, of the average cell's: 2000 is twice the average
};

/// In the order of the cells; their temperatures may differ. A warm cell among cold ones looks better than it is: where
/// that matters take the estimates at resistance_reference_C. Unknown until every cell is known, and without cells.
[[nodiscard]] PackResistance pack_resistance(std::span<const ResistanceEstimate> cells);

}  // namespace bmu

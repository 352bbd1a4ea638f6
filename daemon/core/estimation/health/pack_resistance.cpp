#include "daemon/core/estimation/health/pack_resistance.hpp"

#include <algorithm>
#include <cmath>

namespace bmu {

PackResistance pack_resistance(std::span<const ResistanceEstimate> cells) {
  const bool knows_all =
      std::all_of(cells.begin(), cells.end(), [](const ResistanceEstimate& cell) { return cell.is_known; });
  if (cells.empty() || !knows_all) return {};
  PackResistance pack{.is_known = true};
  for (std::size_t cell = 0; cell < cells.size(); ++cell) {
    pack.resistance_Ohm += cells[cell].resistance_Ohm;
    pack.sigma_Ohm += cells[cell].sigma_Ohm;
    if (cells[cell].resistance_Ohm > cells[pack.worst_cell].resistance_Ohm) pack.worst_cell = cell;
  }
  constexpr double permille = 1000.0;
  const double average_Ohm = pack.resistance_Ohm / static_cast<double>(cells.size());
  pack.worst_permille = std::llround(cells[pack.worst_cell].resistance_Ohm / average_Ohm * permille);
  return pack;
}

}  // namespace bmu

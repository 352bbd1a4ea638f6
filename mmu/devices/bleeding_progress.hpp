// Detects bleeding without effect: a cell that is above the lowest of its module because it holds more charge comes
// down when it is bled; one that only reads high (a channel that is stuck or off) does not, and would be emptied by one
// round after another without supervision.
//
// Before each round a cell's surplus over the lowest, at rest, is compared with its surplus at the last progress.
// Progress is a millivolt less than that; a cell with ten rounds since then and no progress gets no eleventh. Balancing
// of a module without master therefore ends: after at most ten rounds for each millivolt of surplus. A large cell,
// which loses less than a millivolt in ten minutes, is left to a master that can determine its charge.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "mmu/devices/sampling.hpp"

namespace bmu {

class BleedingProgress {
 public:
  static constexpr std::int32_t progress_uV = 1'000;
  static constexpr std::uint8_t rounds_max = 10;

  /// Cells that bleeding did not bring down in its last rounds.
  [[nodiscard]] constexpr CellMask hopeless() const { return hopeless_; }

  /// Before a round of these cells; `at_rest` was measured with all switches off. Returns those of them that bleeding
  /// may bring down.
  constexpr CellMask begin_round(CellMask cells, const CellReading& at_rest) {
    std::int32_t lowest_uV = INT32_MAX;
    for (std::size_t cell = 0; cell < mmu_cells_max; ++cell) {
      if (has_cell(at_rest.measured, cell)) lowest_uV = std::min(lowest_uV, at_rest.cell_voltage_uV[cell]);
    }
    for (std::size_t cell = 0; cell < mmu_cells_max; ++cell) {
      if (has_cell(cells, cell)) note(cell, at_rest.cell_voltage_uV[cell] - lowest_uV);
    }
    return static_cast<CellMask>(cells & ~hopeless_);
  }

 private:
  constexpr void note(std::size_t cell, std::int32_t surplus_uV) {
    if (rounds_[cell] == 0 || surplus_uV <= least_uV_[cell] - progress_uV) {
      least_uV_[cell] = surplus_uV;
      rounds_[cell] = 0;
    }
    if (rounds_[cell] == rounds_max) {
      hopeless_ = static_cast<CellMask>(hopeless_ | cell_bit(cell));
    } else {
      ++rounds_[cell];
    }
  }

  std::array<std::int32_t, mmu_cells_max> least_uV_{};
  std::array<std::uint8_t, mmu_cells_max> rounds_{};  // since its last progress
  CellMask hopeless_ = 0;
};

}  // namespace bmu

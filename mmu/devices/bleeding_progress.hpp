// Whether bleeding does anything: a cell that stands above the lowest of its module because it holds more comes down
// when it is bled; one that only seems to (a channel that is stuck or off) does not, and would be emptied by one round
// after another with nobody there to see it.
//
// Before each round a cell's surplus over the lowest, at rest, is held against the least surplus it ever had. Progress
// is a millivolt less than that; a cell with ten rounds behind it and no progress is not worth an eleventh. So a module
// left alone ends: ten rounds for each millivolt of surplus at most. A large cell, of which ten minutes take less than
// a millivolt, is left to a master that knows its charge.
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

  /// Cells that bleeding has not brought down in its last rounds.
  [[nodiscard]] constexpr CellMask hopeless() const { return hopeless_; }

  /// A round of these cells is about to begin; `at_rest` is what was measured with all switches off. Returns those of
  /// them that are worth it.
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

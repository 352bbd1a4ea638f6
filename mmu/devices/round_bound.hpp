// What ends a cell's part in a round of balancing on the module's own account before its minute is over (MMU_AB): it
// has come down to the lowest cell. Small cells lose their whole imbalance in less than a minute.
//
// A bleeding cell reads lower than it is, by the current in its wires, and its neighbours higher. So it is not its
// voltage that is compared but its fall, against the lowest cell, which does not bleed: from the first average taken
// wholly with the switch on,
//
//   fall = (cell - lowest) then - (cell - lowest) now        ends at (cell - lowest) of the last look at rest
//
// The cell's own slower voltage drop falls, too: it ends too early rather than too late, and what is left is another
// round's. It is bled too long by the averages it takes to see it: 300 ms at most, not a minute. A lowest cell that is
// not measured any more ends all.
#pragma once

#include <array>
#include <cstdint>

#include "mmu/devices/sampling.hpp"

namespace bmu {

class RoundBound {
 public:
  /// The last average, at rest, before the cells' switches go on. Returns those of them that stand above the lowest:
  /// the others are not to be bled.
  constexpr CellMask begin(CellMask cells, const CellReading& rest) {
    *this = {};
    for (std::size_t cell = 0; cell < mmu_cells_max; ++cell) {
      const bool is_lower =
          has_cell(rest.measured, cell) && (!has_lowest_ || rest.cell_voltage_uV[cell] < lowest(rest));
      if (!is_lower) continue;
      has_lowest_ = true;
      lowest_ = cell;
    }
    for (std::size_t cell = 0; cell < mmu_cells_max; ++cell) {
      const bool is_meant = has_cell(cells, cell) && has_cell(rest.measured, cell);
      if (!is_meant || rest.cell_voltage_uV[cell] <= lowest(rest)) continue;
      excess_uV_[cell] = rest.cell_voltage_uV[cell] - lowest(rest);
      bound_ = static_cast<CellMask>(bound_ | cell_bit(cell));
    }
    return bound_;
  }

  /// An average is complete, and these switches are on at its end: the cells that have come down.
  constexpr CellMask check(const CellReading& reading, CellMask switches) {
    CellMask ended = 0;
    for (std::size_t cell = 0; cell < mmu_cells_max; ++cell) {
      if (!has_cell(bound_, cell)) continue;
      const bool was_on = has_cell(on_before_, cell);
      if (!was_on || !has_cell(switches, cell)) {
        is_begun_ = static_cast<CellMask>(is_begun_ & ~cell_bit(cell));
        continue;
      }
      if (has_come_down(cell, reading)) ended = static_cast<CellMask>(ended | cell_bit(cell));
    }
    on_before_ = switches;
    bound_ = static_cast<CellMask>(bound_ & ~ended);
    return ended;
  }

 private:
  [[nodiscard]] constexpr std::int32_t lowest(const CellReading& reading) const {
    return reading.cell_voltage_uV[lowest_];
  }
  constexpr bool has_come_down(std::size_t cell, const CellReading& reading) {
    if (!has_cell(reading.measured, lowest_)) return true;
    if (!has_cell(reading.measured, cell)) return false;  // damaged on its way: the next one tells
    const std::int32_t above_uV = reading.cell_voltage_uV[cell] - lowest(reading);
    if (!has_cell(is_begun_, cell)) {
      is_begun_ = static_cast<CellMask>(is_begun_ | cell_bit(cell));
      // After a pause it goes on where it was: what had fallen until then stays fallen.
      begun_uV_[cell] = above_uV + fallen_uV_[cell];
    }
    fallen_uV_[cell] = begun_uV_[cell] - above_uV;
    return fallen_uV_[cell] >= excess_uV_[cell];
  }

  bool has_lowest_ = false;
  std::size_t lowest_ = 0;
  CellMask bound_ = 0;      // cells that are watched
  CellMask on_before_ = 0;  // switches at the end of the average before
  CellMask is_begun_ = 0;   // cells with a first average under their switch
  CellVoltages excess_uV_{};
  CellVoltages begun_uV_{};
  CellVoltages fallen_uV_{};
};

}  // namespace bmu

// End of a cell's part in a round of autonomous balancing before its minute is over (MMU_AB): it has come down to the
// lowest cell. Small cells lose their whole imbalance in less than a minute.
//
// A bleeding cell reads lower than its voltage, by the current in its wires, and its neighbours higher. Therefore not
// its voltage is compared but its fall, against the lowest cell, which does not bleed: from the first average taken
// completely with the switch on,
//
//   fall = (cell - lowest) then - (cell - lowest) now        ends at (cell - lowest) of the last average at rest
//
// The cell's own slower voltage drop is included in the fall: the bleeding ends too early rather than too late, and the
// remainder is left to another round. A cell is bled too long by the averages that the detection takes: 300 ms at most,
// not a minute. If the lowest cell is no longer measured, all end.
#pragma once

#include <array>
#include <cstdint>

#include "mmu/devices/sampling.hpp"

namespace bmu {

class RoundBound {
 public:
  /// Starts a round; `rest` is the last average, at rest, before the cells' switches go on. Returns those of the cells
  /// that are above the lowest: the others must not be bled.
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

  /// Called when an average is complete; `switches` are on at its end. Returns the cells that have come down.
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
    if (!has_cell(reading.measured, cell)) return false;  // damaged on its way: the next average decides
    const std::int32_t above_uV = reading.cell_voltage_uV[cell] - lowest(reading);
    if (!has_cell(is_begun_, cell)) {
      is_begun_ = static_cast<CellMask>(is_begun_ | cell_bit(cell));
      // After a pause the fall until then is kept.
      begun_uV_[cell] = above_uV + fallen_uV_[cell];
    }
    fallen_uV_[cell] = begun_uV_[cell] - above_uV;
    return fallen_uV_[cell] >= excess_uV_[cell];
  }

  bool has_lowest_ = false;
  std::size_t lowest_ = 0;
  CellMask bound_ = 0;      // cells that are monitored
  CellMask on_before_ = 0;  // switches at the end of the previous average
  CellMask is_begun_ = 0;   // cells with a first average with their switch on
  CellVoltages excess_uV_{};
  CellVoltages begun_uV_{};
  CellVoltages fallen_uV_{};
};

}  // namespace bmu

// Detects cells of a module above its lowest one, for autonomous balancing (MMU_IMB): each 100 ms average taken
// completely at rest, with no switch on, is a check; a cell more than 5 mV above the lowest in more than 50 checks in a
// row counts as imbalanced. The current through a switch shifts the voltage of its cell and its wires, which is no
// imbalance, so a switch that goes on resets all counts, and the checks start again when all are off.
//
//   switches   ____________________|~~~~~~~~~~~~~~~ 1 min ~~~~~~~~~~|____________________
//   checks     1 2 3 ... 50 51 -> balance                             1 2 3 ...
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "mmu/devices/sampling.hpp"

namespace bmu {

class ImbalanceWatch {
 public:
  static constexpr std::int32_t tolerance_uV = 5'000;
  static constexpr std::uint8_t checks_tolerated = 50;

  /// Called once per tick; `is_any_on`: whether any switch is on.
  constexpr void note_switches(bool is_any_on) {
    if (!is_any_on) return;
    *this = {};
    is_window_at_rest_ = false;
  }
  /// Called when an average is complete; `reading` holds the cells that it renewed. A cell without a new voltage keeps
  /// its count. A window without any voltage counts as a check nevertheless, so that a decision is reached in any case.
  constexpr void check(const CellReading& reading) {
    const bool was_at_rest = is_window_at_rest_;
    is_window_at_rest_ = true;
    if (!was_at_rest) return;
    checks_ = counted(checks_);
    std::int32_t lowest_uV = INT32_MAX;
    for (std::size_t cell = 0; cell < mmu_cells_max; ++cell) {
      if (has_cell(reading.measured, cell)) lowest_uV = std::min(lowest_uV, reading.cell_voltage_uV[cell]);
    }
    for (std::size_t cell = 0; cell < mmu_cells_max; ++cell) {
      if (!has_cell(reading.measured, cell)) continue;
      const bool is_above = reading.cell_voltage_uV[cell] - lowest_uV > tolerance_uV;
      flagged_[cell] = is_above ? counted(flagged_[cell]) : std::uint8_t{0};
    }
  }

  [[nodiscard]] constexpr CellMask cells() const {
    CellMask mask = 0;
    for (std::size_t cell = 0; cell < mmu_cells_max; ++cell) {
      if (flagged_[cell] > checks_tolerated) mask = static_cast<CellMask>(mask | cell_bit(cell));
    }
    return mask;
  }
  /// Whether the rest was long enough for every imbalance to be counted.
  [[nodiscard]] constexpr bool is_decided() const { return checks_ > checks_tolerated; }

 private:
  static constexpr std::uint8_t counted(std::uint8_t count) {
    return count > checks_tolerated ? count : static_cast<std::uint8_t>(count + 1);
  }

  std::array<std::uint8_t, mmu_cells_max> flagged_{};
  std::uint8_t checks_ = 0;
  bool is_window_at_rest_ = false;  // the first window may have started with a switch on
};

}  // namespace bmu

// Under- and overvoltage detected by the module itself, with or without a master (MMU_UV): each 100 ms average is
// compared with two limits, and a cell that was beyond one of them in more than 30 checks in a row has failed.
//
// A failure is latched until the master clears it: otherwise one that occurred and ended between two POLLs would never
// be reported. Clearing starts the count again, so a cell that is still beyond its limit fails again 3.1 s later.
#pragma once

#include <array>
#include <cstdint>

#include "mmu/devices/sampling.hpp"

namespace bmu {

struct CellLimits {
  std::int32_t undervoltage_uV = 3'000'000;
  std::int32_t overvoltage_uV = 4'200'000;
};

class CellProtection {
 public:
  static constexpr int checks_tolerated = 30;

  constexpr void set_limits(const CellLimits& limits) { limits_ = limits; }
  [[nodiscard]] constexpr const CellLimits& limits() const { return limits_; }

  /// One check of a complete average. Reaching a limit counts as being beyond it. A cell without a voltage keeps its
  /// count: a missing value neither clears nor confirms a pending failure.
  constexpr void check(const CellReading& reading) {
    for (std::size_t cell = 0; cell < mmu_cells_max; ++cell) {
      if (!has_cell(reading.measured, cell)) continue;
      undervoltage_.note(cell, reading.cell_voltage_uV[cell] <= limits_.undervoltage_uV);
      overvoltage_.note(cell, reading.cell_voltage_uV[cell] >= limits_.overvoltage_uV);
    }
  }
  constexpr void clear() {
    undervoltage_ = {};
    overvoltage_ = {};
  }

  [[nodiscard]] constexpr CellMask undervoltage() const { return undervoltage_.failed; }
  [[nodiscard]] constexpr CellMask overvoltage() const { return overvoltage_.failed; }
  [[nodiscard]] constexpr CellMask failed() const {
    return static_cast<CellMask>(undervoltage_.failed | overvoltage_.failed);
  }

 private:
  struct Watch {
    std::array<std::uint8_t, mmu_cells_max> flagged{};
    CellMask failed = 0;

    constexpr void note(std::size_t cell, bool is_flagged) {
      if (!is_flagged) {
        flagged[cell] = 0;
      } else if (flagged[cell] < checks_tolerated) {
        ++flagged[cell];
      } else {
        failed = static_cast<CellMask>(failed | cell_bit(cell));
      }
    }
  };

  CellLimits limits_;
  Watch undervoltage_;
  Watch overvoltage_;
};

}  // namespace bmu

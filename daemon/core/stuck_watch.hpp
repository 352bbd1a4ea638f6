// Cell voltages that stand still, to the last digit, although the current has moved: a front end or a module that
// repeats itself looks healthier than any real cell.
//
// For each cell the time is summed up for which its value has been the same while the current was another than when
// this value first came, by so much that the cell's resistance alone makes 5 mV of it. The first other digit ends it.
// At a steady current, or in a rest, a cell may stand still for as long as it likes.
#pragma once

#include <array>
#include <cstdint>

#include "daemon/core/fault_reading.hpp"
#include "daemon/core/module_table.hpp"

namespace bmu {

class StuckWatch {
 public:
  void init(const CellModel& cell);
  /// Once a tick: takes over the cell values that have come since. `current_mA` as known now.
  void update(const ModuleTable& modules, const Measured<std::int32_t>& current_mA);
  void forget() { cells_ = {}; }

  /// The longest of these times, in ms.
  [[nodiscard]] Reading longest_ms(const ModuleTable& modules) const;

 private:
  struct Cell {
    std::int32_t voltage_uV = 0;
    std::int32_t current_mA = 0;  // when this value first came
    TimePoint taken_at{};         // of the latest sample
    Duration stuck_for{};
  };

  void take(Cell& cell, const Measured<std::int32_t>& voltage_uV, std::int32_t current_mA) const;

  std::array<std::array<Cell, internal_bus::cells_per_module_max>, modules_max> cells_{};
  std::int64_t moved_min_mA_ = 0;  // 0: the cell's resistance is not known, nothing is watched
};

}  // namespace bmu

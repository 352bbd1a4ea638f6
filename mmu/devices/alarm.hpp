// Alarm output of a module: a contact in the enable loop of the power distribution unit, driven by the module's own
// protection without any frame. It opens the contactors of a pack when the master hangs and still sends "close".
//
//   opens for      a cell that failed its overvoltage limit (protection.hpp), cells that are too hot (below), thermal
//                  shutdown of the front end; and while the module does not measure: asleep, without power, or
//                  without a voltage of any cell for 254 ms, because its front end is not received
//   not for        undervoltage. An empty pack must be rechargeable, and a charger needs the same contactors; the
//                  master and the contactors' watchdog protect cells from discharge
//
// Too hot is a cell sensor at or above the limit in `samples_to_fail` samples in a row, one each 500 ms. No command
// changes that limit: it is set when the module is installed. A sensor that is not readable keeps its count. A failure
// lasts until COMMAND clear faults, which starts the count again. Constant time; no errors.
#pragma once

#include <array>
#include <cstdint>

#include "mmu/devices/front_end.hpp"
#include "protocol/signal.hpp"

namespace bmu {

class CellHeatWatch {
 public:
  static constexpr int samples_to_fail = 3;

  /// One sample of all sensors, in tenths of a degree.
  constexpr void check(const std::array<SignalValue, mmu_cell_temperatures>& temperature_dC, std::int32_t limit_dC) {
    for (std::size_t sensor = 0; sensor < temperature_dC.size(); ++sensor) {
      const SignalValue& value = temperature_dC[sensor];
      if (!value.is_valid()) continue;
      hot_samples_[sensor] = value.value >= limit_dC ? hot_samples_[sensor] + 1 : 0;
      has_failed_ = has_failed_ || hot_samples_[sensor] >= samples_to_fail;
    }
  }
  constexpr void clear() { *this = {}; }

  [[nodiscard]] constexpr bool has_failed() const { return has_failed_; }

 private:
  std::array<int, mmu_cell_temperatures> hot_samples_{};
  bool has_failed_ = false;
};

}  // namespace bmu

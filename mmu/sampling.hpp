// What a unit knows of its module's cell voltages: the newest sample alone, for a POLL that asks for simultaneous
// values, and the mean of ten samples, the newest full block, for every other POLL and for the protection.
//
//   10 ms   |s s s s s s s s s s|s s s s s s s s s s|s s s ...
//   100 ms             average of these ^
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "protocol/tables/internal_bus.hpp"
#include "protocol/time.hpp"

namespace bmu {

inline constexpr std::size_t mmu_cells_max = internal_bus::cells_per_module_max;

/// One bit a cell, cell 1 in the lowest, as in STATUS and MODULE.
using CellMask = std::uint16_t;
[[nodiscard]] constexpr CellMask cell_bit(std::size_t index) {
  return static_cast<CellMask>(1U << index);
}
[[nodiscard]] constexpr CellMask first_cells(std::size_t count) {
  return static_cast<CellMask>((1U << count) - 1U);
}
[[nodiscard]] constexpr bool has_cell(CellMask mask, std::size_t index) {
  return (mask & cell_bit(index)) != 0;
}

using CellVoltages = std::array<std::int32_t, mmu_cells_max>;  // uV

struct CellReading {
  CellVoltages cell_voltage_uV{};
  CellMask measured = 0;  // a cell that is not in here has no voltage, whatever stands above
  TimePoint taken_at{};   // of the newest sample in it; meaningless while nothing is measured

  [[nodiscard]] constexpr bool exists() const { return measured != 0; }
};

class CellSampler {
 public:
  static constexpr Duration period = internal_bus::cell_sampling_period;
  static constexpr int samples_per_average = 10;

  enum class Step : std::uint8_t { sampled, average_complete };

  /// A sample that came over from the front end undamaged.
  constexpr Step add(const CellVoltages& cell_voltage_uV, CellMask measured, TimePoint now) {
    latest_ = {cell_voltage_uV, measured, now};
    for (std::size_t cell = 0; cell < mmu_cells_max; ++cell) sum_uV_[cell] += cell_voltage_uV[cell];
    measured_in_all_ = good_samples_ == 0 ? measured : static_cast<CellMask>(measured_in_all_ & measured);
    ++good_samples_;
    return count();
  }
  /// A sample whose checksum was wrong. It is dropped: the window goes on, the values it would have renewed age.
  constexpr Step add_damaged() { return count(); }

  [[nodiscard]] constexpr const CellReading& latest() const { return latest_; }
  [[nodiscard]] constexpr const CellReading& average() const { return average_; }

 private:
  constexpr Step count() {
    if (++samples_ < samples_per_average) return Step::sampled;
    if (good_samples_ > 0) {
      average_.measured = measured_in_all_;
      average_.taken_at = latest_.taken_at;
      for (std::size_t cell = 0; cell < mmu_cells_max; ++cell) {
        average_.cell_voltage_uV[cell] = static_cast<std::int32_t>(divide_to_nearest(sum_uV_[cell], good_samples_));
      }
    }
    sum_uV_ = {};
    samples_ = 0;
    good_samples_ = 0;
    return Step::average_complete;
  }

  CellReading latest_;
  CellReading average_;
  std::array<std::int64_t, mmu_cells_max> sum_uV_{};
  CellMask measured_in_all_ = 0;
  int samples_ = 0;
  int good_samples_ = 0;
};

}  // namespace bmu

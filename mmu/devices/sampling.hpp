// Cell voltages of a module: the newest single sample, for a POLL that requests simultaneous values, and the mean of
// ten samples, the newest full block, for every other POLL and for the protection.
//
//   10 ms   |s s s s s s s s s s|s s s s s s s s s s|s s s ...
//   100 ms             average of these ^
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "protocol/tables/internal_bus.hpp"
#include "protocol/time.hpp"

namespace bmu {

inline constexpr std::size_t mmu_cells_max = internal_bus::cells_per_module_max;

/// One bit per cell, cell 1 in the lowest, as in STATUS and MODULE.
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
  CellMask measured = 0;                            // a cell that is not in it has no valid voltage above
  std::array<TimePoint, mmu_cells_max> taken_at{};  // of each cell's oldest sample in it

  [[nodiscard]] constexpr bool exists() const { return measured != 0; }
  /// Time of the oldest voltage; meaningless while no cell is measured.
  [[nodiscard]] constexpr TimePoint oldest() const {
    TimePoint oldest = TimePoint::max();
    for (std::size_t cell = 0; cell < mmu_cells_max; ++cell) {
      if (has_cell(measured, cell)) oldest = std::min(oldest, taken_at[cell]);
    }
    return oldest;
  }
  [[nodiscard]] constexpr CellReading only(CellMask cells) const {
    CellReading reading = *this;
    reading.measured = static_cast<CellMask>(measured & cells);
    return reading;
  }
  [[nodiscard]] constexpr CellMask taken_since(TimePoint time) const {
    CellMask cells = 0;
    for (std::size_t cell = 0; cell < mmu_cells_max; ++cell) {
      if (taken_at[cell] >= time) cells = static_cast<CellMask>(cells | cell_bit(cell));
    }
    return cells;
  }
};

/// Cells of one transfer: those that arrived undamaged, and those with a usable voltage.
struct CellTransfer {
  CellVoltages cell_voltage_uV{};
  CellMask arrived = 0;
  CellMask measured = 0;
};

class CellSampler {
 public:
  static constexpr Duration period = internal_bus::cell_sampling_period;
  static constexpr int samples_per_average = 10;

  enum class Step : std::uint8_t { sampled, average_complete };

  /// A cell that arrived damaged is skipped: the window continues, and its values age. One that arrived without a
  /// voltage (an open wire) has none from now on, and none in this window's average.
  constexpr Step add(const CellTransfer& sample, TimePoint now) {
    const auto with_voltage = static_cast<CellMask>(sample.arrived & sample.measured);
    const auto without = static_cast<CellMask>(sample.arrived & ~sample.measured);
    latest_.measured = static_cast<CellMask>((latest_.measured & ~without) | with_voltage);
    without_voltage_ = static_cast<CellMask>(without_voltage_ | without);
    for (std::size_t cell = 0; cell < mmu_cells_max; ++cell) {
      if (!has_cell(with_voltage, cell)) continue;
      latest_.cell_voltage_uV[cell] = sample.cell_voltage_uV[cell];
      latest_.taken_at[cell] = now;
      if (good_samples_[cell] == 0) first_at_[cell] = now;
      sum_uV_[cell] += sample.cell_voltage_uV[cell];
      ++good_samples_[cell];
    }
    if (++samples_ < samples_per_average) return Step::sampled;
    complete_average();
    return Step::average_complete;
  }

  [[nodiscard]] constexpr const CellReading& latest() const { return latest_; }
  [[nodiscard]] constexpr const CellReading& average() const { return average_; }
  /// The average without the cells that the last window did not renew.
  [[nodiscard]] constexpr CellReading renewed_average() const { return average_.only(renewed_); }

 private:
  constexpr void complete_average() {
    renewed_ = 0;
    average_.measured = static_cast<CellMask>(average_.measured & ~without_voltage_);
    for (std::size_t cell = 0; cell < mmu_cells_max; ++cell) {
      if (good_samples_[cell] == 0 || has_cell(without_voltage_, cell)) continue;
      average_.cell_voltage_uV[cell] = static_cast<std::int32_t>(divide_to_nearest(sum_uV_[cell], good_samples_[cell]));
      average_.taken_at[cell] = first_at_[cell];
      renewed_ = static_cast<CellMask>(renewed_ | cell_bit(cell));
    }
    average_.measured = static_cast<CellMask>(average_.measured | renewed_);
    sum_uV_ = {};
    good_samples_ = {};
    without_voltage_ = 0;
    samples_ = 0;
  }

  CellReading latest_;
  CellReading average_;
  CellMask renewed_ = 0;
  // Of the window in progress.
  std::array<std::int64_t, mmu_cells_max> sum_uV_{};
  std::array<std::uint8_t, mmu_cells_max> good_samples_{};
  std::array<TimePoint, mmu_cells_max> first_at_{};  // of these
  CellMask without_voltage_ = 0;
  int samples_ = 0;
};

}  // namespace bmu

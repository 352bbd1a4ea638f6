// Commanded balancing (MMU_CB): minutes for each cell, counted down while its switch is on.
//
// Switches go on at the marks of a 1 s schedule and off at once. A cell starts when its commanded minutes change: the
// same number said again while it runs does not prolong anything. When the time is over the number falls back to 0, so
// the same number is then a change again. Heat pauses: the switch is off, the time left stays.
//
// Balancing on the module's own account (MMU_IMB, MMU_AB) is another stage, to be put beside this one.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "mmu/periodic.hpp"
#include "mmu/sampling.hpp"

namespace bmu {

class CommandedBalancing {
 public:
  static constexpr Duration schedule = 1s;
  static constexpr std::uint8_t minutes_max = 5;
  static constexpr std::uint8_t keep_minutes = 7;
  using Minutes = std::array<std::uint8_t, mmu_cells_max>;

  explicit constexpr CommandedBalancing(TimePoint now) : switching_(now, schedule), updated_at_(now) {}

  /// Minutes of each cell, each 0 to 5 or `keep_minutes`.
  constexpr void command(const Minutes& minutes) {
    for (std::size_t cell = 0; cell < mmu_cells_max; ++cell) {
      if (minutes[cell] == keep_minutes || minutes[cell] == commanded_minutes_[cell]) continue;
      commanded_minutes_[cell] = minutes[cell];
      time_left_[cell] = std::chrono::minutes{minutes[cell]};
      if (minutes[cell] == 0) switch_off(cell);
    }
  }
  constexpr void stop(CellMask cells = first_cells(mmu_cells_max)) {
    for (std::size_t cell = 0; cell < mmu_cells_max; ++cell) {
      if (!has_cell(cells, cell)) continue;
      commanded_minutes_[cell] = 0;
      time_left_[cell] = Duration::zero();
      switch_off(cell);
    }
  }
  /// Once a tick.
  constexpr void update(TimePoint now, bool is_paused) {
    const Duration passed = now - updated_at_;
    updated_at_ = now;
    for (std::size_t cell = 0; cell < mmu_cells_max; ++cell) {
      if (!has_cell(switches_, cell)) continue;
      time_left_[cell] -= passed;
      if (time_left_[cell] <= Duration::zero()) stop(cell_bit(cell));
    }
    const bool may_switch_on = switching_.take(now) && !is_paused;
    if (is_paused) switches_ = 0;
    if (may_switch_on) switches_ = waiting();
  }

  [[nodiscard]] constexpr CellMask switches() const { return switches_; }
  [[nodiscard]] constexpr Duration longest_time_left() const {
    return *std::max_element(time_left_.begin(), time_left_.end());
  }

 private:
  constexpr void switch_off(std::size_t cell) { switches_ = static_cast<CellMask>(switches_ & ~cell_bit(cell)); }
  [[nodiscard]] constexpr CellMask waiting() const {
    CellMask cells = 0;
    for (std::size_t cell = 0; cell < mmu_cells_max; ++cell) {
      if (time_left_[cell] > Duration::zero()) cells = static_cast<CellMask>(cells | cell_bit(cell));
    }
    return cells;
  }

  Minutes commanded_minutes_{};
  std::array<Duration, mmu_cells_max> time_left_{};
  CellMask switches_ = 0;
  Periodic switching_;
  TimePoint updated_at_;
};

}  // namespace bmu

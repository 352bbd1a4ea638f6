// Switches of a module and their remaining times: minutes commanded for each cell (MMU_CB), or rounds of one minute
// started by the module itself (MMU_AB), counted down from the mark at which they begin.
//
// Switches go on at the marks of a 1 s schedule and off at once. A cell starts when its commanded minutes change: the
// same number sent again while it runs does not extend the time. When the time is over the number falls back to 0, so
// that the same number is then a change again. Heat pauses: the switch is off, and the time continues. Minutes
// therefore end at a fixed time after their start, and a command never takes effect long after it was sent.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "mmu/devices/periodic.hpp"
#include "mmu/devices/sampling.hpp"

namespace bmu {

class Balancing {
 public:
  static constexpr Duration schedule = 1s;
  static constexpr Duration round = 1min;
  static constexpr std::uint8_t minutes_max = 5;
  static constexpr std::uint8_t keep_minutes = 7;
  using Minutes = std::array<std::uint8_t, mmu_cells_max>;

  explicit constexpr Balancing(TimePoint now) : switching_(now, schedule), updated_at_(now) {}

  /// Minutes of each cell, each 0 to 5 or `keep_minutes`.
  constexpr void command(const Minutes& minutes) {
    for (std::size_t cell = 0; cell < mmu_cells_max; ++cell) {
      if (minutes[cell] == keep_minutes || minutes[cell] == commanded_minutes_[cell]) continue;
      commanded_minutes_[cell] = minutes[cell];
      time_left_[cell] = std::chrono::minutes{minutes[cell]};
      if (minutes[cell] == 0) end(cell);
    }
  }
  /// Starts a round of these cells, which have no time left. A round is no command: any commanded minutes are a change.
  constexpr void start_round(CellMask cells) {
    for (std::size_t cell = 0; cell < mmu_cells_max; ++cell) {
      if (has_cell(cells, cell)) time_left_[cell] = round;
    }
    is_round_ = true;
  }
  constexpr void stop_round() {
    if (is_round_) stop();
    is_round_ = false;
  }
  constexpr void stop(CellMask cells = first_cells(mmu_cells_max)) {
    for (std::size_t cell = 0; cell < mmu_cells_max; ++cell) {
      if (!has_cell(cells, cell)) continue;
      commanded_minutes_[cell] = 0;
      time_left_[cell] = Duration::zero();
      end(cell);
    }
  }
  /// Once per tick.
  constexpr void update(TimePoint now, bool is_paused) {
    const Duration passed = now - updated_at_;
    updated_at_ = now;
    for (std::size_t cell = 0; cell < mmu_cells_max; ++cell) {
      if (!has_cell(running_, cell)) continue;
      time_left_[cell] -= passed;
      if (time_left_[cell] <= Duration::zero()) stop(cell_bit(cell));
    }
    if (is_paused) switches_ = 0;
    if (switching_.take(now)) {
      running_ = waiting();
      if (!is_paused) switches_ = running_;
    }
    is_round_ = is_round_ && has_work();
  }

  [[nodiscard]] constexpr CellMask switches() const { return switches_; }
  /// Whether a round is running.
  [[nodiscard]] constexpr bool is_round() const { return is_round_; }
  /// Whether some cell has time left, with its switch on or paused.
  [[nodiscard]] constexpr bool has_work() const { return waiting() != 0; }
  [[nodiscard]] constexpr Duration longest_time_left() const {
    return *std::max_element(time_left_.begin(), time_left_.end());
  }

 private:
  constexpr void end(std::size_t cell) {
    running_ = static_cast<CellMask>(running_ & ~cell_bit(cell));
    switches_ = static_cast<CellMask>(switches_ & ~cell_bit(cell));
  }
  [[nodiscard]] constexpr CellMask waiting() const {
    CellMask cells = 0;
    for (std::size_t cell = 0; cell < mmu_cells_max; ++cell) {
      if (time_left_[cell] > Duration::zero()) cells = static_cast<CellMask>(cells | cell_bit(cell));
    }
    return cells;
  }

  Minutes commanded_minutes_{};
  std::array<Duration, mmu_cells_max> time_left_{};
  CellMask running_ = 0;   // their time elapses
  CellMask switches_ = 0;  // of those, not paused
  bool is_round_ = false;  // the running times were started by start_round
  Periodic switching_;
  TimePoint updated_at_;
};

}  // namespace bmu

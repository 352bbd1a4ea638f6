// Cell voltages that stand still, to the last digit, although they cannot have: a front end or a module that repeats
// itself looks healthier than any real cell.
//
// For each cell the time is summed up for which its value has been the same while 5 mV of difference were due, fifty
// digits of the wire. They are due by the current, if it is another than when this value first came, by so much that
// the cell's resistance alone makes 5 mV of it; or by the charge that has flowed since, if it moves the open-circuit
// voltage by 5 mV even on the flattest stretch of the cell's curve: that holds at a steady current, too, and needs no
// state of charge, which a stuck pack would have started wrong. So blindness is bounded by physics:
//
//   cell at a steady current       5 mV are due after               with the 8 s of the limit
//   NMC 30 Ah (demo, traction)     1.2 % of the capacity, 0.36 Ah   at 40 A: 41 s, at 10 A: 138 s
//   LFP 100 Ah                     11.3 %, in the flat middle       at 100 A: 6.9 minutes
//
// Where the two work against each other nothing is due unless one outweighs the other at its worst: a charger that
// holds its voltage keeps every cell where it is, while the current falls and the charge rises.
//
// At which current a value was measured is known no better than its time is: a module may have sampled it up to a poll
// cycle away from that, and the current sensor averages. So a sample within a poll cycle of a step of the current,
// before it or behind it, is no reference for one current: the first sample of a value stands for all currents around
// it. A later one around which the current has moved less is the better reference, and counts beside it, once what came
// behind it is known: a module that sticks in the moment of a step is found by the next.
//
// The first other digit ends it. In a rest a cell may stand still for as long as it likes, and so it may while no more
// flows than a module bleeds off a cell to balance it: 0.5 A are not counted.
#pragma once

#include <array>
#include <cstdint>

#include "daemon/core/measurement/current_window.hpp"
#include "daemon/core/measurement/module_table.hpp"
#include "daemon/core/types/fault_reading.hpp"
#include "protocol/fields.hpp"

namespace bmu {

class StuckWatch {
 public:
  void init(const CoreConfig& config);
  /// Once a tick: takes over the cell values that have come since, and counts the charge. `current_mA` as known now,
  /// `window` what it was before.
  void update(const ModuleTable& modules, const Measured<std::int32_t>& current_mA, const CurrentWindow& window);
  void forget();

  /// The longest of these times, in ms.
  [[nodiscard]] Reading longest_ms(const ModuleTable& modules) const;
  /// What has to flow before a steady current proves anything; 0: the curve does not say.
  [[nodiscard]] std::int64_t charge_shown_uAs() const { return flowed_min_uAs_; }

 private:
  /// A sample of a value that stands still: what flowed around it, and had flowed until then.
  struct Reference {
    CurrentRange current_mA;
    std::int64_t charge_uAs = 0;

    [[nodiscard]] constexpr std::int64_t width_mA() const {
      return std::int64_t{current_mA.max_mA} - current_mA.min_mA;
    }
  };
  struct Cell {
    std::int32_t voltage_uV = 0;
    Reference first;      // when this value first came
    Reference steadiest;  // of all its samples
    TimePoint first_at{};
    bool is_first_settled = false;  // all that flowed around it is known
    Reference next;                 // a later sample, until all that flowed around it is known
    TimePoint next_at{};            // zero: there is none
    TimePoint taken_at{};           // of the latest sample
    Duration stuck_for{};
  };

  void count(const Measured<std::int32_t>& current_mA);
  void take(Cell& cell, const Measured<std::int32_t>& voltage_uV, std::int32_t current_mA,
            const CurrentWindow& window) const;
  void settle_references(Cell& cell, TimePoint taken_at, std::int32_t current_mA, const CurrentWindow& window) const;
  [[nodiscard]] CurrentRange currents_around(TimePoint taken_at, std::int32_t current_mA,
                                             const CurrentWindow& window) const;
  [[nodiscard]] bool must_have_moved(const Reference& since, std::int32_t current_mA) const;

  std::array<std::array<Cell, internal_bus::cells_per_module_max>, modules_max> cells_{};
  CellModel model_;
  Duration sampled_within_{};             // the current that a sample belongs to flowed within this of its time
  std::int64_t resistance_uOhm_ = 0;      // 0: not known, and no step shows
  std::int64_t resistance_max_uOhm_ = 0;  // of a cold or worn cell, relaxed
  std::int64_t flowed_min_uAs_ = 0;       // 0: nothing is due by charge
  std::int64_t charge_uAs_ = 0;           // out of the pack, in all
  TimePoint counted_at_{};
  BMU_FIELDS(cells_, skipped(model_), skipped(sampled_within_), skipped(resistance_uOhm_),
             skipped(resistance_max_uOhm_), skipped(flowed_min_uAs_), charge_uAs_, counted_at_)
};

}  // namespace bmu

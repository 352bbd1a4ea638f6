// Monitor of cell voltages that are constant to the last digit although they should have changed: a front end or a
// module that repeats values looks healthier than any real cell.
//
// For each cell it sums the time during which its value was constant while a change of 5 mV was due, fifty digits on
// the wire. The change is due by the current, if that differs from the current at the first sample of this value by so
// much that the cell's resistance alone causes 5 mV; or by the charge since then, if it changes the open-circuit
// voltage by 5 mV even in the flattest section of the cell's curve: that applies at a steady current, too, and needs no
// SOC, which a stuck pack would have initialised wrongly. So physics bounds the detection time:
//
//   cell at a steady current       5 mV are due after               with the 8 s of the limit
//   NMC 30 Ah (demo, traction)     1.2 % of the capacity, 0.36 Ah   at 40 A: 41 s, at 10 A: 138 s
//   LFP 100 Ah                     11.3 %, in the flat middle       at 100 A: 6.9 minutes
//
// If the two have opposite signs, no change is due unless one exceeds the other in the worst case: a charger at
// constant voltage keeps every cell constant while the current falls and the charge rises.
//
// The current at which a value was measured is only known as well as its time: a module may have sampled it up to a
// poll cycle earlier or later, and the current sensor averages. So a sample within a poll cycle before or after a
// current step is not a reference for one current: the first sample of a value stands for all currents around it. A
// later sample with a smaller range of currents around it is the better reference, and is used as well, once the
// currents after it are known: a module that sticks at the instant of a current step is detected by the next step.
//
// The first changed digit ends it. At rest a cell may be constant indefinitely, and so it may while the current is no
// more than a module bleeds off a cell to balance it: up to 0.5 A are not counted.
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
  /// Once a tick: handles the cell values received since the last call, and counts the charge. `current_mA` is the
  /// present current, `window` the previous ones.
  void update(const ModuleTable& modules, const Measured<std::int32_t>& current_mA, const CurrentWindow& window);
  void forget();

  /// The longest of these times, in ms.
  [[nodiscard]] Reading longest_ms(const ModuleTable& modules) const;
  /// Charge after which a steady current is evidence; 0: the curve does not define one.
  [[nodiscard]] std::int64_t charge_shown_uAs() const { return flowed_min_uAs_; }

 private:
  /// A sample of a constant value: the currents around it, and the charge until then.
  struct Reference {
    CurrentRange current_mA;
    std::int64_t charge_uAs = 0;

    [[nodiscard]] constexpr std::int64_t width_mA() const {
      return std::int64_t{current_mA.max_mA} - current_mA.min_mA;
    }
  };
  struct Cell {
    std::int32_t voltage_uV = 0;
    Reference first;      // first sample of this value
    Reference steadiest;  // of all its samples
    TimePoint first_at{};
    bool is_first_settled = false;  // all currents around it are known
    Reference next;                 // a later sample, until all currents around it are known
    TimePoint next_at{};            // zero: none
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
  Duration sampled_within_{};             // maximum time between a sample and its current
  std::int64_t resistance_uOhm_ = 0;      // 0: unknown, a current step is no evidence
  std::int64_t resistance_max_uOhm_ = 0;  // of a cold or worn cell, relaxed
  std::int64_t flowed_min_uAs_ = 0;       // 0: no change is due by charge
  std::int64_t charge_uAs_ = 0;           // out of the pack, total
  TimePoint counted_at_{};
  BMU_FIELDS(cells_, skipped(model_), skipped(sampled_within_), skipped(resistance_uOhm_),
             skipped(resistance_max_uOhm_), skipped(flowed_min_uAs_), charge_uAs_, counted_at_)
};

}  // namespace bmu

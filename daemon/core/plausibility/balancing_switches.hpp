// Monitor of the modules' balancing switches, as they report them, against the commands: bled charge, and mismatches.
//
//   commanded on    on from the module's "done" for its minutes; it may start within a second, and its clock may be two
//                   percent slow. Finished when the switch is off again at the end of that time, or stays off after
//                   half of it: a fast clock is no fault.
//   otherwise       off, from the first report of a module on, in any mode or with any supply that it reports, and also
//                   where the module has no cell: a module that is polled must follow the commands, also one that may
//                   balance autonomously without master
//
// Where modules decide which cells they bleed (devices/module_driver.hpp) any switch may be on while they are commanded
// a target voltage, and none otherwise.
//
// A switch that is read in the wrong state for `obey_max` is a mismatch. One that is stuck on drains its cell and warms
// its board permanently; one that does not come on only leaves its cell as it is, and is recorded until it is seen on.
// A switch that is off is no mismatch while its module pauses because its board is hot, is powered by its own cells, or
// is not in mode normal.
//
// The charge that a cell has lost is the sum, over its reads with the switch on, of voltage / resistance * time, with
// the voltage at the resistor as the module measures it. A gap of more than a second is not bridged: a module stops
// when it is not polled.
//
// Cost: a comparison a module without a new report, a pass over its 12 cells with one.
#pragma once

#include <array>
#include <cstdint>

#include "daemon/core/measurement/module_table.hpp"
#include "daemon/core/types/core_config.hpp"
#include "daemon/core/types/fault_reading.hpp"
#include "protocol/fields.hpp"

namespace bmu {

/// Three of the one-second marks at which a module switches.
inline constexpr Duration obey_max = 3s;

using BalancingMinutes = std::array<std::uint8_t, internal_bus::cells_per_module_max>;

class BalancingSwitches {
 public:
  void init(const CoreConfig& config);
  /// Once a tick, before any query: handles the MODULE frames received since the last call.
  void update(const ModuleTable& modules);
  /// Discards commands and reports after an interruption of the core (stall, bus down, sleep). The sums are kept.
  void forget();

  /// A module has answered "done" to these minutes.
  void note_told(std::size_t module_index, const BalancingMinutes& minutes, TimePoint now);
  /// Every module may bleed the cells above the target voltage, until note_all_stopped.
  void note_free();
  /// A module, or all, was commanded to stop.
  void note_stopped(std::size_t module_index);
  void note_all_stopped();

  /// The last report of every module has all switches off, and was taken after `since`.
  [[nodiscard]] bool are_all_off(TimePoint since) const;
  /// At least one switch is on in the last reports, commanded or not.
  [[nodiscard]] bool is_any_on() const;
  /// At least one module is commanded to bleed.
  [[nodiscard]] bool is_any_told() const;
  /// A switch of this module is on without a command.
  [[nodiscard]] bool has_unwanted(std::size_t module_index) const { return unwanted(module_index) != 0; }
  /// Mask of these switches; also of cells that the module does not have.
  [[nodiscard]] std::uint16_t unwanted(std::size_t module_index) const { return slots_[module_index].unwanted(); }
  /// A cell by its number in its module, from 0; the pack number of a cell that does not exist is 0.
  [[nodiscard]] Element element_of(std::size_t module_index, std::size_t cell) const;
  /// Commanded minutes of a cell that has not finished; 0: none.
  [[nodiscard]] std::uint8_t minutes_told(std::size_t module_index, std::size_t cell) const;
  [[nodiscard]] std::uint16_t on(std::size_t module_index) const { return slots_[module_index].on; }

  /// Bled charge by pack number, from 0; since the start.
  [[nodiscard]] std::int64_t bled_uAs(std::size_t cell) const { return bled_uAs_[cell]; }
  [[nodiscard]] const std::int64_t* bled_uAs() const { return bled_uAs_.data(); }
  /// Index of the first cell of a module in the pack.
  [[nodiscard]] std::size_t first_cell(std::size_t module_index) const { return slots_[module_index].first_cell; }

  /// 1 and the element, for a switch that is stuck on, or does not come on; else 0.
  [[nodiscard]] Reading stays_on() const;
  [[nodiscard]] Reading stays_off() const;

 private:
  struct Slot {
    std::uint8_t node = 0;
    std::uint8_t cell_count = 0;
    std::uint16_t first_cell = 0;
    TimePoint read_at{};        // the last report of its switches; zero: none is valid
    std::uint16_t on = 0;       // in that report
    bool obeys = false;         // as reported: in mode normal, and not powered by its own cells
    std::uint16_t told = 0;     // cells with a switch that must be on
    std::uint16_t ending = 0;   // cells with a switch in either state: their time is over, or nearly
    std::uint16_t came_on = 0;  // were on at least once since the command
    std::uint16_t dead = 0;     // did not come on when commanded
    TimePoint told_at{};
    BalancingMinutes minutes{};
    std::array<TimePoint, internal_bus::cells_per_module_max> wrong_since{};  // zero: no mismatch

    [[nodiscard]] std::uint16_t unwanted() const { return static_cast<std::uint16_t>(on & ~told & ~ending); }
    BMU_FIELDS(skipped(node), skipped(cell_count), skipped(first_cell), read_at, on, obeys, told, ending, came_on, dead,
               told_at, minutes, wrong_since)
  };

  void take(Slot& slot, const ModuleRecord& module);
  void count(const Slot& slot, const ModuleRecord& module, TimePoint at);
  static void follow_time(Slot& slot, TimePoint at);
  static void judge(Slot& slot, TimePoint at, bool is_hot);
  template <class Cells>
  [[nodiscard]] Reading first_cell_of(Cells cells) const;

  std::size_t module_count_ = 0;
  std::int32_t resistance_Ohm_ = 1;
  bool are_free_ = false;
  std::array<Slot, modules_max> slots_{};
  std::array<std::int64_t, cells_max> bled_uAs_{};
  std::array<std::int32_t, cells_max> rests_{};  // remainders below 1 uAs, in uV/Ohm * ns
  BMU_FIELDS(skipped(module_count_), skipped(resistance_Ohm_), are_free_, slots_, bled_uAs_, rests_)
};

}  // namespace bmu

// The modules' balancing switches as they say themselves, against what they were told: what is bled, and who disobeys.
//
//   told to bleed   on from the module's "done" for its minutes; it may begin within a second, and its clock may go
//                   two percent late. Over when the switch is off again in the end of that time, or stays off after
//                   half of it: a clock that goes fast is no fault.
//   otherwise       off, from the first word of a module on, whatever mode or supply it claims, and also where the
//                   module has no cell: a module that is polled has to obey, also one that may balance by itself
//                   when it is left alone
//
// Where modules decide by themselves which cells they bleed (devices/module_driver.hpp) any switch may be on while they
// are told a target, and none otherwise.
//
// A switch that is read as it should not be for `obey_max` disobeys. One that stays on drains its cell and warms its
// board for ever; one that does not come on only leaves its cell as it is, and is remembered until it is seen on. A
// switch that is off disobeys nobody while its module pauses because its board is hot, lives on its own cells, or is
// not in its normal mode.
//
// What a cell has lost is the sum over its reads with the switch on of its voltage / resistance * time, V at the
// resistor as the module measures it. A gap of more than a second is not bridged: a module stops when nobody polls it.
//
// Cost: a comparison a module while nothing new has come, a pass over its 12 cells when it has.
#pragma once

#include <array>
#include <cstdint>

#include "daemon/core/measurement/module_table.hpp"
#include "daemon/core/types/core_config.hpp"
#include "daemon/core/types/fault_reading.hpp"
#include "protocol/fields.hpp"

namespace bmu {

/// Three of a module's marks of one second, at which it switches.
inline constexpr Duration obey_max = 3s;

using BalancingMinutes = std::array<std::uint8_t, internal_bus::cells_per_module_max>;

class BalancingSwitches {
 public:
  void init(const CoreConfig& config);
  /// Once a tick, before anybody asks: takes over the MODULE frames that have come since.
  void update(const ModuleTable& modules);
  /// What modules were told counts no longer, nor what they said: after a gap in our own life. Sums stay.
  void forget();

  /// A module has answered "done" to these minutes.
  void note_told(std::size_t module_index, const BalancingMinutes& minutes, TimePoint now);
  /// Every module may bleed what it finds too high, until note_all_stopped.
  void note_free();
  /// A module, or all, was told to stop.
  void note_stopped(std::size_t module_index);
  void note_all_stopped();

  /// The last word of every module is that all its switches are off, and it was taken after `since`.
  [[nodiscard]] bool are_all_off(TimePoint since) const;
  /// Some switch is on by the last word, whoever wanted it.
  [[nodiscard]] bool is_any_on() const;
  /// Some module is still to bleed.
  [[nodiscard]] bool is_any_told() const;
  /// A switch of this module is on that was not told to be.
  [[nodiscard]] bool has_unwanted(std::size_t module_index) const { return unwanted(module_index) != 0; }
  /// Which; also of cells the module does not have.
  [[nodiscard]] std::uint16_t unwanted(std::size_t module_index) const { return slots_[module_index].unwanted(); }
  /// A cell by its number in its module, from 0; one that is not there has no number through the pack.
  [[nodiscard]] Element element_of(std::size_t module_index, std::size_t cell) const;
  /// Minutes a cell was told for and has not yet done; 0: none.
  [[nodiscard]] std::uint8_t minutes_told(std::size_t module_index, std::size_t cell) const;
  [[nodiscard]] std::uint16_t on(std::size_t module_index) const { return slots_[module_index].on; }

  /// By number through the pack, from 0; since the start.
  [[nodiscard]] std::int64_t bled_uAs(std::size_t cell) const { return bled_uAs_[cell]; }
  [[nodiscard]] const std::int64_t* bled_uAs() const { return bled_uAs_.data(); }
  /// Where the first cell of a module stands in the pack.
  [[nodiscard]] std::size_t first_cell(std::size_t module_index) const { return slots_[module_index].first_cell; }

  /// 1 and where, for a switch that stays on, or does not come on; else 0.
  [[nodiscard]] Reading stays_on() const;
  [[nodiscard]] Reading stays_off() const;

 private:
  struct Slot {
    std::uint8_t node = 0;
    std::uint8_t cell_count = 0;
    std::uint16_t first_cell = 0;
    TimePoint read_at{};        // the last word of its switches; zero: none counts
    std::uint16_t on = 0;       // then
    bool obeys = false;         // as far as it says: in its normal mode, and not on its own cells
    std::uint16_t told = 0;     // cells whose switch has to be on
    std::uint16_t ending = 0;   // cells whose switch may be either: their time is over, or nearly
    std::uint16_t came_on = 0;  // were on at some time since they were told
    std::uint16_t dead = 0;     // did not come on when it was told to
    TimePoint told_at{};
    BalancingMinutes minutes{};
    std::array<TimePoint, internal_bus::cells_per_module_max> wrong_since{};  // zero: it is as it should be

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
  std::array<std::int32_t, cells_max> rests_{};  // uV/Ohm * ns, not yet a whole uAs: below a second's uA
  BMU_FIELDS(skipped(module_count_), skipped(resistance_Ohm_), are_free_, slots_, bled_uAs_, rests_)
};

}  // namespace bmu

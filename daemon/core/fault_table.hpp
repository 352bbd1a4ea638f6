// Every fault the daemon knows: what it watches, how long it must last, what it does, how it goes away. Rows, no code.
//
// A row's `read` gives the one number it judges and where it comes from; the threshold is in the configuration, or 1
// for rows that are simply true or not. The same table prints the faults page and drives the tests all faults inherit.
//
//   reaction            what a confirmed fault does
//   warn                nothing but being told
//   open_after_grace    limits go to zero at once; permission goes when the current has fallen or the grace is over
//   open_now            permission goes in the same tick
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "daemon/core/core_config.hpp"
#include "daemon/core/pack_state.hpp"

namespace bmu {

enum class FaultId : std::uint8_t {
  cell_undervoltage,
  cell_overvoltage,
  cell_overtemperature,
  cell_undertemperature,
  discharge_overcurrent,
  charge_overcurrent,
  pack_voltage_mismatch,
  module_lost,
  cell_not_measured,
  temperature_not_measured,
  module_reports_fault,
  module_warning,
  module_mismatch,
  current_sensor_lost,
  voltage_sensor_lost,
  pdu_lost,
  pdu_opened_by_itself,
  emergency_stop,
  interlock_open,
  insulation_fault,
  precharge_failed,
  contactor_feedback,
  link_not_following,
  foreign_master,
  internal_bus_down,
  command_not_on_bus,
  control_loop_gap,
  frames_lost,
};
inline constexpr std::size_t fault_count = 28;

enum class Reaction : std::uint8_t { warn, open_after_grace, open_now };
enum class Latch : std::uint8_t {
  none,           // gone when its cause has been gone long enough
  until_cleared,  // needs a clear command on top, and only then
};
enum class Sense : std::uint8_t { at_or_above, at_or_below };

[[nodiscard]] std::string_view to_text(Reaction reaction);
[[nodiscard]] std::string_view to_text(Latch latch);

/// What a row judges: one number, where it comes from, how old it is.
struct Reading {
  bool is_known = false;  // unknown neither raises nor clears
  std::int64_t value = 0;
  Element element;
  TimePoint taken_at{};
  bool is_partial = false;  // something this row watches is missing: bad news counts, good news does not
};

/// Conditions that are not measurements, kept by the core between ticks.
struct CoreFlags {
  bool precharge_failed = false;
  bool foreign_master_seen = false;
  bool internal_bus_up = false;
  bool loop_gap_seen = false;
  bool frames_lost_seen = false;
  bool contactors_disobey = false;    // contactor_watch
  bool closing_is_commanded = false;  // some contactor, in the last command
  bool pdu_restarted = false;         // its counter does not go on where it was
  TimePoint closed_since{};           // the sequence stands at closed; zero: it does not
  bool command_not_on_bus = false;    // our own commands have not been seen on the bus for too long
};

/// All that rows may look at.
struct FaultInputs {
  TimePoint now{};
  const CoreConfig* config = nullptr;
  const PackState* pack = nullptr;
  const ModuleTable* modules = nullptr;
  const SensorTable* sensors = nullptr;
  CoreFlags flags;
  bool has_started = false;  // first complete view seen, or the time to get one is over: "not yet" is not "lost"
};

struct FaultRow {
  FaultId id;
  std::string_view name;     // stable, for machines
  std::string_view meaning;  // for people
  Unit unit = Unit::none;
  Sense sense = Sense::at_or_above;
  Reading (*read)(const FaultInputs&) = nullptr;
  LimitConfig LimitsConfig::*limit = nullptr;  // null: true or not, threshold 1
  Duration confirm{};                          // where there is no limit in the configuration
  Duration clear = 1s;
  std::uint8_t samples = 1;  // distinct samples beyond the threshold that it takes; 1: time alone decides
  Reaction reaction = Reaction::open_now;
  Duration grace{};  // exactly for open_after_grace
  Latch latch = Latch::none;
  std::uint8_t dtc = 0;  // trouble code in 622h, 0 none
};

/// In the order of FaultId.
[[nodiscard]] const std::array<FaultRow, fault_count>& fault_table();
[[nodiscard]] const FaultRow& row_of(FaultId id);

}  // namespace bmu

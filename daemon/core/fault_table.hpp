// Every fault the daemon knows: what it watches, how long it must last, what it does, how it goes away. Rows, no code.
//
// A row's `read` (fault_readers.hpp) gives the one number it judges and where it comes from; the threshold is in the
// configuration, or 1 for rows that are simply true or not. The same table prints the faults page
// (docs/faults.md) and drives the tests all faults inherit.
//
//   reaction            how bad it is, and so what a confirmed fault does
//   warn                nothing but being told
//   refuse_close        a closed pack stays closed, an open one stays open
//   open_after_grace    limits go to zero at once; permission goes when the current has fallen or the grace is over
//   open_now            permission goes in the same tick
//
//   concerns            which current it forbids
//   all                 any: the main contactors open
//   charge              charging: the charge contactor opens; the main contactors too when nothing but a charger asks
//   discharge           discharging: the main contactors open, but a charger may close them again (BMS_F.10)
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "daemon/core/charger_watch.hpp"
#include "daemon/core/core_config.hpp"
#include "daemon/core/fault_reading.hpp"
#include "daemon/core/inverter_watch.hpp"
#include "daemon/core/observation.hpp"
#include "daemon/core/pack_state.hpp"
#include "daemon/core/second_pack.hpp"
#include "daemon/core/watchers.hpp"

namespace bmu {

enum class FaultId : std::uint8_t {
  // cells
  cell_undervoltage,
  cell_overvoltage,
  cell_deep_discharge,
  cell_imbalance,
  cell_resistance,
  pack_resistance,
  // temperatures
  cell_overtemperature,
  cell_undertemperature,
  charge_overtemperature,
  charge_undertemperature,
  board_overtemperature,
  board_undertemperature,
  temperature_rise,
  temperature_spread,
  // current
  discharge_overcurrent,
  charge_overcurrent,
  discharge_overload,
  charge_overload,
  discharge_not_allowed,
  charge_not_allowed,
  current_while_open,
  // one measurement against another
  pack_voltage_mismatch,
  module_voltage_mismatch,
  stuck_values,
  current_contradicts_voltage,
  current_sensors_disagree,
  soc_methods_disagree,
  cell_model_mismatch,
  // modules
  module_lost,
  cell_not_measured,
  temperature_not_measured,
  open_wire,
  module_disturbed,
  module_reports_fault,
  module_reports_undervoltage,
  module_warning,
  module_starting,
  module_going_to_sleep,
  module_alone,
  balancing_stays_on,
  balancing_stays_off,
  balancing_refused,
  module_mismatch,
  wrong_cell_count,
  module_exchanged,
  modules_swapped,
  module_not_set_up,
  duplicate_node,
  unknown_module,
  // sensor, power distribution unit, inputs
  current_sensor_lost,
  voltage_sensor_lost,
  sensor_not_set_up,
  pdu_lost,
  pdu_opened_by_itself,
  emergency_stop,
  interlock_open,
  supply_low,
  lines_failed,
  // insulation
  insulation_fault,
  insulation_low,
  insulation_low_driving,
  insulation_monitor_lost,
  insulation_monitor_untested,
  // contactors
  precharge_failed,
  precharge_too_fast,
  precharge_overcurrent,
  contactor_feedback,
  contactor_welded,
  link_not_following,
  link_not_discharging,
  // chargers
  charger_silent,
  charger_runaway,
  charger_keeps_on,
  charger_trouble,
  charger_contradicts,
  foreign_charger_master,
  foreign_charger_commands,
  // inverters
  inverter_silent,
  inverter_lost,
  inverter_trouble,
  foreign_battery,
  // buses
  foreign_master,
  foreign_reporter,
  second_pack_silent,
  internal_bus_down,
  bus_off_storm,
  bus_error_passive,
  command_not_on_bus,
  frames_lost,
  // the daemon itself
  control_loop_gap,
  tick_overrun,
  store_unreadable,
  store_write_failed,
  history_write_failed,
  clock_jump,
  memory_low,
  disk_low,
  // modules and their unit, second part
  front_end_supply_low,
  front_end_overtemperature,
  front_end_faults_missing,
  module_supply_lost,
  alarm_loop_open,
};
inline constexpr std::size_t fault_count = 102;
static_assert(fault_count <= stricter_reactions_max);

enum class Reaction : std::uint8_t { warn, refuse_close, open_after_grace, open_now };
enum class Latch : std::uint8_t {
  none,              // gone when its cause has been gone long enough
  until_cleared,     // needs a clear command on top, and only then
  until_authorised,  // needs the clear command of somebody who may: the pack has to be looked at first
};
/// Whether a latch outlives the daemon.
enum class Outlives : std::uint8_t {
  always,
  if_closed,  // what is also seen when modules, sensors and monitor lose their supply: only if the pack was closed and
              // nobody had told the daemon to end. What lasts is found again after a start.
};
enum class Concerns : std::uint8_t { all, charge, discharge };
enum class Sense : std::uint8_t { at_or_above, at_or_below };
/// What a module is asked again for, at once and alone, while a value of it is suspected.
enum class AskAgain : std::uint8_t { no, cells, temperatures };

[[nodiscard]] std::string_view to_text(Reaction reaction);
[[nodiscard]] std::string_view to_text(Latch latch);
[[nodiscard]] std::string_view to_text(Concerns concerns);

/// How a closing ended that did not succeed.
enum class PrechargeFailure : std::uint8_t {
  none,
  too_slow,
  too_fast,
  overcurrent,
  welded,  // before the precharge: the link follows with main negative alone
};

/// Conditions that are not measurements, kept by the core between ticks.
struct CoreFlags {
  PrechargeFailure precharge_failure = PrechargeFailure::none;
  bool foreign_master_seen = false;
  bool internal_bus_up = false;
  bool loop_gap_seen = false;
  bool tick_was_late = false;
  bool frames_lost_seen = false;
  std::uint8_t contactor_not_following = 0;  // 1 + ContactorId; contactor_watch
  std::uint8_t contactor_welded = 0;         // 1 + ContactorId
  bool closing_is_commanded = false;         // some contactor, in the last command
  bool pdu_restarted = false;                // its counter does not go on where it was
  TimePoint closed_since{};                  // the sequence stands at closed; zero: it does not
  TimePoint open_since{};                    // nothing is commanded closed; zero: something is
  TimePoint charge_forbidden_since{};        // while closed; zero: it is allowed
  TimePoint discharge_forbidden_since{};
  bool is_driving = false;             // closed for the vehicle
  bool command_not_on_bus = false;     // our own commands have not been seen on the bus for too long
  bool lines_failed = false;           // the GPIO lines of this machine
  bool sensor_not_set_up = false;      // the current sensor's settings are not what is wanted, or it does not tell them
  bool insulation_untested = false;    // the monitor on a bus tells values and has not tested itself
  std::uint8_t module_not_set_up = 0;  // node of the first that has not taken our limits
  std::uint8_t balancing_refused = 0;  // node of the first that refused its minutes or did not answer
  bool clock_jumped = false;           // the wall clock against the monotonic one, since the last tick
  OwnHealth health;
};

/// All that rows may look at.
struct FaultInputs {
  TimePoint now{};
  const CoreConfig* config = nullptr;
  const PackState* pack = nullptr;
  const ModuleTable* modules = nullptr;
  const SensorTable* sensors = nullptr;
  const Watchers* watchers = nullptr;
  Reading soc_disagreement_permille;  // of the cell with most of it; 1000: as far as the methods allow (PackEstimate)
  Reading cell_misfit_permille;       // 1000: it is none of its model's
  CoreFlags flags;
  const SecondPack* second_pack = nullptr;
  const ChargerTable* chargers = nullptr;
  const ChargerWatch* charger_watch = nullptr;  // with a charger table, or not at all
  const InverterWatch* inverter = nullptr;
  bool has_started = false;  // first complete view seen, or the time to get one is over: "not yet" is not "lost"
};

struct FaultRow {
  FaultId id;
  std::string_view name;     // stable, for machines
  std::string_view meaning;  // for people
  std::string_view remedy;   // what they may do
  Unit unit = Unit::none;
  Sense sense = Sense::at_or_above;
  Reading (*read)(const FaultInputs&) = nullptr;
  LimitConfig LimitsConfig::*limit = nullptr;      // from the configuration; without: true or not, threshold 1
  Duration ConfirmTimes::*confirm_time = nullptr;  // where there is no limit, from the configuration ...
  Duration confirm{};                              // ... or the same for every pack
  Duration clear = 1s;
  std::uint8_t samples = 1;  // distinct samples beyond the threshold that it takes; 1: time alone decides
  /// A warning takes as much evidence as the fault. For readings that compare samples of different instants: a step of
  /// the load moves one sample and not the other, and such a reading is too high until the current of the step arrives.
  bool confirms_warning = false;
  AskAgain ask_again = AskAgain::no;
  Reaction reaction = Reaction::open_now;
  Duration grace{};  // exactly for open_after_grace
  /// With Reaction::open_now: opens only when the current is no more than the contactors break, `break_wait_max` after
  /// its confirmation at the latest (permission.hpp), where the pack file has their rating. Set for the faults that a
  /// short causes: of current, of cell, module and link voltages, and of temperatures that rise with the current.
  bool waits_above_rating = false;
  Latch latch = Latch::none;
  Outlives outlives = Outlives::always;  // for what latches
  Concerns concerns = Concerns::all;
  /// While a charger is plugged in nobody closes, whomever the fault concerns: it is the charger that would be
  /// connected.
  bool bars_while_plugged_in = false;
  std::uint8_t dtc = 0;  // trouble code in 622h, dialect iha: 1 poor cell, 2 poor battery, 3 too cold to charge
  std::uint8_t lithiumate_code = 0;  // stored fault code of the dialect elithion, 0 none

  /// Judges a number against thresholds, not a mere condition.
  [[nodiscard]] constexpr bool has_limit() const { return limit != nullptr; }
};

/// Whether a fault concerns this direction of current, alone or with everything.
[[nodiscard]] constexpr bool is_about(const FaultRow& row, Concerns direction) {
  return row.concerns == Concerns::all || row.concerns == direction;
}

/// In the order of FaultId.
[[nodiscard]] const std::array<FaultRow, fault_count>& fault_table();
[[nodiscard]] const FaultRow& row_of(FaultId id);

/// What a confirmed fault does to a pack.
struct FaultReaction {
  Reaction reaction = Reaction::open_now;
  Duration grace{};          // exactly for open_after_grace
  bool is_stricter = false;  // by the pack file
};
/// The row's own reaction, or the stricter one of the pack file.
[[nodiscard]] FaultReaction reaction_of(const FaultRow& row, const StricterReactions& stricter);

/// The strictest reaction that a pack file may give the row. One sample alone opens nothing: a limit that is judged by
/// one at most refuses to close.
[[nodiscard]] Reaction strictest_reaction(const FaultRow& row);

}  // namespace bmu

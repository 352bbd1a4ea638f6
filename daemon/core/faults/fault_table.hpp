// Table of all faults: quantity, debounce time, reaction and clearing of each. Rows, no code.
//
// `read` of a row (fault_readers.hpp) returns the one number that is compared and its origin; the threshold is in the
// configuration, or 1 for rows with a true-or-false condition. The same table prints the faults page (docs/faults.md)
// and drives the tests common to all faults.
//
//   reaction            severity, and thus the effect of a confirmed fault
//   warn                reported only
//   refuse_close        a closed pack stays closed, an open one stays open
//   open_after_grace    limits go to zero immediately; permission ends when the current has fallen or the grace is over
//   open_now            permission ends in the same tick
//
//   concerns            the current that it inhibits
//   all                 any: the main contactors open
//   charge              charging: the charge contactor opens; the main contactors too if only a charger requests the
//                       pack to be closed
//   discharge           discharging: the main contactors open, but a charger may close them again (BMS_F.10)
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "daemon/core/measurement/inverter_watch.hpp"
#include "daemon/core/measurement/pack_state.hpp"
#include "daemon/core/measurement/second_pack.hpp"
#include "daemon/core/plausibility/charger_watch.hpp"
#include "daemon/core/plausibility/watchers.hpp"
#include "daemon/core/types/contactors.hpp"
#include "daemon/core/types/core_config.hpp"
#include "daemon/core/types/fault_reading.hpp"
#include "daemon/core/types/observation.hpp"

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
  // plausibility between measurements
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
  // modules and PDU, second part
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
  none,              // clears when its cause has been gone long enough
  until_cleared,     // also requires a clear command, effective only once the cause is gone
  until_authorised,  // requires an authorised clear: the pack has to be inspected first
};
/// Whether a latch persists over a restart of the daemon.
enum class Outlives : std::uint8_t {
  always,
  if_closed,  // for faults that also occur when modules, sensors and monitor lose their supply: only if the pack was
              // closed and the daemon not shutting down. A persisting cause is detected again after a start.
};
enum class Concerns : std::uint8_t { all, charge, discharge };
enum class Sense : std::uint8_t { at_or_above, at_or_below };
/// Values for which a module is repolled, immediately and by a single poll, while one of them is pending.
enum class AskAgain : std::uint8_t { no, cells, temperatures };

[[nodiscard]] std::string_view to_text(Reaction reaction);
[[nodiscard]] std::string_view to_text(Latch latch);
[[nodiscard]] std::string_view to_text(Concerns concerns);

/// Conditions that are not measurements, kept by the core between ticks.
struct CoreFlags {
  PrechargeFailure precharge_failure = PrechargeFailure::none;
  bool foreign_master_seen = false;
  bool internal_bus_up = false;
  bool loop_gap_seen = false;
  bool tick_was_late = false;
  bool frames_lost_seen = false;
  std::uint8_t contactor_not_following = 0;  // 1 + ContactorId, from contactor_watch; 0: none
  std::uint8_t contactor_welded = 0;         // 1 + ContactorId
  bool closing_is_commanded = false;         // some contactor, in the last command
  bool pdu_restarted = false;                // its counter is discontinuous
  TimePoint closed_since{};                  // the sequence is in phase closed; zero: it is not
  TimePoint open_since{};                    // no contactor is commanded closed; zero: at least one is
  TimePoint charge_forbidden_since{};        // while closed; zero: charging is allowed
  TimePoint discharge_forbidden_since{};
  bool is_driving = false;             // closed for the vehicle
  bool command_not_on_bus = false;     // contactor commands of this node have not been echoed for too long
  bool lines_failed = false;           // the GPIO lines of this host
  bool sensor_not_set_up = false;      // settings of the current sensor differ from the pack file, or are not reported
  bool insulation_untested = false;    // the insulation monitor on a bus reports values without a self-test
  std::uint8_t module_not_set_up = 0;  // node of the first module that has not acknowledged the cell limits
  std::uint8_t balancing_refused = 0;  // node of the first module that refused its command or did not respond
  bool clock_jumped = false;           // the wall clock against the monotonic one, since the last tick
  OwnHealth health;
};

/// All inputs of the fault readers.
struct FaultInputs {
  TimePoint now{};
  const CoreConfig* config = nullptr;
  const PackState* pack = nullptr;
  const ModuleTable* modules = nullptr;
  const SensorTable* sensors = nullptr;
  const Watchers* watchers = nullptr;
  Reading soc_disagreement_permille;  // of the worst cell; 1000: the combined uncertainty of two methods (PackEstimate)
  Reading cell_misfit_permille;       // of the worst cell; 1000: it does not match its cell model
  CoreFlags flags;
  const SecondPack* second_pack = nullptr;
  const ChargerTable* chargers = nullptr;
  const ChargerWatch* charger_watch = nullptr;  // set only together with a charger table
  const InverterWatch* inverter = nullptr;
  bool has_started = false;  // all data received once, or the start grace is over; until then nothing is lost
};

struct FaultRow {
  FaultId id;
  std::string_view name;     // stable identifier
  std::string_view meaning;  // text for operators
  std::string_view remedy;   // action for operators
  Unit unit = Unit::none;
  Sense sense = Sense::at_or_above;
  Reading (*read)(const FaultInputs&) = nullptr;
  LimitConfig LimitsConfig::*limit = nullptr;      // from the configuration; null: a condition, threshold 1
  Duration ConfirmTimes::*confirm_time = nullptr;  // without a limit, from the configuration ...
  Duration confirm{};                              // ... or the same for every pack
  Duration clear = 1s;
  std::uint8_t samples = 1;  // distinct samples beyond the threshold required to confirm; 1: time alone decides
  /// A warning is debounced as long as the fault. For readings that compare samples of different instants: a load step
  /// changes one sample and not the other, and such a reading is too high until the current of the step arrives.
  bool confirms_warning = false;
  AskAgain ask_again = AskAgain::no;
  Reaction reaction = Reaction::open_now;
  Duration grace{};  // exactly for open_after_grace
  /// For rows with open_now: a current above the breaking capacity of the contactors may fall first, for
  /// `break_wait_max` at most (permission.hpp), if the pack file gives that capacity. For faults of current and cell
  /// voltage, which a short circuit causes; no other fault waits.
  bool waits_above_rating = false;
  Latch latch = Latch::none;
  Outlives outlives = Outlives::always;  // for rows that latch
  Concerns concerns = Concerns::all;
  /// While a charger is plugged in no request closes the pack, whichever current the fault affects: closing would
  /// connect the charger.
  bool bars_while_plugged_in = false;
  std::uint8_t dtc = 0;  // trouble code in 622h, dialect iha: 1 poor cell, 2 poor battery, 3 too cold to charge
  std::uint8_t lithiumate_code = 0;  // stored fault code of the dialect elithion, 0 none

  /// The row compares a number with configured thresholds, not a condition.
  [[nodiscard]] constexpr bool has_limit() const { return limit != nullptr; }
};

/// Whether a fault affects this direction of current, alone or together with the other.
[[nodiscard]] constexpr bool is_about(const FaultRow& row, Concerns direction) {
  return row.concerns == Concerns::all || row.concerns == direction;
}

/// In the order of FaultId.
[[nodiscard]] const std::array<FaultRow, fault_count>& fault_table();
[[nodiscard]] const FaultRow& row_of(FaultId id);

/// Effective reaction of a confirmed fault.
struct FaultReaction {
  Reaction reaction = Reaction::open_now;
  Duration grace{};          // exactly for open_after_grace
  bool is_stricter = false;  // set by the pack file
};
/// The row's own reaction, or the stricter one of the pack file.
[[nodiscard]] FaultReaction reaction_of(const FaultRow& row, const StricterReactions& stricter);

/// The strictest reaction that a pack file may give the row. A single sample must not open the contactors: a row with a
/// limit that one sample confirms at most refuses to close.
[[nodiscard]] Reaction strictest_reaction(const FaultRow& row);

}  // namespace bmu

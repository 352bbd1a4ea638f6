// Everything the core is told about a pack, once, before the first observation. Filled by config/pack_config.* from a
// JSON file and already valid when it arrives here; units are those of the names, whatever the file used.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <string_view>

#include "daemon/core/cell/cell_dynamics.hpp"
#include "daemon/core/cell/cell_model.hpp"
#include "daemon/core/cell/charge_plateau_model.hpp"
#include "daemon/core/cell/derating.hpp"
#include "daemon/core/types/observation.hpp"
#include "daemon/core/types/soc_method.hpp"
#include "devices/charger.hpp"
#include "devices/current_sensor.hpp"
#include "devices/insulation_monitor.hpp"
#include "devices/inverter.hpp"
#include "devices/module_driver.hpp"
#include "devices/sensor_set_up.hpp"
#include "protocol/fixed_vector.hpp"
#include "protocol/tables/internal_bus.hpp"
#include "protocol/tables/vehicle_dialects.hpp"
#include "protocol/time.hpp"

namespace bmu {

/// A decision is due every so often; the worst that an observation waits for one.
inline constexpr Duration tick_period = 10ms;

inline constexpr std::size_t modules_max = internal_bus::node_count_max;
inline constexpr std::size_t cells_max = modules_max * internal_bus::cells_per_module_max;
/// At the cells of one module, whosever it is: ours have up to four.
inline constexpr std::size_t cell_sensors_max = 5;
static_assert(cell_sensors_max >= internal_bus::cell_temperatures_per_module_max &&
              cell_sensors_max >= foreign_temperatures_max);
static_assert(internal_bus::cells_per_module_max >= foreign_cells_max);

struct ModuleConfig {
  std::uint8_t node = 1;                         // 1 to 63, unique
  std::uint8_t cell_count = 12;                  // 1 to 12
  std::uint8_t temperature_sensor_count = 4;     // cell sensors, 0 to 4, of foreign ones 5; at least one in the pack
  std::optional<std::uint32_t> serial_number{};  // which module it is; not given: the one first seen there
  bool must_report_front_end = false;            // supply and thermal shutdown of its front end, in MODULE
};

enum class FaultId : std::uint8_t;   // fault_table.hpp
enum class Reaction : std::uint8_t;  // the same

/// A fault that this pack takes more seriously than the fault table does; never less.
struct StricterReaction {
  FaultId fault{};
  Reaction reaction{};
  Duration grace{};  // exactly of one that opens after a grace
};
/// One for each fault at most.
inline constexpr std::size_t stricter_reactions_max = 128;
using StricterReactions = FixedVector<StricterReaction, stricter_reactions_max>;

/// One watched limit in three tiers: from `warn` it is reported, from `limit` on the allowed current falls, at `open`
/// it is the fault. Reaching a threshold counts as exceeding it. For lower limits warn >= limit > open, for upper
/// limits warn <= limit < open. The unit is the one of the fault's row.
struct LimitConfig {
  std::int32_t warn = 0;
  std::optional<std::int32_t> limit{};  // not given: from the warning on
  std::int32_t open = 0;
  std::int32_t hysteresis = 0;  // how far back behind a threshold a value must be before it counts as good again
  Duration confirm = 150ms;     // how long, and over at least two samples, before the fault is believed
  Duration clear = 1s;          // how long good, before the cause counts as gone

  /// Where the allowed current begins to fall; it is gone at `open`.
  [[nodiscard]] constexpr std::int32_t derates_from() const { return limit.value_or(warn); }
  friend constexpr bool operator==(const LimitConfig&, const LimitConfig&) = default;
};

/// Limits that no value reaches: what a pack file does not ask for is not watched.
inline constexpr LimitConfig never_above{.warn = std::numeric_limits<std::int32_t>::max(),
                                         .open = std::numeric_limits<std::int32_t>::max()};
inline constexpr LimitConfig never_below{.warn = std::numeric_limits<std::int32_t>::min(),
                                         .open = std::numeric_limits<std::int32_t>::min()};

/// How long what is simply there or not must last before it is believed, by the names of the faults. What has no place
/// here is believed at once, or after a time that belongs to how it is found out.
struct ConfirmTimes {
  Duration discharge_not_allowed = 20ms;
  Duration charge_not_allowed = 20ms;
  Duration current_while_open = 100ms;
  Duration current_contradicts_voltage = 100ms;
  Duration cell_not_measured = 150ms;
  Duration temperature_not_measured = 100ms;
  Duration open_wire = 150ms;
  Duration module_reports_fault = 150ms;
  Duration module_reports_undervoltage = 150ms;
  Duration module_warning = 150ms;
  Duration insulation_fault = 500ms;
  Duration insulation_monitor_lost = 1500ms;
  Duration link_not_following = 150ms;
  Duration link_not_discharging = 150ms;
};

/// Those with a value here may be left out of the pack file; those that are never reached get theirs there, from the
/// cell or from the limits beside them (config/checks/pack_defaults.hpp).
struct LimitsConfig {
  LimitConfig cell_undervoltage;                      // uV
  LimitConfig cell_overvoltage;                       // uV
  LimitConfig cell_deep_discharge = never_below;      // uV
  LimitConfig cell_imbalance = never_above;           // uV, highest less lowest cell
  LimitConfig cell_overtemperature;                   // dC
  LimitConfig cell_undertemperature;                  // dC
  LimitConfig charge_overtemperature = never_above;   // dC, of the cells, while charging
  LimitConfig charge_undertemperature = never_below;  // dC
  LimitConfig board_overtemperature{.warn = 850, .open = 1'000, .hysteresis = 50, .confirm = 100ms, .clear = 10s};
  LimitConfig board_undertemperature{.warn = -350, .open = -400, .hysteresis = 20, .confirm = 100ms, .clear = 10s};
  LimitConfig temperature_rise{.warn = 500, .open = 1'000, .hysteresis = 200, .confirm = 200ms, .clear = 10s};  // mK/s
  LimitConfig temperature_spread{.warn = 150, .open = 300, .hysteresis = 20, .confirm = 100ms, .clear = 10s};   // dC
  LimitConfig discharge_overcurrent;  // mA out of the pack
  LimitConfig charge_overcurrent;     // mA into the pack, as a positive number
  LimitConfig pack_voltage_mismatch;  // mV between the sum of cells and the pack voltage
  LimitConfig module_voltage_mismatch{.warn = 100, .open = 300, .hysteresis = 50, .confirm = 500ms, .clear = 2s};  // mV
  LimitConfig current_sensors_disagree = never_above;  // mA between the two current sensors
  LimitConfig stuck_values{.warn = 3'000, .open = 8'000, .hysteresis = 1, .confirm = 200ms, .clear = 2s};  // ms
  LimitConfig insulation_low = never_below;                                                                // Ohm
  // A cell with more than twice the average resistance is poor (BMS_F.7). The same factor for the whole pack, of what
  // the cell file says. permille
  LimitConfig cell_resistance{.warn = 1'500, .open = 2'001, .hysteresis = 200, .confirm = 0ms, .clear = 1s};
  LimitConfig pack_resistance{.warn = 1'500, .open = 2'000, .hysteresis = 200, .confirm = 0ms, .clear = 1s};
  // Shares of what a peak may use up, permille. The count itself took seconds: it needs no time to be believed.
  LimitConfig discharge_overload{.warn = 800, .open = 1'000, .hysteresis = 150, .confirm = 20ms, .clear = 1s};
  LimitConfig charge_overload{.warn = 800, .open = 1'000, .hysteresis = 150, .confirm = 20ms, .clear = 1s};
  ConfirmTimes confirm;
};

/// How old each signal may be. Older is stale, and stale is never good. Nominal periods stand in the rows of
/// protocol/tables/internal_bus.hpp.
struct AgeConfig {
  Duration cell_voltage = 250ms;
  Duration temperature = 250ms;
  Duration module_status = 250ms;
  Duration pack_current = 200ms;
  Duration pack_voltage = 250ms;  // and the link voltage
  Duration pdu_status = 200ms;
};

/// What the pack can carry for ever, and more for a while: the excess over the continuous value is counted as heat,
/// (I^2 - continuous^2) * t, and `peak` for `peak_for` fills the count. A peak of 0 is no peak: nothing is counted.
struct CurrentLimitConfig {
  std::int32_t discharge_continuous_mA = 0;
  std::int32_t discharge_peak_mA = 0;
  Duration discharge_peak_for = 10s;
  std::int32_t charge_continuous_mA = 0;
  std::int32_t charge_peak_mA = 0;
  Duration charge_peak_for = 10s;
  // So much may be drawn although tables and lines would allow less, as long as no threshold is reached; 0: never.
  std::int32_t limp_home_discharge_mA = 0;
};

/// What may flow for ever, and for the peaks' time. 0: nothing is said of it.
struct CurrentBounds {
  std::int32_t discharge_continuous_mA = 0;
  std::int32_t discharge_peak_mA = 0;
  std::int32_t charge_continuous_mA = 0;
  std::int32_t charge_peak_mA = 0;
};

/// Something that the whole current flows through: a fuse, a contactor, a cable, a connector.
struct PartConfig {
  std::array<char, 24> name{};  // padded with spaces
  CurrentBounds most;
};
inline constexpr std::size_t parts_max = 16;

/// The rules that the pack as a whole has to meet. 0: there is none.
struct PackLimitsConfig {
  std::int32_t power_max_W = 0;    // in either direction: power_limits.hpp
  std::int32_t voltage_max_V = 0;  // of the full pack; a pack file that exceeds it is refused
};

/// How fast a limit moves. 0: at once.
struct LimitRampConfig {
  std::int32_t discharge_fall_mA_per_s = 0;
  std::int32_t discharge_rise_mA_per_s = 0;
  std::int32_t charge_fall_mA_per_s = 0;
  std::int32_t charge_rise_mA_per_s = 0;
};

struct PollConfig {
  Duration period = 100ms;
  std::uint8_t temperature_every = 1;  // temperatures once in so many periods, whatever the pace
  Duration fast_period{};              // near limits, and while the current changes quickly; 0: never
  Duration parked_period{};            // while the pack is open and nobody wants it; 0: never
};

/// What a pack file takes: the longest, and of precharge_min the least.
inline constexpr Duration link_decay_max = 60s;
inline constexpr Duration precharge_timeout_max = 10s;
inline constexpr Duration precharge_min_least = 80ms;

struct ContactorConfig {
  Duration settle = 100ms;            // after a contactor was commanded, before the next step
  Duration feedback_timeout = 200ms;  // auxiliary contact against command
  // Precharge: the link must follow the pack and the current must fall, not before `min` and not after `timeout`.
  Duration precharge_min{};  // from an empty link; less if it starts charged
  Duration precharge_timeout = 2s;
  std::int32_t precharge_done_permille = 950;   // link voltage of pack voltage
  std::int32_t precharge_current_max_mA = 500;  // and the current has fallen to this
  std::int32_t precharge_overcurrent_mA = 0;    // a current beyond this is a short behind the resistor; 0: not watched
  std::uint8_t precharge_tries = 3;             // before the fault; each waits for `cool_down`
  Duration precharge_cool_down = 10s;           // also the time in which the resistor gives off precharge_energy_J
  std::int32_t precharge_resistance_Ohm = 0;    // of the resistor, for its heat; 0: not watched
  std::int32_t precharge_energy_J = 0;          // what it bears at once; 0: not watched
  std::int32_t charge_only_discharge_mA = 200;  // out of a pack closed for charging only: more than this opens it
  Duration zero_current_grace = 200ms;          // opening under load: the current may fall for this long first
  Duration break_gap = 40ms;                    // then one main contactor breaks it, and the other follows after this
  Duration link_decay = 5s;                     // after opening, before a link that still follows the pack means a weld
  std::int32_t break_current_max_mA = 0;        // what the main contactors can break; 0: not known, nothing waits
  bool has_charge_contactor = false;            // between the link and the charger
  bool has_pdu = true;                          // a power distribution unit on the internal bus; else only lines
};

/// Which contacts and inputs come over lines of this machine; the rest is the power distribution unit's word.
struct LinesConfig {
  bool are_used = false;
  bool drive_contactors = false;
  std::uint8_t feedback = 0;  // bit by ContactorId
  bool has_vehicle_on = false;
  bool has_charger_connected = false;
  bool has_resume_button = false;
  bool has_insulation_ok = false;
  bool has_supply_ok = false;
};

/// How much of an insulation monitor there is.
enum class InsulationMonitoring : std::uint8_t {
  ok_line,   // its OK line alone
  measured,  // resistance and state too: a monitor that says nothing is a fault
};

struct InsulationConfig {
  InsulationMonitoring monitoring = InsulationMonitoring::ok_line;
  // Of each volt of the full pack; limits.insulation_low is made of these.
  std::int32_t warn_Ohm_per_V = 1'000;
  std::int32_t open_Ohm_per_V = 500;
  std::int32_t open_min_Ohm = 0;
  Duration confirm = 500ms;
  bool opens_while_driving = true;  // else a low resistance only warns until the pack is open
  // Where the monitor is; of these two one at the most. Neither: the unit's word, or a line's.
  const InsulationDriver* driver = nullptr;  // on a bus
  bool has_pulse_line = false;               // an IR155 whose pulses a line of this machine captures
  Port bus = Port::internal;                 // the bus it is on

  /// One whose own word is heard, instead of what the unit says of it.
  [[nodiscard]] constexpr bool is_heard_itself() const { return driver != nullptr || has_pulse_line; }
};

/// After an undervoltage: modules asleep, and only a look now and then.
struct RestConfig {
  Duration after = 60s;  // of an open pack with the fault and nobody there
  Duration look_every = 300s;
};

/// Cooling, heating, and the line that lets the motor controller work. Thresholds that are never reached: no such
/// thing.
struct AuxiliaryConfig {
  std::int32_t fan_on_dC = std::numeric_limits<std::int32_t>::max();  // hottest cell
  std::int32_t fan_off_dC = std::numeric_limits<std::int32_t>::max() - 1;
  Duration fan_run_max = 3'600s;
  std::int32_t heater_on_dC = std::numeric_limits<std::int32_t>::min();  // coldest cell
  std::int32_t heater_off_dC = std::numeric_limits<std::int32_t>::min() + 1;
  std::int32_t heater_hot_dC = 300;  // hottest cell: no heating from here on
  Duration heater_run_max = 3'600s;
  Duration pause = 600s;                   // after a run that took too long
  std::int32_t throttle_on_permille = 0;   // motor controller enabled from here on ...
  std::int32_t throttle_off_permille = 0;  // ... and no longer below this; 0: always
};

struct SensorConfig {
  bool little_endian = false;
  bool invert_current = false;  // when the sensor counts charging as positive
  bool has_second_current = false;
  bool is_second_reversed = false;              // mounted the other way round than the first
  const SensorSetUpDriver* set_up = nullptr;    // of who tells the results; null: its settings are not asked
  bool is_configured = false;                   // if they are not as wanted; else it is not used then
  bool is_stored = false;                       // what was set outlives the sensor's supply
  const CurrentSensorDriver* first = nullptr;   // who tells the first current; null: the results at 521h
  const CurrentSensorDriver* second = nullptr;  // the second; null: 531h, or 521h where `first` has another
  Port bus = Port::internal;                    // where these two are
  // Where a second sensor of the kind of `set_up`, at 531h, is asked for its settings and answers; 0: it is not asked.
  std::uint16_t second_command_id = 0;
  std::uint16_t second_response_id = 0;

  /// The second current is told by a sensor like the first, at 531h.
  [[nodiscard]] constexpr bool has_second_at_531h() const {
    return has_second_current && first == nullptr && second == nullptr;
  }
};

struct SocConfig {
  std::int32_t rest_current_mA = 200;  // below this, contactors open, the open-circuit voltage may start the SOC
  Duration rest = 1s;                  // for this long before balancing learns from voltages
  SocMethod method = SocMethod::ekf;   // whose state of charge is told; the others run beside it
  // What the current sensor may do wrong, one standard deviation.
  std::int32_t current_gain_error_permille = 20;
  std::int32_t current_offset_error_mA = 50;
  // A charger is paused there, for so long, to see what the step does to the cells (charge_pause.hpp); 0: never.
  std::int32_t resistance_pause_permille = 0;
  Duration resistance_pause = 5s;
};

/// What a balancing plan goes by (balancing_plan.hpp).
enum class BalancingMethod : std::uint8_t { terminal_voltage, ocv, charge };

/// Which cells the modules' resistors bleed, when, and how much a resistor takes.
struct BalancingConfig {
  bool is_enabled = false;
  BalancingMethod method = BalancingMethod::ocv;
  bool requires_closed = true;             // nothing is bled from an open pack, which nobody may charge again for long
  std::int32_t bleed_resistance_Ohm = 40;  // beside each cell: 75 mA from 3.0 V on
  std::int32_t dead_band_uV = 5'000;       // the methods that go by voltage leave so much
  std::int32_t dead_band_permille = 5;     // of the capacity: `charge` leaves so much
  std::int32_t capacity_tolerance_permille = 100;  // of the cell file's: a cell may have so much more or less
  std::int32_t voltage_min_uV = 0;                 // nothing is bled while a cell is below; 0: from the limits
  std::int32_t top_uV = 0;                         // `terminal_voltage` plans from here on; 0: from the cell's curve
  std::int32_t discharge_max_mA = 500;             // out of the pack; nothing is bled while it is more
  std::int32_t board_min_dC = 0;
  std::int32_t board_max_dC = 650;
  bool without_board_sensor = false;   // bled is also where nobody sees how hot the resistors make their board
  Duration settle = 10s;               // without bleeding, before voltages are taken for a plan
  bool is_autonomous_allowed = false;  // by modules that are left alone on their own supply
};

struct VehicleConfig {
  VehicleDialect dialect = VehicleDialect::iha;
  std::uint16_t base_id = vehicle_bus::default_base_id;
  std::array<char, 8> name{'B', 'M', 'U', 'D', ' ', ' ', ' ', ' '};     // 620h
  std::array<char, 8> version{'S', 'W', ':', ' ', '0', '.', '1', '0'};  // 621h
  // What readers of these messages do not agree on.
  bool is_charge_positive = false;  // in 624h
  bool is_energy_in_kWh = false;    // in 625h of `elithion`, which else counts Wh
  std::uint16_t request_id = 0;     // of a Lithiumate's request for data (cell_requests.hpp); 0: none is answered
  std::uint16_t reply_id = 0;       // 0: 8 above the request
  bool may_clear_faults = false;    // by such a request
  // Of all cells and sensors, cyclically (cell_reporter.hpp); 0: not sent.
  std::uint16_t cell_voltages_id = 0;
  std::uint16_t cell_temperatures_id = 0;
  Duration cell_data_period = 1s;  // of a round of all of them
};

/// Where the temperature of the intake air (627h) comes from.
enum class AirSource : std::uint8_t {
  none,    // there is no such sensor
  module,  // a board sensor of a module, which sits in the air
  pdu,     // PDU_TEMPERATURE
  file,    // IntakeAirSeen, as the shell reads it
};
inline constexpr std::array<std::string_view, 4> air_source_names{"none", "module", "pdu", "file"};
struct IntakeAirConfig {
  AirSource source = AirSource::none;
  std::uint8_t node = 0;    // of a module: which
  std::uint8_t sensor = 1;  // of its board sensors, from 1
  Duration age_max = 10s;   // of what PDU and file report; a module's is ages.temperature
};

/// A pack beside this one that tells the same messages. `base_id` 0: there is none.
struct SecondPackConfig {
  std::uint16_t base_id = 0;
  VehicleDialect dialect = VehicleDialect::iha;
};

/// Modules of another maker in place of ours. They take no limits and no numbers, tell no serial number and watch no
/// cell by themselves: nothing opens the pack but its master (docs/foreign-modules.md).
struct ForeignModulesConfig {
  const ModuleDriver* driver = nullptr;  // null: the modules are ours
  ModuleOptions options;
};

/// Chargers that are told what to give. Of all units together, unless a unit is named. Where a value of 0 stands here,
/// config/checks/pack_defaults.hpp has the rule that fills it.
struct ChargerConfig {
  const ChargerDriver* driver = nullptr;  // of the protocol; null: no charger is told anything
  std::uint8_t unit_count = 1;
  MasterAddress master_address = MasterAddress::f4;  // of this node's commands
  std::int32_t current_max_mA = 0;
  std::int32_t voltage_max_mV = 0;             // never more is asked for
  std::int32_t mains_current_max_mA = 16'000;  // of each unit, where it can be told
  std::int32_t cell_full_uV = 0;               // where the highest cell is held
  std::int32_t end_current_mA = 0;             // full, when no more than this is taken there ...
  Duration end_for = 30s;                      // ... for so long
  std::int32_t rise_mA_per_s = 2'000;          // of what is asked for; it falls at once
  std::int32_t balance_window_uV = 0;          // cells that are no further apart at the top are full together
  std::int32_t resume_uV = 20'000;             // so far the highest cell is bled down before it charges on
  std::int32_t resume_below_permille = 0;      // of a full pack that stays plugged in; 0: never
  bool opens_when_full = true;                 // else the pack stays closed with its charger
  bool requests_mains = false;                 // a charging post is asked for mains, where it can be told
};

/// What follows when the inverter of a closed pack is not heard.
enum class SilentInverter : std::uint8_t {
  warn,  // nothing but being told
  stop,  // it is told that nothing may flow, until it is heard
  open,  // and the pack opens after a while
};

/// An inverter that is told of the pack. Where a value of 0 stands here, config/checks/pack_defaults.hpp has the rule
/// that fills it.
struct InverterConfig {
  const InverterDriver* driver = nullptr;  // of the protocol; null: no inverter is told anything
  Duration period = 1s;                    // from round to round
  Duration silence_max = 5s;               // of its keep-alive; 0: nobody listens for it
  Duration first_word_max = 60s;           // after closing, of one that lives on the pack
  SilentInverter when_silent = SilentInverter::open;
  std::int32_t charge_voltage_max_mV = 0;
  std::int32_t discharge_voltage_min_mV = 0;
  std::int32_t charge_max_mA = 0;           // 0: as much as the pack allows
  std::int32_t discharge_max_mA = 0;        // likewise
  std::int32_t force_charge_permille = 50;  // below this state of charge it is asked to charge; 0: never
  std::int32_t full_charge_after_days = 30;
  std::int32_t soh_assumed_permille = 0;        // told while the pack's health is not known; 0: nothing is
  std::optional<bool> is_discharge_positive{};  // InverterOptions; nothing: as the driver's form has it
  bool has_short_frames = false;                // InverterOptions
  std::array<char, 8> maker{};                  // zeros: as usual with this protocol
};

struct CoreConfig {
  FixedVector<ModuleConfig, modules_max> modules;  // in the order of their cells' numbers in the pack
  CellModel cell;
  std::optional<CellDynamics> dynamics{};              // measured tables; without them those that follow from `cell`
  std::optional<ChargePlateauModel> charge_plateau{};  // what a whole charge says of the capacity
  LimitsConfig limits;
  StricterReactions stricter_reactions;
  AgeConfig ages;
  CurrentLimitConfig current;
  FixedVector<PartConfig, parts_max> component_limits;
  CurrentBounds user_limits;
  PackLimitsConfig pack_limits;
  LimitRampConfig limit_ramp;
  DeratingTables derating;
  PollConfig poll;
  ContactorConfig contactors;
  SensorConfig sensor;
  LinesConfig lines;
  InsulationConfig insulation;
  RestConfig rest;
  AuxiliaryConfig auxiliary;
  std::optional<std::int32_t> module_board_limit_dC{};  // what modules are told to pause balancing at; whole degrees
  SocConfig soc;
  BalancingConfig balancing;
  VehicleConfig vehicle;
  IntakeAirConfig intake_air;
  SecondPackConfig second_pack;
  ChargerConfig charger;
  InverterConfig inverter;
  ForeignModulesConfig foreign;
  // By the names of the buses.
  ServedBy served_by{Port::internal, Port::vehicle, Port::vehicle, Port::vehicle, Port::vehicle};
  std::uint64_t hash = 0;  // of the file's bytes: in the log, the status and every recording
};

/// Whether the frames of `port` are told by `told_by`.
[[nodiscard]] constexpr bool serves(const CoreConfig& config, Port told_by, Port port) {
  return config.served_by[static_cast<std::size_t>(port)] == told_by;
}

[[nodiscard]] constexpr bool are_modules_ours(const CoreConfig& config) {
  return config.foreign.driver == nullptr;
}
/// How much older than the question a voltage may be: of our modules, which measure when asked, nothing.
[[nodiscard]] constexpr Duration sample_age_max(const ForeignModulesConfig& foreign) {
  return foreign.driver != nullptr ? foreign.driver->sample_age_max : Duration{};
}

/// Where a request for data is answered, if it is.
[[nodiscard]] constexpr std::uint16_t reply_id_of(const VehicleConfig& vehicle) {
  return vehicle.reply_id != 0 ? vehicle.reply_id : static_cast<std::uint16_t>(vehicle.request_id + 8);
}

/// Cells of the whole pack.
[[nodiscard]] constexpr std::size_t cell_count(const CoreConfig& config) {
  std::size_t count = 0;
  for (const ModuleConfig& module : config.modules) count += module.cell_count;
  return count;
}

/// What a change of current shows at once: of one cell by the model, and over all cells.
[[nodiscard]] inline std::int64_t cell_resistance_uOhm(const CoreConfig& config) {
  return std::llround(config.cell.series_resistance_Ohm * 1e6);
}
[[nodiscard]] inline std::int64_t pack_resistance_uOhm(const CoreConfig& config) {
  return cell_resistance_uOhm(config) * static_cast<std::int64_t>(cell_count(config));
}

}  // namespace bmu

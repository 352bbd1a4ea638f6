// Complete configuration of the core for one pack, passed once, before the first observation. config/pack_config.*
// fills it from a JSON file and validates it; units are those of the names, whatever units the file uses.
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

/// Interval of decisions, and so the maximum time that an observation waits for one.
inline constexpr Duration tick_period = 10ms;

inline constexpr std::size_t modules_max = internal_bus::node_count_max;
inline constexpr std::size_t cells_max = modules_max * internal_bus::cells_per_module_max;
/// Temperature sensors at the cells of one module of any manufacturer; bmud modules have up to four.
inline constexpr std::size_t cell_sensors_max = 5;
static_assert(cell_sensors_max >= internal_bus::cell_temperatures_per_module_max &&
              cell_sensors_max >= foreign_temperatures_max);
static_assert(internal_bus::cells_per_module_max >= foreign_cells_max);

struct ModuleConfig {
  std::uint8_t node = 1;                         // 1 to 63, unique
  std::uint8_t cell_count = 12;                  // 1 to 12
  std::uint8_t temperature_sensor_count = 4;     // cell sensors: 0 to 4, other makes 0 to 5; one in the pack at least
  std::optional<std::uint32_t> serial_number{};  // expected module; none: the first one received from this node
  bool must_report_front_end = false;            // must send front end supply fault and thermal shutdown in MODULE
};

enum class FaultId : std::uint8_t;   // in fault_table.hpp
enum class Reaction : std::uint8_t;  // in fault_table.hpp

/// Reaction to a fault that is stricter for this pack than in the fault table; it is never weaker.
struct StricterReaction {
  FaultId fault{};
  Reaction reaction{};
  Duration grace{};  // set if and only if the reaction opens after a grace
};
/// At most one per fault.
inline constexpr std::size_t stricter_reactions_max = 128;
using StricterReactions = FixedVector<StricterReaction, stricter_reactions_max>;

/// Threshold in three tiers: at `warn` a warning is reported, from `limit` on the permitted current is derated, at
/// `open` the fault threshold is reached. All thresholds are inclusive. For lower limits warn >= limit > open, for
/// upper limits warn <= limit < open. The unit is that of the fault's row.
struct LimitConfig {
  std::int32_t warn = 0;
  std::optional<std::int32_t> limit{};  // none: derating starts at `warn`
  std::int32_t open = 0;
  std::int32_t hysteresis = 0;  // distance behind a threshold at which the value counts as ok again
  Duration confirm = 150ms;     // debounce time, at least two samples, until the fault is confirmed
  Duration clear = 1s;          // time without the condition until the cause counts as gone

  /// Value at which derating starts; at `open` the permitted current is zero.
  [[nodiscard]] constexpr std::int32_t derates_from() const { return limit.value_or(warn); }
  friend constexpr bool operator==(const LimitConfig&, const LimitConfig&) = default;
};

/// Thresholds that no value reaches: a limit that is missing in the pack file is not monitored.
inline constexpr LimitConfig never_above{.warn = std::numeric_limits<std::int32_t>::max(),
                                         .open = std::numeric_limits<std::int32_t>::max()};
inline constexpr LimitConfig never_below{.warn = std::numeric_limits<std::int32_t>::min(),
                                         .open = std::numeric_limits<std::int32_t>::min()};

/// Debounce times of faults without a threshold, by fault name. Faults that are not listed here are confirmed
/// immediately, or after a time that is part of their detection.
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

/// Limits with a default here may be omitted in the pack file. Those with a threshold that is never reached get their
/// default there, from the cell or from related limits (config/checks/pack_defaults.hpp).
struct LimitsConfig {
  LimitConfig cell_undervoltage;                      // uV
  LimitConfig cell_overvoltage;                       // uV
  LimitConfig cell_deep_discharge = never_below;      // uV
  LimitConfig cell_imbalance = never_above;           // uV, highest minus lowest cell
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
  // A cell with more than twice the average resistance is poor (BMS_F.7). For the whole pack the same factor applies to
  // the resistance of the cell file. permille
  LimitConfig cell_resistance{.warn = 1'500, .open = 2'001, .hysteresis = 200, .confirm = 0ms, .clear = 1s};
  LimitConfig pack_resistance{.warn = 1'500, .open = 2'000, .hysteresis = 200, .confirm = 0ms, .clear = 1s};
  // Used share of the permitted peak, permille. The I2t count itself takes seconds: no debounce time is needed.
  LimitConfig discharge_overload{.warn = 800, .open = 1'000, .hysteresis = 150, .confirm = 20ms, .clear = 1s};
  LimitConfig charge_overload{.warn = 800, .open = 1'000, .hysteresis = 150, .confirm = 20ms, .clear = 1s};
  ConfirmTimes confirm;
};

/// Maximum age of each signal. An older value is stale and never counts as ok. For nominal periods see the rows of
/// protocol/tables/internal_bus.hpp.
struct AgeConfig {
  Duration cell_voltage = 250ms;
  Duration temperature = 250ms;
  Duration module_status = 250ms;
  Duration pack_current = 200ms;
  Duration pack_voltage = 250ms;  // and DC link voltage
  Duration pdu_status = 200ms;
};

/// Continuous current of the pack, and a higher peak for a limited time: the excess over the continuous value is
/// counted as heat, (I^2 - continuous^2) * t; `peak` for `peak_for` reaches the maximum. A peak of 0 is none: nothing
/// is counted.
struct CurrentLimitConfig {
  std::int32_t discharge_continuous_mA = 0;
  std::int32_t discharge_peak_mA = 0;
  Duration discharge_peak_for = 10s;
  std::int32_t charge_continuous_mA = 0;
  std::int32_t charge_peak_mA = 0;
  Duration charge_peak_for = 10s;
  // Minimum discharge limit that derating by tables and ramps leaves as long as no threshold is reached; 0: none.
  std::int32_t limp_home_discharge_mA = 0;
};

/// Continuous rating, and rating for the duration of the peaks. 0: not limited.
struct CurrentBounds {
  std::int32_t discharge_continuous_mA = 0;
  std::int32_t discharge_peak_mA = 0;
  std::int32_t charge_continuous_mA = 0;
  std::int32_t charge_peak_mA = 0;
};

/// Component that carries the whole current: a fuse, a contactor, a cable, a connector.
struct PartConfig {
  std::array<char, 24> name{};  // padded with spaces
  CurrentBounds most;
};
inline constexpr std::size_t parts_max = 16;

/// Limits of the pack as a whole. 0: none.
struct PackLimitsConfig {
  std::int32_t power_max_W = 0;    // in both directions, see power_limits.hpp
  std::int32_t voltage_max_V = 0;  // of the full pack; a pack file that exceeds it is rejected
};

/// Maximum rate of change of a limit. 0: immediate.
struct LimitRampConfig {
  std::int32_t discharge_fall_mA_per_s = 0;
  std::int32_t discharge_rise_mA_per_s = 0;
  std::int32_t charge_fall_mA_per_s = 0;
  std::int32_t charge_rise_mA_per_s = 0;
};

struct PollConfig {
  Duration period = 100ms;
  std::uint8_t temperature_every = 1;  // temperatures are polled every n-th period, at any poll rate
  Duration fast_period{};              // near limits, and while the current changes quickly; 0: never
  Duration parked_period{};            // while the pack is open without a close request; 0: never
};

/// Bounds of the pack file: maximum values, and the minimum of precharge_min.
inline constexpr Duration link_decay_max = 60s;
inline constexpr Duration precharge_timeout_max = 10s;
inline constexpr Duration precharge_min_least = 80ms;

struct ContactorConfig {
  Duration settle = 100ms;            // after a contactor command, before the next step
  Duration feedback_timeout = 200ms;  // maximum time until the auxiliary contact matches the command
  // Precharge is done when the DC link is at pack voltage and the current has fallen: not before `precharge_min` and
  // not after `precharge_timeout`.
  Duration precharge_min{};  // from a discharged DC link; shorter if it starts charged
  Duration precharge_timeout = 2s;
  std::int32_t precharge_done_permille = 950;   // DC link voltage relative to the pack voltage
  std::int32_t precharge_current_max_mA = 500;  // upper limit of the current at the end of precharge
  std::int32_t precharge_overcurrent_mA = 0;    // a higher current is a short behind the resistor; 0: not monitored
  std::uint8_t precharge_tries = 3;             // attempts before the fault; each waits for `precharge_cool_down`
  Duration precharge_cool_down = 10s;           // also the time in which the resistor dissipates precharge_energy_J
  std::int32_t precharge_resistance_Ohm = 0;    // of the resistor, to calculate its heat; 0: not monitored
  std::int32_t precharge_energy_J = 0;          // pulse energy rating of the resistor; 0: not monitored
  std::int32_t charge_only_discharge_mA = 200;  // a higher discharge current opens a pack closed for charging only
  Duration zero_current_grace = 200ms;          // opening under load: maximum wait for the current to fall first
  Duration break_gap = 40ms;                    // then one main contactor breaks the current, the other opens later
  Duration link_decay = 5s;                     // after opening; then a DC link at pack voltage indicates a weld
  std::int32_t break_current_max_mA = 0;        // breaking rating of the main contactors; 0: unknown, no waiting
  bool has_charge_contactor = false;            // between the DC link and the charger
  bool has_pdu = true;                          // a power distribution unit is on the internal bus; else GPIO only
};

/// Contacts and inputs that GPIO lines of this host provide; PDU_STATUS provides the others.
struct LinesConfig {
  bool are_used = false;
  bool drive_contactors = false;
  std::uint8_t feedback = 0;  // bits by ContactorId
  bool has_vehicle_on = false;
  bool has_charger_connected = false;
  bool has_resume_button = false;
  bool has_insulation_ok = false;
  bool has_supply_ok = false;
};

/// Available signals of the insulation monitor.
enum class InsulationMonitoring : std::uint8_t {
  ok_line,   // only its OK line
  measured,  // also resistance and state: a receive timeout of the monitor is a fault
};

struct InsulationConfig {
  InsulationMonitoring monitoring = InsulationMonitoring::ok_line;
  // Per volt of the full pack; limits.insulation_low is derived from these.
  std::int32_t warn_Ohm_per_V = 1'000;
  std::int32_t open_Ohm_per_V = 500;
  std::int32_t open_min_Ohm = 0;
  Duration confirm = 500ms;
  bool opens_while_driving = true;  // else a low resistance only warns until the pack is open
  // Connection of the monitor; at most one of these two. Neither: state from PDU_STATUS or a GPIO line.
  const InsulationDriver* driver = nullptr;  // on a bus
  bool has_pulse_line = false;               // pulses of an IR155 on a GPIO line of this host
  Port bus = Port::internal;                 // bus of `driver`

  /// The daemon reads the monitor directly, instead of the state that the PDU reports.
  [[nodiscard]] constexpr bool is_heard_itself() const { return driver != nullptr || has_pulse_line; }
};

/// Sleep after an undervoltage: the modules are asleep and woken periodically for a check.
struct RestConfig {
  Duration after = 60s;  // of an open pack with the fault, no button, key or charger
  Duration look_every = 300s;
};

/// Fan, heater, and the output that enables the motor controller. A threshold that is never reached disables the
/// output.
struct AuxiliaryConfig {
  std::int32_t fan_on_dC = std::numeric_limits<std::int32_t>::max();  // hottest cell
  std::int32_t fan_off_dC = std::numeric_limits<std::int32_t>::max() - 1;
  Duration fan_run_max = 3'600s;
  std::int32_t heater_on_dC = std::numeric_limits<std::int32_t>::min();  // coldest cell
  std::int32_t heater_off_dC = std::numeric_limits<std::int32_t>::min() + 1;
  std::int32_t heater_hot_dC = 300;  // hottest cell: no heating from here on
  Duration heater_run_max = 3'600s;
  Duration pause = 600s;                   // after a run that reached its maximum duration
  std::int32_t throttle_on_permille = 0;   // the motor controller is enabled from here on ...
  std::int32_t throttle_off_permille = 0;  // ... and disabled below this; 0: always enabled
};

struct SensorConfig {
  bool little_endian = false;
  bool invert_current = false;  // the sensor counts charging as positive
  bool has_second_current = false;
  bool is_second_reversed = false;              // mounted in the opposite direction of the first
  const SensorSetUpDriver* set_up = nullptr;    // driver of the sensor of 521h and on; null: settings are not read
  bool is_configured = false;                   // other settings are corrected; false: such a sensor is not used
  bool is_stored = false;                       // corrected settings are stored in the sensor's memory
  const CurrentSensorDriver* first = nullptr;   // sender of the first current; null: the results at 521h
  const CurrentSensorDriver* second = nullptr;  // of the second; null: 531h, or 521h if `first` is set
  Port bus = Port::internal;                    // bus of `first` and `second`
  // Identifiers for the settings of a second sensor of type `set_up` at 531h; 0: its settings are not read.
  std::uint16_t second_command_id = 0;
  std::uint16_t second_response_id = 0;

  /// The second current is sent by a sensor like the first, at 531h.
  [[nodiscard]] constexpr bool has_second_at_531h() const {
    return has_second_current && first == nullptr && second == nullptr;
  }
};

struct SocConfig {
  std::int32_t rest_current_mA = 200;  // below this, with open contactors, the SOC may be initialised by OCV
  Duration rest = 1s;                  // rest time before balancing uses the voltages
  SocMethod method = SocMethod::ekf;   // published estimator; the others run for comparison
  // Errors of the current sensor, one standard deviation.
  std::int32_t current_gain_error_permille = 20;
  std::int32_t current_offset_error_mA = 50;
  // SOC at which a charger pauses, to measure the response of the cells (charge_pause.hpp), and for how long; 0: never.
  std::int32_t resistance_pause_permille = 0;
  Duration resistance_pause = 5s;
};

/// Quantity that a balancing plan equalises (balancing_plan.hpp).
enum class BalancingMethod : std::uint8_t { terminal_voltage, ocv, charge };

/// Which cells the bleed resistors of the modules discharge and when, and the resistance.
struct BalancingConfig {
  bool is_enabled = false;
  BalancingMethod method = BalancingMethod::ocv;
  bool requires_closed = true;                     // an open pack is not bled: its next charge may be far off
  std::int32_t bleed_resistance_Ohm = 40;          // beside each cell: 75 mA from 3.0 V on
  std::int32_t dead_band_uV = 5'000;               // dead band of the methods that compare voltages
  std::int32_t dead_band_permille = 5;             // dead band of `charge`, of the capacity
  std::int32_t capacity_tolerance_permille = 100;  // relative to the cell file: a cell may have this much more or less
  std::int32_t voltage_min_uV = 0;                 // no bleeding while a cell is below; 0: from the limits
  std::int32_t top_uV = 0;                         // `terminal_voltage` plans from here on; 0: from the cell's curve
  std::int32_t discharge_max_mA = 500;             // out of the pack; no bleeding above it
  std::int32_t board_min_dC = 0;
  std::int32_t board_max_dC = 650;
  bool without_board_sensor = false;   // balance modules with unmonitored board temperature
  Duration settle = 10s;               // without bleeding, before voltages are used for a plan
  bool is_autonomous_allowed = false;  // of modules without master, powered by their cells
};

struct VehicleConfig {
  VehicleDialect dialect = VehicleDialect::iha;
  std::uint16_t base_id = vehicle_bus::default_base_id;
  std::array<char, 8> name{'B', 'M', 'U', 'D', ' ', ' ', ' ', ' '};     // 620h
  std::array<char, 8> version{'S', 'W', ':', ' ', '0', '.', '1', '0'};  // 621h
  // Options for readers that interpret these messages differently.
  bool is_charge_positive = false;  // in 624h
  bool is_energy_in_kWh = false;    // in 625h of `elithion`, which otherwise counts Wh
  std::uint16_t request_id = 0;     // of data requests as to a Lithiumate (cell_requests.hpp); 0: no answers
  std::uint16_t reply_id = 0;       // 0: 8 above the request
  bool may_clear_faults = false;    // by such a request
  // Messages with all cells and all sensors, sent cyclically (cell_reporter.hpp); 0: not sent.
  std::uint16_t cell_voltages_id = 0;
  std::uint16_t cell_temperatures_id = 0;
  Duration cell_data_period = 1s;  // of a cycle through all of them
};

/// Source of the intake air temperature (627h).
enum class AirSource : std::uint8_t {
  none,    // no such sensor
  module,  // a board sensor of a module in the intake air
  pdu,     // PDU_TEMPERATURE
  file,    // IntakeAirSeen, which the shell reads
};
inline constexpr std::array<std::string_view, 4> air_source_names{"none", "module", "pdu", "file"};
struct IntakeAirConfig {
  AirSource source = AirSource::none;
  std::uint8_t node = 0;    // of `module`: its node
  std::uint8_t sensor = 1;  // of `module`: board sensor, from 1
  Duration age_max = 10s;   // of `pdu` and `file`; for `module` ages.temperature applies
};

/// Second pack that sends the same messages. `base_id` 0: none.
struct SecondPackConfig {
  std::uint16_t base_id = 0;
  VehicleDialect dialect = VehicleDialect::iha;
};

/// Modules of another manufacturer instead of bmud modules. They accept no limits and no node numbers, have no serial
/// number and do not monitor their cells: only the master opens the pack (docs/foreign-modules.md).
struct ForeignModulesConfig {
  const ModuleDriver* driver = nullptr;  // null: bmud modules
  ModuleOptions options;
};

/// Charger control. Values are totals of all units, unless they are per unit. config/checks/pack_defaults.hpp defines
/// the default of a value that is 0 here.
struct ChargerConfig {
  const ChargerDriver* driver = nullptr;  // of the protocol; null: no charger is commanded
  std::uint8_t unit_count = 1;
  MasterAddress master_address = MasterAddress::f4;  // of this node's commands
  std::int32_t current_max_mA = 0;
  std::int32_t voltage_max_mV = 0;             // upper limit of the commanded voltage
  std::int32_t mains_current_max_mA = 16'000;  // per unit, if the protocol can set it
  std::int32_t cell_full_uV = 0;               // constant voltage of the highest cell
  std::int32_t end_current_mA = 0;             // full, if at most this current flows at that voltage ...
  Duration end_for = 30s;                      // ... for this time
  std::int32_t rise_mA_per_s = 2'000;          // of the commanded current; it falls immediately
  std::int32_t balance_window_uV = 0;          // cells within this range at the top are full together
  std::int32_t resume_uV = 20'000;             // the highest cell is bled by this before charging resumes
  std::int32_t resume_below_permille = 0;      // SOC at which a full pack still plugged in is recharged; 0: never
  bool opens_when_full = true;                 // else the pack stays closed with its charger
  bool requests_mains = false;                 // request mains of a charging post, if the protocol can
};

/// Reaction to a receive timeout of the inverter while the pack is closed.
enum class SilentInverter : std::uint8_t {
  warn,  // only report it
  stop,  // send zero limits until the inverter is received again
  open,  // the same, and the pack opens after the grace
};

/// Inverter control. config/checks/pack_defaults.hpp defines the default of a value that is 0 here.
struct InverterConfig {
  const InverterDriver* driver = nullptr;  // of the protocol; null: nothing is sent to an inverter
  Duration period = 1s;                    // of a cycle of messages
  Duration silence_max = 5s;               // of its keep-alive; 0: not monitored
  Duration first_word_max = 60s;           // after closing, for an inverter that is supplied by the pack
  SilentInverter when_silent = SilentInverter::open;
  std::int32_t charge_voltage_max_mV = 0;
  std::int32_t discharge_voltage_min_mV = 0;
  std::int32_t charge_max_mA = 0;           // 0: pack limit
  std::int32_t discharge_max_mA = 0;        // 0: pack limit
  std::int32_t force_charge_permille = 50;  // below this SOC it is requested to charge; 0: never
  std::int32_t full_charge_after_days = 30;
  std::int32_t soh_assumed_permille = 0;        // sent while the SOH is unknown; 0: none is sent
  std::optional<bool> is_discharge_positive{};  // InverterOptions; none: as defined by the driver
  bool has_short_frames = false;                // InverterOptions
  std::array<char, 8> maker{};                  // zeros: default of the protocol
};

struct CoreConfig {
  FixedVector<ModuleConfig, modules_max> modules;  // in the order of the pack numbers of their cells
  CellModel cell;
  std::optional<CellDynamics> dynamics{};              // measured tables; none: derived from `cell`
  std::optional<ChargePlateauModel> charge_plateau{};  // capacity from a complete charge
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
  std::optional<std::int32_t> module_board_limit_dC{};  // at which modules pause balancing; whole degrees
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
  std::uint64_t hash = 0;  // of the bytes of the file: in the log, the status and every recording
};

/// Whether the frames of `port` are reported as frames of `told_by`.
[[nodiscard]] constexpr bool serves(const CoreConfig& config, Port told_by, Port port) {
  return config.served_by[static_cast<std::size_t>(port)] == told_by;
}

[[nodiscard]] constexpr bool are_modules_ours(const CoreConfig& config) {
  return config.foreign.driver == nullptr;
}
/// Maximum age of a voltage at the time of its poll: 0 for bmud modules, which measure when polled.
[[nodiscard]] constexpr Duration sample_age_max(const ForeignModulesConfig& foreign) {
  return foreign.driver != nullptr ? foreign.driver->sample_age_max : Duration{};
}

/// Identifier of the answers to data requests, if these are enabled.
[[nodiscard]] constexpr std::uint16_t reply_id_of(const VehicleConfig& vehicle) {
  return vehicle.reply_id != 0 ? vehicle.reply_id : static_cast<std::uint16_t>(vehicle.request_id + 8);
}

/// Cells of the whole pack.
[[nodiscard]] constexpr std::size_t cell_count(const CoreConfig& config) {
  std::size_t count = 0;
  for (const ModuleConfig& module : config.modules) count += module.cell_count;
  return count;
}

/// Resistance that a current step shows immediately: of one cell by the model, and of all cells in series.
[[nodiscard]] inline std::int64_t cell_resistance_uOhm(const CoreConfig& config) {
  return std::llround(config.cell.series_resistance_Ohm * 1e6);
}
[[nodiscard]] inline std::int64_t pack_resistance_uOhm(const CoreConfig& config) {
  return cell_resistance_uOhm(config) * static_cast<std::int64_t>(cell_count(config));
}

}  // namespace bmu

// The environment of the devices: the plant, the conversion of its quantities to the devices' inputs, and everything
// that a script can do to either. Devices never read the plant; they get the results of `measure_*`.
//
// Plain data that the script's rows (world_script.cpp) set, and the functions that read it.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "daemon/core/types/core_config.hpp"
#include "mmu/devices/can_charger.hpp"
#include "mmu/devices/can_insulation.hpp"
#include "mmu/devices/can_inverter.hpp"
#include "mmu/devices/can_module.hpp"
#include "mmu/devices/can_requester.hpp"
#include "mmu/devices/can_second_pack.hpp"
#include "mmu/devices/charger.hpp"
#include "mmu/devices/current_sensor.hpp"
#include "mmu/devices/foreign_sensor.hpp"
#include "mmu/devices/insulation_unit.hpp"
#include "mmu/devices/mmu.hpp"
#include "mmu/devices/module_wire.hpp"
#include "mmu/devices/pdu.hpp"
#include "mmu/devices/random.hpp"
#include "mmu/devices/sensor_unit.hpp"
#include "mmu/plant/load_profile.hpp"
#include "mmu/plant/plant.hpp"
#include "mmu/scenario/scenario.hpp"

namespace bmu {

struct SimulatorConfig {
  std::vector<MmuConfig> modules;  // in the order of their cells in the pack
  CanModuleConfig foreign;         // with a driver: third-party modules
  PlantConfig plant;               // its cells_of_module as in `modules`
  CurrentSensorConfig sensor;
  std::uint16_t report_base_id = vehicle_bus::default_base_id;  // where the charger receives the master
  const ChargerDriver* charger = nullptr;                       // or the protocol in which it is controlled
  std::uint8_t charger_units = 1;
  ServedBy served_by{};                              // which of the master's buses are one; all, unless set
  const InverterDriver* inverter = nullptr;          // protocol of an inverter; null: none
  SecondPackConfig second_pack;                      // reports of a second pack's master, if any
  const SensorSetUpDriver* sensor_set_up = nullptr;  // driver of the sensor's configuration; null: none
  std::uint16_t second_command_id = 0;               // of a second configurable sensor; 0: none
  std::uint16_t second_response_id = 0;
  const CurrentSensorDriver* first_current = nullptr;   // sends the first current instead; null: the sensor
  const CurrentSensorDriver* second_current = nullptr;  // likewise the second
  bool is_second_reversed = false;
  const InsulationDriver* insulation = nullptr;  // a monitor on a bus; null: an IR155 at the PDU
  std::uint16_t request_id = 0;                  // of requests for data to the master; 0: none
  std::uint64_t seed = 1;
  std::int32_t cell_noise_uV = 0;  // of every sample, uniform over plus and minus this
  std::int32_t current_noise_mA = 0;
};

/// The wire at a cell's upper end, which is the lower end of the next.
enum class SenseWire : std::uint8_t { closed, open, open_silent };

/// A balancing switch: as its module commands it, or stuck.
enum class BalancingSwitch : std::uint8_t { automatic, stays_off, stays_on };

/// A cell's measuring channel, and its balancing switch.
struct CellSense {
  std::optional<double> voltage_mV;  // set by the script instead of the plant
  double offset_mV = 0.0;
  SenseWire wire = SenseWire::closed;
  TimePoint opened_at{};
  bool is_stuck = false;
  bool is_out_of_range = false;  // a third-party module sends a number that is not allowed in the field
  std::int32_t last_uV = 0;
  BalancingSwitch balancing_switch = BalancingSwitch::automatic;
};

/// A thermistor: its state (valid: it measures), and whether it is stuck at the resistance it had.
struct ThermistorSense {
  Validity state = Validity::valid;
  bool is_stuck = false;
  std::optional<double> held_Ohm;  // since it is stuck
};

struct ModuleSense {
  ModuleWireFaults wire;
  bool has_crc_errors = false;      // every group from the front end is damaged
  double crc_error_permille = 0.0;  // or this share of them
  unsigned wrong_bits = 1;          // in each damaged one
  double external_supply_mV = 12'000.0;
  std::optional<ThermistorCurve> thermistor_curve;  // of the fitted parts; none: as the MMU assumes
  bool talks_on_own_supply = false;                 // its CAN side is fed by its cells, too
  bool is_self_test_failed = false;
  bool reports_front_end_faults = true;
  bool is_front_end_supply_low = false;
  bool is_front_end_shut_down = false;  // by its temperature
  bool is_restart_wanted = false;       // reset by the simulator
  std::optional<double> board_temperature_dC;
  bool ignores_commands = false;
  std::uint32_t errors = 0;  // error bits of a module that reports errors
  std::array<ThermistorSense, cell_sensors_max> thermistors{};
  std::array<ThermistorSense, mmu_board_temperatures> board_thermistors{};
};

/// The results a script can change, in the order of its words.
enum class ScriptedResult : std::uint8_t { current, pack_voltage, link_voltage, current_2 };
inline constexpr std::size_t scripted_results = 4;

struct SensorSense {
  bool is_silent = false;
  bool is_stuck = false;
  bool is_inverted = false;
  bool has_error = false;
  double gain = 1.0;
  double offset = 0.0;  // mA or mV
  std::optional<double> value;
};

/// Command of an operator to the master beside the pack: the property of the script, and its word.
struct MasterOrder {
  Property property{};
  std::uint8_t word = 0;
};

struct World {
  World(const SimulatorConfig& config, TimePoint started_at);

  /// Applies an event, now or, for a ramp, from now on. Precondition: this pack has the module and cell of `event`.
  void apply(const ScenarioEvent& event, TimePoint now);
  /// The configuration as far as scripts are checked against it.
  [[nodiscard]] SimulatorConfig described() const;
  /// One millisecond, ending at `now`.
  void step(TimePoint now);

  /// Transfer of the module's front end, damage included.
  [[nodiscard]] FrontEndTransfer measure_module(std::size_t module, TransferWanted wanted);
  /// Whether the CAN side of a module has power: it can send and receive. It is fed by the external supply alone,
  /// unless the module communicates on its own supply.
  [[nodiscard]] bool has_bus_power(std::size_t module) const;
  /// Measurements of a third-party module, without the cells it bleeds, which it determines itself.
  [[nodiscard]] ModuleMeasurements measure_foreign(std::size_t module);
  [[nodiscard]] PduMeasurements measure_pdu() const;
  [[nodiscard]] SensorMeasurements measure_sensor();
  [[nodiscard]] SensorMeasurements measure_second_sensor();
  /// Rest voltage of the second pack, with cells like this one's, unless the script sets another.
  [[nodiscard]] double second_pack_rest_mV() const;

  [[nodiscard]] std::size_t module_of(ScenarioPlace place) const { return module_of_node[place.node]; }
  [[nodiscard]] std::size_t cell_of(ScenarioPlace place) const {
    return plant.first_cell(module_of(place)) + place.index;
  }
  /// Voltage at the cell's channel, before noise, offset and the effect of an open wire.
  [[nodiscard]] double sensed_mV(std::size_t cell) const;
  /// Cells with a current through their resistors when these switches of a module are on: none through an open wire.
  /// Between two intact wires all switches must be on; then their resistors are in series and carry the same current as
  /// each alone.
  [[nodiscard]] CellMask bled_cells(std::size_t module, CellMask switches) const;
  [[nodiscard]] const SensorSense& sense_of(ScriptedResult result) const {
    return sensor_senses[static_cast<std::size_t>(result)];
  }
  /// The switches that are actually on when the module commands these.
  [[nodiscard]] CellMask switches_on(std::size_t module, CellMask wanted) const;
  [[nodiscard]] bool has_switch_fault(std::size_t module) const;
  void cancel_ramps(Property property, ScenarioPlace place);

  Plant plant;
  std::vector<MmuConfig> modules;
  std::array<std::uint8_t, internal_bus::node_count_max + 1U> module_of_node{};
  std::vector<CellSense> cell_senses;
  std::vector<ModuleSense> module_senses;
  std::vector<bool> module_alarms;     // alarm outputs that are open; set likewise
  std::vector<UnitMode> module_modes;  // set by the simulator after each step of the modules
  std::array<SensorSense, scripted_results> sensor_senses{};
  bool has_second_sensor;
  SensorUnit sensor_unit;
  SensorUnit second_sensor_unit;
  CanRequester requester;
  ForeignSensor first_current;
  ForeignSensor second_current;
  bool is_second_reversed;
  std::array<bool, internal_bus::node_count_max + 1U> has_stranger{};  // by node
  bool is_pdu_silent = false;
  bool has_pdu_damaged_frames = false;
  bool has_alarm_loop = false;  // the modules' alarm outputs are in the enable loop of the PDU

  PduInputs inputs;  // insulation_monitor_ok follows from the monitor below
  InsulationUnit insulation;
  CanInsulation can_insulation;
  std::optional<double> throttle_permille;
  std::optional<double> intake_air_dC;  // none: the PDU has no such sensor

  double charger_A = 0.0;  // its set value
  ChargerControl charger;
  CanChargers can_chargers;
  CanInverter inverter;
  CanSecondPack second_pack;
  bool obeys_master = true;  // of the charger
  bool is_charger_runaway = false;
  bool is_charger_unstoppable = false;
  double load_A = 0.0;
  LoadProfile profile = LoadProfile::none;
  TimePoint profile_began_at{};
  TimePoint now{};
  std::vector<MasterOrder> orders;  // executed by the program that runs a master beside this

 private:
  struct Ramp {
    Property property;
    ScenarioPlace place;
    double from = 0.0;
    double to = 0.0;
    TimePoint began_at{};
    Duration over{};
  };
  void step_ramps();
  void step_charger();
  [[nodiscard]] double drift_mV(std::size_t cell) const;
  [[nodiscard]] std::int32_t measure_cell_uV(std::size_t cell, double shifted_mV);
  [[nodiscard]] std::int32_t sense_result(ScriptedResult result, double real) const;
  void measure_cells(std::size_t module, FrontEndInputs& chip);
  void measure_thermistors(std::size_t module, FrontEndInputs& chip);
  [[nodiscard]] ThermistorCurve fitted_curve(std::size_t module) const;
  [[nodiscard]] double cell_sensor_Ohm(std::size_t module, std::size_t sensor);
  [[nodiscard]] double board_sensor_Ohm(std::size_t module, std::size_t sensor);
  [[nodiscard]] double bled_drop_mV(std::size_t cell) const;
  [[nodiscard]] double felt_by_C(std::size_t module, std::size_t sensor) const;
  void damage_transfer(const ModuleSense& sense, FrontEndTransfer& transfer);

  double charger_delivered_A_ = 0.0;
  std::vector<Ramp> ramps_;
  RandomSource random_;
  RandomSource damage_random_;  // separate, so that damage changes no noise
  double bled_reads_low_mV_;
  std::int32_t cell_noise_uV_;
  std::int32_t current_noise_mA_;
};

}  // namespace bmu

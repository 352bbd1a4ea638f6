// The world around the devices: the plant, how its quantities get into the devices' inputs, and everything a script can
// do to either. Devices never look at the plant; they get what `measure_*` makes of it.
//
// Plain data that the script's rows (world_script.cpp) write to, and the functions that read it.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "mmu/current_sensor.hpp"
#include "mmu/insulation_unit.hpp"
#include "mmu/load_profile.hpp"
#include "mmu/mmu.hpp"
#include "mmu/module_wire.hpp"
#include "mmu/pdu.hpp"
#include "mmu/plant.hpp"
#include "mmu/random.hpp"
#include "mmu/scenario.hpp"

namespace bmu {

struct SimulatorConfig {
  std::vector<MmuConfig> modules;  // in the order of their cells in the pack
  PlantConfig plant;               // its cells_of_module as in `modules`
  CurrentSensorConfig sensor;
  std::uint64_t seed = 1;
  std::int32_t cell_noise_uV = 0;  // of every sample, even over plus and minus this
  std::int32_t current_noise_mA = 0;
};

/// The wire at a cell's upper end, which is the lower end of the next.
enum class SenseWire : std::uint8_t { closed, open, open_silent };

/// A cell's measuring channel.
struct CellSense {
  std::optional<double> voltage_mV;  // what the script says instead of the plant
  double offset_mV = 0.0;
  SenseWire wire = SenseWire::closed;
  TimePoint opened_at{};
  bool is_stuck = false;
  std::int32_t last_uV = 0;
};

struct ModuleSense {
  ModuleWireFaults wire;
  bool has_crc_errors = false;
  bool is_self_test_failed = false;
  bool is_restart_wanted = false;  // taken by the simulator
  std::optional<double> board_temperature_dC;
  std::array<Validity, mmu_cell_temperatures> thermistors{};  // valid: it measures
};

/// The results a script can change, in the order of its words.
enum class ScriptedResult : std::uint8_t { current, pack_voltage, link_voltage, current_2 };
inline constexpr std::size_t scripted_results = 4;

struct SensorSense {
  bool is_silent = false;
  bool is_stuck = false;
  bool is_inverted = false;
  bool has_error = false;
  double offset = 0.0;  // mA or mV
  std::optional<double> value;
};

struct World {
  World(const SimulatorConfig& config, TimePoint started_at);

  /// Does what the event says, now or, for a ramp, from now on. `event` names a module and cell this pack has.
  void apply(const ScenarioEvent& event, TimePoint now);
  /// One millisecond, ending at `now`.
  void step(TimePoint now);

  [[nodiscard]] MmuMeasurements measure_module(std::size_t module);
  [[nodiscard]] PduMeasurements measure_pdu() const;
  [[nodiscard]] SensorMeasurements measure_sensor();
  [[nodiscard]] SensorMeasurements measure_second_sensor();

  [[nodiscard]] std::size_t module_of(ScenarioPlace place) const { return module_of_node[place.node]; }
  [[nodiscard]] std::size_t cell_of(ScenarioPlace place) const {
    return plant.first_cell(module_of(place)) + place.index;
  }
  /// What the cell's channel sees, before noise, offset and what an open wire does to it.
  [[nodiscard]] double sensed_mV(std::size_t cell) const;
  [[nodiscard]] const SensorSense& sense_of(ScriptedResult result) const {
    return sensor_senses[static_cast<std::size_t>(result)];
  }
  void cancel_ramps(Property property, ScenarioPlace place);

  Plant plant;
  std::vector<MmuConfig> modules;
  std::array<std::uint8_t, internal_bus::node_count_max + 1U> module_of_node{};
  std::vector<CellSense> cell_senses;
  std::vector<ModuleSense> module_senses;
  std::array<SensorSense, scripted_results> sensor_senses{};
  bool has_second_sensor;
  std::array<bool, internal_bus::node_count_max + 1U> has_stranger{};  // by node
  bool is_pdu_silent = false;
  bool has_pdu_damaged_frames = false;

  PduInputs inputs;  // insulation_monitor_ok follows from the monitor below
  InsulationUnit insulation;
  std::optional<double> throttle_permille;

  double charger_A = 0.0;
  bool is_charger_runaway = false;
  bool is_charger_unstoppable = false;
  double load_A = 0.0;
  LoadProfile profile = LoadProfile::none;
  TimePoint profile_began_at{};
  TimePoint now{};

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
  [[nodiscard]] std::int32_t measure_cell_uV(std::size_t cell, double drifted_mV);
  [[nodiscard]] std::int32_t sense_result(ScriptedResult result, double real) const;
  [[nodiscard]] SignalValue measure_thermistor(std::size_t module, std::size_t sensor) const;

  double charger_delivered_A_ = 0.0;
  std::vector<Ramp> ramps_;
  RandomSource random_;
  std::int32_t cell_noise_uV_;
  std::int32_t current_noise_mA_;
};

}  // namespace bmu

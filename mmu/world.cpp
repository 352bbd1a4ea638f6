#include "mmu/world.hpp"

#include <algorithm>
#include <cmath>

namespace bmu {

namespace {

std::int32_t rounded(double value) {
  return static_cast<std::int32_t>(std::lround(value));
}

constexpr double kelvin_to_tenths = 10.0;
// The monitor's response value, as the rules for competition vehicles have it.
constexpr double insulation_kOhm_per_V = 0.5;
// An input without its wire floats; what the converter draws pulls it down to the wire below.
constexpr double open_wire_time_constant_s = 1.0;
constexpr double front_end_max_mV = 5000.0;

double full_pack_V(const Plant& plant) {
  return plant.config().cell.voltage_max_V * static_cast<double>(plant.cell_count());
}

}  // namespace

World::World(const SimulatorConfig& config, TimePoint started_at)
    : plant(config.plant),
      modules(config.modules),
      cell_senses(plant.cell_count()),
      module_senses(config.modules.size()),
      has_second_sensor(config.sensor.has_second),
      insulation(started_at, full_pack_V(plant) * insulation_kOhm_per_V),
      now(started_at),
      random_(config.seed),
      cell_noise_uV_(config.cell_noise_uV),
      current_noise_mA_(config.current_noise_mA) {
  for (std::size_t module = 0; module < modules.size(); ++module) {
    module_of_node[modules[module].node] = static_cast<std::uint8_t>(module);
  }
  ramps_.reserve(32);
}

void World::step(TimePoint time) {
  now = time;
  step_ramps();
  plant.set_load_A(profile == LoadProfile::none ? load_A : load_at(profile, now - profile_began_at));
  step_charger();
  plant.step();
  insulation.step(now);
}

void World::step_charger() {
  const double wanted_A = inputs.charger_connected ? charger_A : 0.0;
  charger_delivered_A_ = is_charger_unstoppable ? std::max(wanted_A, charger_delivered_A_) : wanted_A;
  plant.set_charger_A(charger_delivered_A_);
  plant.set_charger_runaway(is_charger_runaway);
}

// --- what the devices see -------------------------------------------------------------------------------------------

double World::sensed_mV(std::size_t cell) const {
  return cell_senses[cell].voltage_mV.value_or(plant.cell(cell).voltage_V * 1e3);
}

MmuMeasurements World::measure_module(std::size_t module) {
  const ModuleSense& sense = module_senses[module];
  const std::size_t first = plant.first_cell(module);
  MmuMeasurements measured;
  measured.front_end_crc_ok = !sense.has_crc_errors;
  measured.self_test_ok = !sense.is_self_test_failed;
  double module_mV = 0.0;
  bool is_wire_below_open = false;
  double wire_below_mV = 0.0;  // how far it has drifted down
  for (std::size_t cell = 0; cell < modules[module].cell_count; ++cell) {
    const double cell_mV = sensed_mV(first + cell);
    const double wire_above_mV = drift_mV(first + cell);
    module_mV += cell_mV;
    measured.cell_voltage_uV[cell] = measure_cell_uV(first + cell, wire_below_mV - wire_above_mV);
    wire_below_mV = wire_above_mV;
    const bool is_wire_open = cell_senses[first + cell].wire == SenseWire::open;
    const bool is_measured = !is_wire_open && !is_wire_below_open;
    is_wire_below_open = is_wire_open;
    if (is_measured) measured.measured_cells = static_cast<CellMask>(measured.measured_cells | cell_bit(cell));
    if (is_wire_open) measured.open_wires = static_cast<CellMask>(measured.open_wires | cell_bit(cell));
  }
  measured.module_mV = rounded(module_mV);
  for (std::size_t sensor = 0; sensor < mmu_cell_temperatures; ++sensor) {
    measured.cell_temperature_dC[sensor] = measure_thermistor(module, sensor);
  }
  const double board_dC = sense.board_temperature_dC.value_or(plant.board_C(module) * kelvin_to_tenths);
  measured.board_temperature_dC.fill(known(rounded(board_dC)));
  return measured;
}

/// How far the wire above a cell has come down since it is open and nobody has noticed: this cell reads so much less
/// and the next so much more, until the front end can read no more.
double World::drift_mV(std::size_t cell) const {
  const CellSense& channel = cell_senses[cell];
  if (channel.wire != SenseWire::open_silent) return 0.0;
  return sensed_mV(cell) * -std::expm1(-to_s(now - channel.opened_at) / open_wire_time_constant_s);
}

std::int32_t World::measure_cell_uV(std::size_t cell, double drifted_mV) {
  CellSense& channel = cell_senses[cell];
  double read_mV = sensed_mV(cell);
  if (drifted_mV != 0.0) read_mV = std::clamp(read_mV + drifted_mV, 0.0, front_end_max_mV);
  const std::int32_t measured_uV = rounded((read_mV + channel.offset_mV) * 1e3) + random_.within(cell_noise_uV_);
  if (!channel.is_stuck) channel.last_uV = measured_uV;
  return channel.last_uV;
}

/// Each sensor sits among its share of the module's cells and feels the warmest of them.
SignalValue World::measure_thermistor(std::size_t module, std::size_t sensor) const {
  const std::size_t sensors = modules[module].temperature_sensor_count;
  const std::size_t cells = modules[module].cell_count;
  if (sensor >= sensors) return not_known(Validity::not_fitted);
  const Validity state = module_senses[module].thermistors[sensor];
  if (state != Validity::valid) return not_known(state);
  const std::size_t first = sensor * cells / sensors;
  const std::size_t last = std::max((sensor + 1) * cells / sensors, first + 1);
  double warmest_C = plant.cell(plant.first_cell(module) + first).temperature_C;
  for (std::size_t cell = first; cell < last; ++cell) {
    warmest_C = std::max(warmest_C, plant.cell(plant.first_cell(module) + cell).temperature_C);
  }
  return known(rounded(warmest_C * kelvin_to_tenths));
}

PduMeasurements World::measure_pdu() const {
  PduMeasurements measured;
  measured.feedback = plant.feedback();
  measured.inputs = inputs;
  measured.inputs.insulation_monitor_ok = insulation.is_status_ok;
  measured.insulation = insulation.pwm;
  measured.throttle_permille = throttle_permille ? known(std::lround(*throttle_permille)) : not_known();
  return measured;
}

std::int32_t World::sense_result(ScriptedResult result, double real) const {
  const SensorSense& sense = sense_of(result);
  const double wired = sense.is_inverted ? -real : real;
  return rounded(sense.value.value_or(wired + sense.offset));
}

SensorMeasurements World::measure_sensor() {
  using enum ScriptedResult;
  SensorMeasurements measured;
  measured.current_mA = sense_result(current, plant.current_A() * 1e3 + random_.within(current_noise_mA_));
  measured.pack_mV = sense_result(pack_voltage, plant.pack_V() * 1e3);
  measured.link_mV = sense_result(link_voltage, plant.link_V() * 1e3);
  measured.has_error[static_cast<std::size_t>(SensorChannel::current)] = sense_of(current).has_error;
  measured.has_error[static_cast<std::size_t>(SensorChannel::pack_voltage)] = sense_of(pack_voltage).has_error;
  measured.has_error[static_cast<std::size_t>(SensorChannel::link_voltage)] = sense_of(link_voltage).has_error;
  return measured;
}

SensorMeasurements World::measure_second_sensor() {
  using enum ScriptedResult;
  SensorMeasurements measured;
  measured.current_mA = sense_result(current_2, plant.current_A() * 1e3 + random_.within(current_noise_mA_));
  measured.has_error[static_cast<std::size_t>(SensorChannel::current)] = sense_of(current_2).has_error;
  return measured;
}

}  // namespace bmu

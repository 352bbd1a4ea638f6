#include "mmu/scenario/world.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace bmu {

namespace {

std::int32_t rounded(double value) {
  return static_cast<std::int32_t>(std::lround(value));
}

constexpr double kelvin_to_tenths = 10.0;
// The monitor's response value, as in the rules for competition vehicles.
constexpr double insulation_kOhm_per_V = 0.5;
// An open input floats; the current of the converter pulls it down to the wire below.
constexpr double open_wire_time_constant_s = 1.0;
constexpr double front_end_max_mV = 5000.0;

/// A stuck one keeps its resistance from that time; a broken wire is still visible.
double read_Ohm(ThermistorSense& sense, double measured_Ohm) {
  if (sense.state == Validity::open_circuit) return std::numeric_limits<double>::infinity();
  if (sense.state == Validity::short_circuit) return 0.0;
  if (!sense.is_stuck) return measured_Ohm;
  if (!sense.held_Ohm) sense.held_Ohm = measured_Ohm;
  return *sense.held_Ohm;
}

/// Value as a module sends it that reads its thermistors itself.
SignalValue read_dC(ThermistorCurve curve, double resistance_Ohm) {
  if (std::isinf(resistance_Ohm)) return not_known(Validity::open_circuit);
  if (resistance_Ohm <= 0.0) return not_known(Validity::short_circuit);
  return known(std::lround(thermistor_C(curve, resistance_Ohm) * kelvin_to_tenths));
}

double full_pack_V(const Plant& plant) {
  return plant.config().cell.voltage_max_V * static_cast<double>(plant.cell_count());
}

/// As delivered and configured for the pack: the results that it sends are sent cyclically.
SensorUnit::Settings settings_of(const CurrentSensorConfig& config) {
  SensorUnit::Settings settings{};
  for (std::size_t index = 0; index < sensor_channel_count; ++index) {
    const bool is_sent = config.periods[index] > Duration::zero();
    settings[set_up_channel(static_cast<SensorChannel>(index))] = {
        .trigger = is_sent ? SensorTrigger::cyclic : SensorTrigger::off,
        .is_little_endian = config.little_endian,
        .period_ms = static_cast<std::int32_t>(to_ms(config.periods[index]))};
  }
  return settings;
}

}  // namespace

World::World(const SimulatorConfig& config, TimePoint started_at)
    : plant(config.plant),
      modules(config.modules),
      cell_senses(plant.cell_count()),
      module_senses(config.modules.size()),
      module_alarms(config.modules.size(), false),
      module_modes(config.modules.size(), UnitMode::starting),
      has_second_sensor(config.sensor.has_second),
      sensor_unit(config.sensor_set_up, settings_of(config.sensor)),
      second_sensor_unit(config.second_command_id != 0 ? config.sensor_set_up : nullptr, settings_of(config.sensor),
                         config.second_command_id, config.second_response_id),
      requester(config.request_id),
      first_current(config.first_current, started_at, config.sensor.invert_current),
      second_current(config.second_current, started_at, config.sensor.invert_current),
      is_second_reversed(config.is_second_reversed),
      insulation(started_at, full_pack_V(plant) * insulation_kOhm_per_V),
      can_insulation(config.insulation, full_pack_V(plant) * insulation_kOhm_per_V, started_at),
      charger(config.report_base_id),
      can_chargers(config.charger, config.charger_units, started_at),
      inverter(config.inverter, started_at),
      second_pack(config.second_pack, plant.cell_count(), started_at),
      now(started_at),
      random_(config.seed),
      damage_random_(~config.seed),
      bled_reads_low_mV_(config.foreign.driver != nullptr ? config.foreign.bled_reads_low_uV * 1e-3 : 0.0),
      cell_noise_uV_(config.cell_noise_uV),
      current_noise_mA_(config.current_noise_mA) {
  for (std::size_t module = 0; module < modules.size(); ++module) {
    module_of_node[modules[module].node] = static_cast<std::uint8_t>(module);
  }
  ramps_.reserve(32);
  orders.reserve(8);
}

void World::step(TimePoint time) {
  now = time;
  step_ramps();
  const double consumed_A = profile == LoadProfile::none ? load_A : load_at(profile, now - profile_began_at);
  plant.set_load_A(consumed_A + inverter.step(now, plant.link_V()));
  step_charger();
  plant.step();
  insulation.step(now);
}

void World::step_charger() {
  double wanted_A = inputs.charger_connected ? charger_A : 0.0;
  const bool obeys = obeys_master && !is_charger_runaway;
  if (can_chargers.is_there()) {
    wanted_A = can_chargers.step(now, wanted_A, plant.charger_V(), obeys, !is_charger_unstoppable);
  } else if (const std::optional<double> limit_A = charger.limit_A(now); limit_A && obeys) {
    wanted_A = std::min(wanted_A, *limit_A);
  }
  charger_delivered_A_ = is_charger_unstoppable ? std::max(wanted_A, charger_delivered_A_) : wanted_A;
  plant.set_charger_A(charger_delivered_A_);
  plant.set_charger_runaway(is_charger_runaway);
}

// --- inputs of the devices -------------------------------------------------------------------------------------------

double World::sensed_mV(std::size_t cell) const {
  return cell_senses[cell].voltage_mV.value_or(plant.cell(cell).voltage_V * 1e3);
}

CellMask World::bled_cells(std::size_t module, CellMask switches) const {
  if (switches == 0) return 0;
  CellMask bled = 0;
  CellMask between_wires = 0;  // cells since the last intact wire
  for (std::size_t cell = 0; cell < modules[module].cell_count; ++cell) {
    between_wires = static_cast<CellMask>(between_wires | cell_bit(cell));
    if (cell_senses[plant.first_cell(module) + cell].wire != SenseWire::closed) continue;
    if ((between_wires & ~switches) == 0) bled = static_cast<CellMask>(bled | between_wires);
    between_wires = 0;
  }
  return bled;
}

FrontEndTransfer World::measure_module(std::size_t module, TransferWanted wanted) {
  if (wanted == TransferWanted::nothing) return {};
  const ModuleSense& sense = module_senses[module];
  FrontEndInputs chip;
  chip.external_supply_mV = rounded(sense.external_supply_mV);
  chip.self_test_ok = !sense.is_self_test_failed;
  chip.reports_faults = sense.reports_front_end_faults;
  chip.supply_low = sense.is_front_end_supply_low;
  chip.thermal_shutdown = sense.is_front_end_shut_down;
  measure_cells(module, chip);
  if (wanted == TransferWanted::everything) measure_thermistors(module, chip);
  FrontEndTransfer transfer = convert(chip, wanted);
  damage_transfer(sense, transfer);
  return transfer;
}

bool World::has_bus_power(std::size_t module) const {
  const ModuleSense& sense = module_senses[module];
  return sense.talks_on_own_supply || sense.external_supply_mV >= supply_min_mV;
}

void World::measure_cells(std::size_t module, FrontEndInputs& chip) {
  const std::size_t first = plant.first_cell(module);
  double module_mV = 0.0;
  double wire_below_mV = 0.0;  // how far it has drifted down
  for (std::size_t cell = 0; cell < modules[module].cell_count; ++cell) {
    const double wire_above_mV = drift_mV(first + cell);
    module_mV += sensed_mV(first + cell);
    const double shifted_mV = wire_below_mV - wire_above_mV - bled_drop_mV(first + cell);
    chip.cell_voltage_uV[cell] = measure_cell_uV(first + cell, shifted_mV);
    wire_below_mV = wire_above_mV;
    const bool is_wire_open = cell_senses[first + cell].wire == SenseWire::open;
    if (is_wire_open) chip.open_wires = static_cast<CellMask>(chip.open_wires | cell_bit(cell));
  }
  chip.module_mV = rounded(module_mV);
}

/// With a wire that is detected as open, the cells on both sides have no voltage.
ModuleMeasurements World::measure_foreign(std::size_t module) {
  const ModuleSense& sense = module_senses[module];
  FrontEndInputs chip;
  measure_cells(module, chip);
  ModuleMeasurements measured{.stack_voltage_mV = chip.module_mV, .errors = sense.errors};
  const std::size_t first = plant.first_cell(module);
  const unsigned unread = unsigned{chip.open_wires} | (unsigned{chip.open_wires} << 1U);
  for (std::size_t cell = 0; cell < modules[module].cell_count; ++cell) {
    const bool is_read = !has_cell(static_cast<CellMask>(unread), cell) && !cell_senses[first + cell].is_out_of_range;
    measured.cell_voltage_uV[cell] = is_read ? known(chip.cell_voltage_uV[cell]) : not_known(Validity::out_of_range);
  }
  const ThermistorCurve curve = fitted_curve(module);
  for (std::size_t sensor = 0; sensor < modules[module].temperature_sensor_count; ++sensor) {
    measured.cell_temperature_dC[sensor] = read_dC(curve, cell_sensor_Ohm(module, sensor));
  }
  measured.board_temperature_dC = read_dC(curve, board_sensor_Ohm(module, 0));
  return measured;
}

/// Damages a share of the groups of a transfer, each with a number of wrong bits.
void World::damage_transfer(const ModuleSense& sense, FrontEndTransfer& transfer) {
  constexpr double always_permille = 1000.0;
  const double rate_permille = sense.has_crc_errors ? always_permille : sense.crc_error_permille;
  if (rate_permille <= 0.0) return;
  constexpr std::uint64_t draws = 1'000'000;
  const auto below = static_cast<std::uint64_t>(std::llround(rate_permille * 1e3));
  for (std::size_t group = 0; group < groups_in(transfer.contents); ++group) {
    if (damage_random_.next() % draws < below) damage(transfer.groups[group], sense.wrong_bits, damage_random_);
  }
}

bool World::has_switch_fault(std::size_t module) const {
  const std::size_t first = plant.first_cell(module);
  const auto is_faulty = [this, first](std::size_t cell) {
    return cell_senses[first + cell].balancing_switch != BalancingSwitch::automatic;
  };
  for (std::size_t cell = 0; cell < modules[module].cell_count; ++cell) {
    if (is_faulty(cell)) return true;
  }
  return false;
}

CellMask World::switches_on(std::size_t module, CellMask wanted) const {
  CellMask on = wanted;
  for (std::size_t cell = 0; cell < modules[module].cell_count; ++cell) {
    const BalancingSwitch fault = cell_senses[plant.first_cell(module) + cell].balancing_switch;
    if (fault == BalancingSwitch::stays_on) on = static_cast<CellMask>(on | cell_bit(cell));
    if (fault == BalancingSwitch::stays_off) on = static_cast<CellMask>(on & ~cell_bit(cell));
  }
  return on;
}

/// Voltage by which the wire above a cell has drifted down since it opened undetected: this cell reads this much less
/// and the next one this much more, up to the range of the front end.
double World::drift_mV(std::size_t cell) const {
  const CellSense& channel = cell_senses[cell];
  if (channel.wire != SenseWire::open_silent) return 0.0;
  return sensed_mV(cell) * -std::expm1(-to_s(now - channel.opened_at) / open_wire_time_constant_s);
}

/// Voltage that the current of its resistor leaves on the wires.
double World::bled_drop_mV(std::size_t cell) const {
  return plant.cell(cell).balancing_siemens > 0.0 ? bled_reads_low_mV_ : 0.0;
}

std::int32_t World::measure_cell_uV(std::size_t cell, double shifted_mV) {
  CellSense& channel = cell_senses[cell];
  double read_mV = sensed_mV(cell);
  if (shifted_mV != 0.0) read_mV = std::clamp(read_mV + shifted_mV, 0.0, front_end_max_mV);
  const std::int32_t measured_uV = rounded((read_mV + channel.offset_mV) * 1e3) + random_.within(cell_noise_uV_);
  if (!channel.is_stuck) channel.last_uV = measured_uV;
  return channel.last_uV;
}

/// Temperature at a sensor, which is among its share of the module's cells and measures the warmest of them.
double World::felt_by_C(std::size_t module, std::size_t sensor) const {
  const std::size_t sensors = modules[module].temperature_sensor_count;
  const std::size_t cells = modules[module].cell_count;
  const std::size_t first = sensor * cells / sensors;
  const std::size_t last = std::max((sensor + 1) * cells / sensors, first + 1);
  double warmest_C = plant.cell(plant.first_cell(module) + first).temperature_C;
  for (std::size_t cell = first; cell < last; ++cell) {
    warmest_C = std::max(warmest_C, plant.cell(plant.first_cell(module) + cell).temperature_C);
  }
  return warmest_C;
}

ThermistorCurve World::fitted_curve(std::size_t module) const {
  return module_senses[module].thermistor_curve.value_or(modules[module].thermistor_curve);
}

double World::cell_sensor_Ohm(std::size_t module, std::size_t sensor) {
  const double felt_Ohm = thermistor_Ohm(fitted_curve(module), felt_by_C(module, sensor));
  return read_Ohm(module_senses[module].thermistors[sensor], felt_Ohm);
}

double World::board_sensor_Ohm(std::size_t module, std::size_t sensor) {
  ModuleSense& sense = module_senses[module];
  const double board_dC = sense.board_temperature_dC.value_or(plant.board_C(module) * kelvin_to_tenths);
  return read_Ohm(sense.board_thermistors[sensor], thermistor_Ohm(fitted_curve(module), board_dC / kelvin_to_tenths));
}

void World::measure_thermistors(std::size_t module, FrontEndInputs& chip) {
  const std::size_t cell_sensors = modules[module].temperature_sensor_count;
  for (std::size_t sensor = 0; sensor < cell_sensors; ++sensor) {
    chip.cell_sensor_Ohm[sensor] = cell_sensor_Ohm(module, sensor);
  }
  for (std::size_t sensor = 0; sensor < mmu_board_temperatures; ++sensor) {
    chip.board_sensor_Ohm[sensor] = board_sensor_Ohm(module, sensor);
  }
}

PduMeasurements World::measure_pdu() const {
  PduMeasurements measured;
  measured.feedback = plant.feedback();
  measured.inputs = inputs;
  measured.inputs.insulation_monitor_ok = insulation.is_status_ok;
  measured.insulation = insulation.pwm;
  measured.alarm_loop_open =
      has_alarm_loop && std::find(module_alarms.begin(), module_alarms.end(), true) != module_alarms.end();
  measured.throttle_permille = throttle_permille ? known(std::lround(*throttle_permille)) : not_known();
  if (intake_air_dC) measured.intake_air_dC = known(std::lround(*intake_air_dC));
  return measured;
}

std::int32_t World::sense_result(ScriptedResult result, double real) const {
  const SensorSense& sense = sense_of(result);
  const double wired = sense.is_inverted ? -real : real;
  return rounded(sense.value.value_or(wired * sense.gain + sense.offset));
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

SimulatorConfig World::described() const {
  SimulatorConfig config;
  config.modules = modules;
  config.sensor.has_second = has_second_sensor;
  config.sensor_set_up = sensor_unit.driver();
  config.request_id = static_cast<std::uint16_t>(requester.request_id());
  config.charger = can_chargers.driver();
  config.charger_units = can_chargers.unit_count();
  config.inverter = inverter.driver();
  config.insulation = can_insulation.driver();
  config.second_pack = second_pack.config();
  return config;
}

double World::second_pack_rest_mV() const {
  return plant.ocv_V(second_pack.soc_permille / 1e3) * 1e3 * static_cast<double>(second_pack.cell_count());
}

SensorMeasurements World::measure_second_sensor() {
  using enum ScriptedResult;
  SensorMeasurements measured;
  const double direction = is_second_reversed ? -1.0 : 1.0;
  measured.current_mA =
      sense_result(current_2, direction * plant.current_A() * 1e3 + random_.within(current_noise_mA_));
  measured.has_error[static_cast<std::size_t>(SensorChannel::current)] = sense_of(current_2).has_error;
  return measured;
}

}  // namespace bmu

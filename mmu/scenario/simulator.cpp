#include "mmu/scenario/simulator.hpp"

#include <algorithm>
#include <utility>

namespace bmu {

namespace {

/// Insertion sort: stable (two responses of one module stay in order), and needs no memory.
void sort_by_identifier(std::span<SentFrame> frames) {
  const auto before = [](const SentFrame& one, const SentFrame& other) { return one.frame.id < other.frame.id; };
  for (auto next = frames.begin(); next != frames.end(); ++next) {
    std::rotate(std::upper_bound(frames.begin(), next, *next, before), next, next + 1);
  }
}

constexpr std::uint32_t stranger_serial_base = 900'000;

/// Front-end transfer of a module that is not of the pack, with its own cells.
FrontEndTransfer stranger_transfer() {
  constexpr double warm_C = 25.0;
  FrontEndInputs inputs;
  inputs.cell_voltage_uV.fill(3'600'000);
  inputs.module_mV = 3'600 * static_cast<std::int32_t>(mmu_cells_max);
  inputs.cell_sensor_Ohm.fill(thermistor_Ohm(ThermistorCurve::table, warm_C));
  inputs.board_sensor_Ohm.fill(thermistor_Ohm(ThermistorCurve::table, warm_C));
  return convert(inputs, TransferWanted::everything);
}

/// The results that a script can change, by identifier: those of the first sensor are consecutive.
std::optional<ScriptedResult> scripted_result(std::uint32_t id) {
  if (id == internal_bus::sensor_current.base_id) return ScriptedResult::current;
  if (id == internal_bus::sensor_u1.base_id) return ScriptedResult::pack_voltage;
  if (id == internal_bus::sensor_u2.base_id) return ScriptedResult::link_voltage;
  if (id == internal_bus::sensor_current_2.base_id) return ScriptedResult::current_2;
  return std::nullopt;
}

bool is_command(const CanFrame& frame) {
  return internal_bus::catalogue.find(frame.id).message == &internal_bus::command;
}

const Catalogue& catalogue_of(const SimulatorConfig& config) {
  return config.sensor.little_endian ? internal_bus::catalogue_little_endian_sensor : internal_bus::catalogue;
}

}  // namespace

Simulator::Simulator(const SimulatorConfig& config, Scenario scenario, TimePoint started_at)
    : world_(config, started_at),
      player_(meant_for(config, std::move(scenario)), config.seed, started_at, catalogue_of(config)),
      random_(config.seed),
      now_(started_at),
      foreign_(config.foreign),
      pdu_(started_at),
      sensor_(config.sensor, started_at),
      second_sensor_(config.sensor, started_at, SensorPlace::second),
      served_by_(config.served_by),
      sees_second_pack_(config.second_pack.base_id != config.report_base_id) {
  const std::size_t modules = config.modules.size();
  mmus_.reserve(modules);
  can_modules_.reserve(modules);
  for (const MmuConfig& module : config.modules) {
    if (foreign_.driver == nullptr) {
      mmus_.emplace_back(module, started_at);
    } else {
      can_modules_.emplace_back(foreign_, module.node, can_modules_.size(), started_at);
    }
  }
  wires_.resize(mmus_.size());
  strangers_.resize(internal_bus::node_count_max + 1U);
  sent_.reserve(4096);
  sent_by_charger_.reserve(64);
  sent_by_inverter_.reserve(64);
  sent_by_second_pack_.reserve(64);
  sent_by_vehicle_.reserve(64);
}

void Simulator::observe(const CanFrame& frame, TimePoint now) {
  ++frames_observed_;
  pdu_.observe(frame, now);
  world_.sensor_unit.observe(frame, now);
  world_.second_sensor_unit.observe(frame, now);
  for (std::size_t module = 0; module < mmus_.size(); ++module) {
    const bool ignores = world_.module_senses[module].ignores_commands && is_command(frame);
    const bool is_deaf = ignores || !world_.has_bus_power(module);
    if (!is_deaf) mmus_[module].observe(frame, now);
  }
  for (CanModule& module : can_modules_) module.observe(frame, now);
  for (std::optional<Mmu>& stranger : strangers_) {
    if (stranger) stranger->observe(frame, now);
  }
  hear(Port::internal, frame, now);
}

void Simulator::observe_elsewhere(Port bus, const CanFrame& frame, TimePoint now) {
  world_.inverter.observe(frame, now);
  hear(bus, frame, now);
}

/// Passes a frame to devices that may be on any bus. A charger that is not controlled over a bus takes the vehicle's
/// limit from any bus that carries it.
void Simulator::hear(Port bus, const CanFrame& frame, TimePoint now) {
  world_.charger.observe(frame, now);
  if (is_on(bus, Port::charger)) world_.can_chargers.observe(frame, now);
  player_.see(frame, now);
}

std::span<const SentFrame> Simulator::advance(TimePoint now) {
  sent_.clear();
  sent_by_charger_.clear();
  sent_by_inverter_.clear();
  sent_by_second_pack_.clear();
  sent_by_vehicle_.clear();
  player_.forget_news();
  while (now_ + Plant::step_length <= now) step();
  frames_sent_ += sent_.size();
  return sent_;
}

bool Simulator::is_busy() const {
  const auto is_answering = [](const auto& unit) { return unit.is_answering(); };
  return std::any_of(mmus_.begin(), mmus_.end(), is_answering) ||
         std::any_of(wires_.begin(), wires_.end(), [](const ModuleWire& wire) { return wire.is_sending(); }) ||
         std::any_of(can_modules_.begin(), can_modules_.end(), is_answering) ||
         std::any_of(strangers_.begin(), strangers_.end(),
                     [](const std::optional<Mmu>& stranger) { return stranger && stranger->is_answering(); }) ||
         world_.sensor_unit.is_answering() || world_.second_sensor_unit.is_answering() ||
         sensor_.is_faster_than(calm_step) || second_sensor_.is_faster_than(calm_step);
}

void Simulator::step() {
  player_.take_due(now_, world_);
  now_ += Plant::step_length;
  world_.step(now_);
  const std::size_t first = sent_.size();
  tick_pdu();
  tick_mmus();
  tick_can_modules();
  tick_strangers();
  tick_sensors();
  tick_foreign_sensors();
  tick_chargers();
  tick_inverter();
  tick_second_pack();
  tick_requester();
  sort_by_identifier(std::span(sent_).subspan(first));
  if (sent_.size() > first) wake_sleepers(sent_[first].frame);
  for (const SentFrame& sent : std::span(sent_).subspan(first)) player_.see(sent.frame, now_);
  player_.look(now_, world_);
}

void Simulator::tick_mmus() {
  for (std::size_t module = 0; module < mmus_.size(); ++module) {
    Mmu& mmu = mmus_[module];
    ModuleSense& sense = world_.module_senses[module];
    if (std::exchange(sense.is_restart_wanted, false)) mmu.restart(now_);
    mmu.set_thermistor_curve(world_.modules[module].thermistor_curve);
    const MmuFrames frames = mmu.tick(now_, world_.measure_module(module, mmu.wants(now_)));
    world_.module_modes[module] = mmu.mode();
    world_.module_alarms[module] = mmu.is_alarm_given(now_);
    set_switches(module, mmu.balancing_cells());
    ModuleWireFaults faults = sense.wire;
    faults.is_silent = faults.is_silent || !world_.has_bus_power(module);
    ModuleWire& wire = wires_[module];
    wire.push(frames, faults, now_);
    while (const std::optional<CanFrame> frame = wire.pop(now_)) send(*frame);
  }
}

void Simulator::tick_can_modules() {
  for (std::size_t module = 0; module < can_modules_.size(); ++module) {
    CanModule& unit = can_modules_[module];
    if (unit.is_sample_due(now_)) unit.sample(world_.measure_foreign(module), now_);
    set_switches(module, unit.bleeding_cells());
    unit.tick(world_.module_senses[module].wire, now_);
    world_.module_modes[module] = unit.mode();
    while (const std::optional<CanFrame> frame = unit.pop(now_)) send(*frame);
  }
}

/// Applies the switches that the module commands: the actual switches, and the state that the module reads back.
void Simulator::set_switches(std::size_t module, CellMask wanted) {
  const CellMask switches = world_.switches_on(module, wanted);
  world_.plant.set_balancing(module, world_.bled_cells(module, switches));
  world_.module_senses[module].wire.balancing_cells =
      world_.has_switch_fault(module) ? std::optional(switches) : std::nullopt;
}

/// Powered when it is connected. On a node of the pack both answer.
void Simulator::tick_strangers() {
  static const FrontEndTransfer transfer = stranger_transfer();
  for (std::size_t node = 1; node < strangers_.size(); ++node) {
    std::optional<Mmu>& stranger = strangers_[node];
    if (!world_.has_stranger[node]) {
      stranger.reset();
      continue;
    }
    const auto number = static_cast<std::uint8_t>(node);
    if (!stranger) stranger.emplace(MmuConfig{.node = number, .serial_number = stranger_serial_base + number}, now_);
    for (const CanFrame& frame : stranger->tick(now_, transfer)) send(frame);
  }
}

/// Any frame on the bus wakes modules, and keeps those awake that wait for a master; otherwise a module receives only
/// frames of its master.
void Simulator::wake_sleepers(const CanFrame& frame) {
  for (std::size_t module = 0; module < mmus_.size(); ++module) {
    Mmu& mmu = mmus_[module];
    if (mmu.hears_traffic() && world_.has_bus_power(module)) mmu.observe(frame, now_);
  }
  for (std::optional<Mmu>& stranger : strangers_) {
    if (stranger && stranger->hears_traffic()) stranger->observe(frame, now_);
  }
}

void Simulator::tick_pdu() {
  const PduFrames frames = pdu_.tick(now_, world_.measure_pdu());
  world_.plant.drive(pdu_.outputs().contactors);
  if (world_.is_pdu_silent) return;
  for (CanFrame frame : frames) {
    if (world_.has_pdu_damaged_frames) frame.data[7] ^= 0x55U;
    send(frame);
  }
}

/// Its results follow its present configuration.
void Simulator::tick_sensor_unit(SensorUnit& unit, CurrentSensor& sensor) {
  if (!unit.is_there()) return;
  if (const std::optional<CanFrame> answer = unit.tick(now_)) send(*answer);
  for (std::size_t index = 0; index < sensor_channel_count; ++index) {
    const auto channel = static_cast<SensorChannel>(index);
    const SensorSetting& setting = unit.setting(set_up_channel(channel));
    const bool is_sent = unit.is_running() && setting.trigger == SensorTrigger::cyclic;
    const Duration period = is_sent ? std::chrono::milliseconds{setting.period_ms} : Duration{};
    sensor.configure(channel, setting.is_little_endian, setting.is_inverted, period, now_);
  }
}

void Simulator::tick_sensors() {
  tick_sensor_unit(world_.sensor_unit, sensor_);
  tick_sensor_unit(world_.second_sensor_unit, second_sensor_);
  const bool is_first_elsewhere = world_.first_current.is_there();
  SensorMeasurements measured = world_.measure_sensor();
  if (is_first_elsewhere) {
    const SensorMeasurements second = world_.measure_second_sensor();
    measured.current_mA = second.current_mA;
    measured.has_error[0] = second.has_error[0];
  }
  for (const CanFrame& frame : sensor_.tick(now_, measured)) {
    std::optional<ScriptedResult> result = scripted_result(frame.id);
    const bool is_current = result == ScriptedResult::current;
    if (is_current && is_first_elsewhere && !world_.has_second_sensor) continue;
    if (is_current && is_first_elsewhere) result = ScriptedResult::current_2;
    if (result) {
      send_result(frame, *result);
    } else {
      send(frame);
    }
  }
  const bool has_own_second = !is_first_elsewhere && !world_.second_current.is_there();
  if (!world_.has_second_sensor || !has_own_second) return;
  for (const CanFrame& frame : second_sensor_.tick(now_, world_.measure_second_sensor())) {
    send_result(frame, ScriptedResult::current_2);
  }
}

void Simulator::tick_foreign_sensors() {
  const auto tick = [this](ForeignSensor& sensor, const SensorMeasurements& measured, ScriptedResult result) {
    const SensorSense& sense = world_.sense_of(result);
    const std::optional<CanFrame> frame = sensor.tick(now_, measured, sense.is_stuck);
    if (frame && !sense.is_silent) send(*frame);
  };
  if (world_.first_current.is_there()) tick(world_.first_current, world_.measure_sensor(), ScriptedResult::current);
  if (world_.second_current.is_there()) {
    tick(world_.second_current, world_.measure_second_sensor(), ScriptedResult::current_2);
  }
  if (const auto report = world_.can_insulation.tick(now_, world_.insulation.resistance_kOhm)) send(*report);
}

/// Unplugged chargers may still have mains, and send.
void Simulator::tick_chargers() {
  const Plant& plant = world_.plant;
  const bool is_with_modules = is_on(Port::internal, Port::charger);
  for (const CanFrame& frame : world_.can_chargers.report(now_, plant.charger_V(), plant.charger_A())) {
    if (is_with_modules) {
      send(frame);
    } else {
      sent_by_charger_.push_back({now_, frame});
      player_.see(frame, now_);
    }
  }
}

/// Its identifiers are those of the modules' answers: it is on none of their buses.
void Simulator::tick_inverter() {
  for (const CanFrame& frame : world_.inverter.words(now_, world_.plant.link_V())) {
    sent_by_inverter_.push_back({now_, frame});
    player_.see(frame, now_);
  }
}

/// On a bus of its own its identifiers may be those of the master's messages: a condition then refers to the master's.
void Simulator::tick_second_pack() {
  const std::optional<CanFrame> frame = world_.second_pack.tick(now_, world_.second_pack_rest_mV());
  if (!frame) return;
  sent_by_second_pack_.push_back({now_, *frame});
  if (sees_second_pack_) player_.see(*frame, now_);
}

/// One question per step, because the identifier is the same.
void Simulator::tick_requester() {
  const std::optional<CanFrame> frame = world_.requester.take();
  if (!frame) return;
  if (is_on(Port::internal, Port::vehicle)) return send(*frame);
  sent_by_vehicle_.push_back({now_, *frame});
  player_.see(*frame, now_);
}

/// A stuck result keeps its value to the last bit; flags and counter continue.
void Simulator::send_result(const CanFrame& frame, ScriptedResult result) {
  constexpr std::size_t value_at = 2;
  constexpr std::size_t value_bytes = 4;
  const SensorSense& sense = world_.sense_of(result);
  FrameBytes& last = last_results_[static_cast<std::size_t>(result)];
  CanFrame sent = frame;
  if (sense.is_stuck) {
    std::copy_n(last.begin() + value_at, value_bytes, sent.data.begin() + value_at);
  } else {
    last = frame.data;
  }
  if (!sense.is_silent) send(sent);
}

void Simulator::send(const CanFrame& frame) {
  sent_.push_back({now_, frame});
}

Result<void, ScenarioProblem> Simulator::apply(std::string_view text) {
  Result<ScenarioEvent, ScenarioProblem> event = parse_event(text);
  if (!event) return failure(event.error());
  const ScenarioLine line{.line = 1, .column = 1, .event = std::move(*event), .text = std::string(text)};
  SimulatorConfig pack = world_.described();
  pack.foreign = foreign_;
  const ScenarioProblems problems = check_against(Scenario{{line}}, pack);
  if (!problems.empty()) return failure(problems.front());
  ScenarioEvent drawn = line.event;
  draw_value(random_, drawn);
  world_.apply(drawn, now_);
  return {};
}

SimulatorCounts Simulator::counts() const {
  SimulatorCounts counts{.frames_observed = frames_observed_,
                         .frames_sent = frames_sent_,
                         .contactor_commands = pdu_.counts().commands,
                         .contactor_timeouts = pdu_.counts().timeouts};
  for (const Mmu& mmu : mmus_) {
    counts.polls_answered += mmu.counts().polls_answered;
    counts.answers_cut_short += mmu.counts().answers_cut_short;
  }
  for (const CanModule& module : can_modules_) counts.polls_answered += module.answers_given();
  return counts;
}

// --- from a pack file -----------------------------------------------------------------------------------------------

namespace {

constexpr double seconds_per_month = 30.0 * 86'400.0;

CellPhysics physics_of(const CellModel& model) {
  CellPhysics physics;
  for (std::size_t permille = 0; permille < CellPhysics::ocv_points; ++permille) {
    physics.ocv_V[permille] = ocv_uV(model, static_cast<double>(permille)) * 1e-6;
  }
  physics.capacity_As = static_cast<double>(model.capacity_uAs) * 1e-6;
  physics.series_resistance_Ohm = model.series_resistance_Ohm;
  physics.rc = {RcPair{model.rc_resistance_Ohm, model.rc_time_constant_s > 0.0 ? model.rc_time_constant_s : 1.0},
                RcPair{model.slow_rc_resistance_Ohm, model.slow_rc_time_constant_s}};
  physics.resistance_activation_K = model.resistance_activation_K;
  physics.hysteresis_V = model.hysteresis_V;
  physics.hysteresis_charge = model.hysteresis_charge_permille * 1e-3;
  physics.self_discharge_per_s = model.self_discharge_permille_per_month * 1e-3 / seconds_per_month;
  physics.heat_capacity_J_per_K = model.heat_capacity_J_per_K > 0.0 ? model.heat_capacity_J_per_K : 1e3;
  physics.heat_transfer_W_per_K = model.heat_transfer_W_per_K;
  physics.voltage_max_V = V_from_uV(model.voltage_max_uV);
  return physics;
}

std::uint8_t board_sensors_of(const ModuleDriver* driver) {
  if (driver == nullptr) return MmuConfig{}.board_sensor_count;
  return driver->has_board_temperature ? 1 : 0;
}

}  // namespace

SimulatorConfig simulator_config(const CoreConfig& pack) {
  constexpr std::uint32_t serial_base = 1000;
  SimulatorConfig config;
  config.plant.cell = physics_of(pack.cell);
  config.foreign.driver = pack.foreign.driver;
  config.foreign.options = pack.foreign.options;
  const std::uint8_t board_sensors = board_sensors_of(pack.foreign.driver);
  for (const ModuleConfig& module : pack.modules) {
    config.modules.push_back({.node = module.node,
                              .cell_count = module.cell_count,
                              .temperature_sensor_count = module.temperature_sensor_count,
                              .board_sensor_count = board_sensors,
                              .serial_number = serial_base + module.node,
                              .alarm_temperature_dC = pack.limits.cell_overtemperature.open});
    config.plant.cells_of_module.push_back(module.cell_count);
  }
  config.sensor.little_endian = pack.sensor.little_endian;
  config.sensor.invert_current = pack.sensor.invert_current;
  config.sensor.has_second = pack.sensor.has_second_current;
  config.report_base_id = pack.vehicle.base_id;
  config.charger = pack.charger.driver;
  config.charger_units = pack.charger.unit_count;
  config.served_by = pack.served_by;
  config.request_id = pack.vehicle.request_id;
  config.inverter = pack.inverter.driver;
  config.second_pack = pack.second_pack;
  config.sensor_set_up = pack.sensor.set_up;
  config.second_command_id = pack.sensor.second_command_id;
  config.second_response_id = pack.sensor.second_response_id;
  config.first_current = pack.sensor.first;
  config.second_current = pack.sensor.second;
  config.is_second_reversed = pack.sensor.is_second_reversed;
  config.insulation = pack.insulation.driver;
  config.plant.balancing_resistance_Ohm = pack.balancing.bleed_resistance_Ohm;
  config.plant.has_charge_contactor = pack.contactors.has_charge_contactor;
  return config;
}

}  // namespace bmu

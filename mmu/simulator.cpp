#include "mmu/simulator.hpp"

#include <algorithm>
#include <utility>

namespace bmu {

namespace {

/// Insertion, because it is stable (two responses of one module stay in order) and needs no memory.
void sort_by_identifier(std::span<SentFrame> frames) {
  const auto before = [](const SentFrame& one, const SentFrame& other) { return one.frame.id < other.frame.id; };
  for (auto next = frames.begin(); next != frames.end(); ++next) {
    std::rotate(std::upper_bound(frames.begin(), next, *next, before), next, next + 1);
  }
}

constexpr std::uint32_t stranger_serial_base = 900'000;

/// What a module that is not of the pack has on its own cells.
FrontEndTransfer stranger_transfer() {
  constexpr double warm_C = 25.0;
  FrontEndInputs inputs;
  inputs.cell_voltage_uV.fill(3'600'000);
  inputs.module_mV = 3'600 * static_cast<std::int32_t>(mmu_cells_max);
  inputs.cell_sensor_Ohm.fill(thermistor_Ohm(ThermistorCurve::table, warm_C));
  inputs.board_sensor_Ohm.fill(thermistor_Ohm(ThermistorCurve::table, warm_C));
  return convert(inputs, TransferWanted::everything);
}

/// The results a script can change, by identifier: those of the first sensor lie side by side.
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
      player_(std::move(scenario), config.seed, started_at, catalogue_of(config)),
      random_(config.seed),
      now_(started_at),
      pdu_(started_at),
      sensor_(config.sensor, started_at),
      second_sensor_(config.sensor, started_at, SensorUnit::second) {
  mmus_.reserve(config.modules.size());
  for (const MmuConfig& module : config.modules) mmus_.emplace_back(module, started_at);
  wires_.resize(config.modules.size());
  strangers_.resize(internal_bus::node_count_max + 1U);
  sent_.reserve(4096);
}

void Simulator::observe(const CanFrame& frame, TimePoint now) {
  ++frames_observed_;
  pdu_.observe(frame, now);
  for (std::size_t module = 0; module < mmus_.size(); ++module) {
    const bool is_deaf = world_.module_senses[module].ignores_commands && is_command(frame);
    if (!is_deaf) mmus_[module].observe(frame, now);
  }
  for (std::optional<Mmu>& stranger : strangers_) {
    if (stranger) stranger->observe(frame, now);
  }
  observe_elsewhere(frame, now);
}

void Simulator::observe_elsewhere(const CanFrame& frame, TimePoint now) {
  world_.charger.observe(frame, now);
  player_.see(frame, now);
}

std::span<const SentFrame> Simulator::advance(TimePoint now) {
  sent_.clear();
  player_.forget_news();
  while (now_ + Plant::step_length <= now) step();
  frames_sent_ += sent_.size();
  return sent_;
}

void Simulator::step() {
  player_.take_due(now_, world_);
  now_ += Plant::step_length;
  world_.step(now_);
  const std::size_t first = sent_.size();
  tick_pdu();
  tick_modules();
  tick_strangers();
  tick_sensors();
  sort_by_identifier(std::span(sent_).subspan(first));
  if (sent_.size() > first) wake_sleepers(sent_[first].frame);
  for (const SentFrame& sent : std::span(sent_).subspan(first)) player_.see(sent.frame, now_);
  player_.look(now_, world_);
}

void Simulator::tick_modules() {
  for (std::size_t module = 0; module < mmus_.size(); ++module) {
    Mmu& mmu = mmus_[module];
    ModuleSense& sense = world_.module_senses[module];
    if (std::exchange(sense.is_restart_wanted, false)) mmu.restart(now_);
    mmu.set_thermistor_curve(world_.modules[module].thermistor_curve);
    const MmuFrames frames = mmu.tick(now_, world_.measure_module(module, mmu.wants(now_)));
    world_.module_modes[module] = mmu.mode();
    const CellMask switches = world_.switches_on(module, mmu.balancing_cells());
    world_.plant.set_balancing(module, world_.bled_cells(module, switches));
    sense.wire.balancing_cells = world_.has_switch_fault(module) ? std::optional(switches) : std::nullopt;
    ModuleWire& wire = wires_[module];
    wire.push(frames, sense.wire, now_);
    while (const std::optional<CanFrame> frame = wire.pop(now_)) send(*frame);
  }
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

/// All that wakes, and keeps awake who waits for a master, is that something is on the bus; otherwise a module listens
/// to its master alone.
void Simulator::wake_sleepers(const CanFrame& frame) {
  for (Mmu& mmu : mmus_) {
    if (mmu.hears_traffic()) mmu.observe(frame, now_);
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

void Simulator::tick_sensors() {
  for (const CanFrame& frame : sensor_.tick(now_, world_.measure_sensor())) {
    if (const std::optional<ScriptedResult> result = scripted_result(frame.id)) {
      send_result(frame, *result);
    } else {
      send(frame);
    }
  }
  if (!world_.has_second_sensor) return;
  for (const CanFrame& frame : second_sensor_.tick(now_, world_.measure_second_sensor())) {
    send_result(frame, ScriptedResult::current_2);
  }
}

/// A stuck result keeps its value to the last bit; flags and counter go on.
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
  SimulatorConfig pack;
  pack.modules = world_.modules;
  pack.sensor.has_second = world_.has_second_sensor;
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

}  // namespace

SimulatorConfig simulator_config(const CoreConfig& pack) {
  constexpr std::uint32_t serial_base = 1000;
  SimulatorConfig config;
  config.plant.cell = physics_of(pack.cell);
  for (const ModuleConfig& module : pack.modules) {
    config.modules.push_back({.node = module.node,
                              .cell_count = module.cell_count,
                              .temperature_sensor_count = module.temperature_sensor_count,
                              .serial_number = serial_base + module.node});
    config.plant.cells_of_module.push_back(module.cell_count);
  }
  config.sensor.little_endian = pack.sensor.little_endian;
  config.sensor.invert_current = pack.sensor.invert_current;
  config.sensor.has_second = pack.sensor.has_second_current;
  config.report_base_id = pack.vehicle.base_id;
  config.plant.balancing_resistance_Ohm = pack.balancing.bleed_resistance_Ohm;
  config.plant.has_charge_contactor = pack.contactors.has_charge_contactor;
  return config;
}

namespace {

/// What the line names; null for lines that name nothing of the pack.
struct Named {
  TargetKind target{};
  ScenarioPlace place{};
};
std::optional<Named> named_by(const ScenarioLine& line) {
  if (line.verb == ScenarioVerb::event) return Named{spec_of(line.event.property).target, line.event.place};
  if (line.condition.state != nullptr) return Named{line.condition.state->target, line.condition.place};
  return std::nullopt;
}

/// Empty if the pack has it, else what would have been right.
std::string wanted_instead(const Named& named, const SimulatorConfig& config) {
  const ScenarioPlace place = named.place;
  const bool is_second_sensor =
      named.target == TargetKind::sensor && place.index == static_cast<std::uint8_t>(ScriptedResult::current_2);
  if (is_second_sensor && !config.sensor.has_second) {
    return "a sensor this pack has: it has no second current sensor";
  }
  if (place.node == 0 || named.target == TargetKind::stranger) return "";
  const auto module = std::find_if(config.modules.begin(), config.modules.end(),
                                   [place](const MmuConfig& one) { return one.node == place.node; });
  if (module == config.modules.end()) {
    return "a module this pack has: it has no node " + std::to_string(place.node);
  }
  if (named.target == TargetKind::cell && place.index >= module->cell_count) {
    return "cell 1 to " + std::to_string(module->cell_count) + " of that module";
  }
  if (named.target == TargetKind::thermistor && place.index >= module->temperature_sensor_count) {
    return "sensor 1 to " + std::to_string(module->temperature_sensor_count) + " of that module";
  }
  if (named.target == TargetKind::board_thermistor && place.index >= module->board_sensor_count) {
    return "sensor 1 to " + std::to_string(module->board_sensor_count) + " on that module's board";
  }
  return "";
}

}  // namespace

ScenarioProblems check_against(const Scenario& scenario, const SimulatorConfig& config) {
  ScenarioProblems problems;
  for (const ScenarioLine& line : scenario.lines) {
    const std::optional<Named> named = named_by(line);
    if (!named) continue;
    std::string wanted = wanted_instead(*named, config);
    if (!wanted.empty()) problems.push_back({line.line, line.column, "'" + line.text + "'", std::move(wanted)});
  }
  return problems;
}

}  // namespace bmu

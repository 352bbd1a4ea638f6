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
constexpr MmuMeasurements stranger_measurements() {
  MmuMeasurements measured;
  measured.cell_voltage_uV.fill(3'600'000);
  measured.measured_cells = first_cells(mmu_cells_max);
  measured.module_mV = 3'600 * static_cast<std::int32_t>(mmu_cells_max);
  measured.cell_temperature_dC.fill(known(250));
  measured.board_temperature_dC.fill(known(250));
  return measured;
}

/// The results a script can change, by identifier: those of the first sensor lie side by side.
std::optional<ScriptedResult> scripted_result(std::uint32_t id) {
  if (id == internal_bus::sensor_current.base_id) return ScriptedResult::current;
  if (id == internal_bus::sensor_u1.base_id) return ScriptedResult::pack_voltage;
  if (id == internal_bus::sensor_u2.base_id) return ScriptedResult::link_voltage;
  if (id == internal_bus::sensor_current_2.base_id) return ScriptedResult::current_2;
  return std::nullopt;
}

}  // namespace

Simulator::Simulator(const SimulatorConfig& config, Scenario scenario, TimePoint started_at)
    : world_(config, started_at),
      scenario_(std::move(scenario)),
      started_at_(started_at),
      now_(started_at),
      pdu_(started_at),
      sensor_(config.sensor, started_at),
      second_sensor_(config.sensor, started_at, SensorUnit::second) {
  mmus_.reserve(config.modules.size());
  for (const MmuConfig& module : config.modules) mmus_.emplace_back(module, started_at);
  wires_.resize(config.modules.size());
  strangers_.resize(internal_bus::node_count_max + 1U);
  sent_.reserve(4096);
  applied_.reserve(64);
}

void Simulator::observe(const CanFrame& frame, TimePoint now) {
  ++frames_observed_;
  pdu_.observe(frame, now);
  for (Mmu& mmu : mmus_) mmu.observe(frame, now);
  for (std::optional<Mmu>& stranger : strangers_) {
    if (stranger) stranger->observe(frame, now);
  }
}

std::span<const SentFrame> Simulator::advance(TimePoint now) {
  sent_.clear();
  applied_.clear();
  while (now_ + Plant::step_length <= now) step();
  frames_sent_ += sent_.size();
  return sent_;
}

void Simulator::step() {
  apply_due_events();
  now_ += Plant::step_length;
  world_.step(now_);
  const std::size_t first = sent_.size();
  tick_pdu();
  tick_modules();
  tick_strangers();
  tick_sensors();
  sort_by_identifier(std::span(sent_).subspan(first));
  if (sent_.size() > first) wake_sleepers(sent_[first].frame);
}

void Simulator::apply_due_events() {
  while (!is_script_over() && scenario_.events[next_event_].at <= now_ - started_at_) {
    const ScenarioEvent& event = scenario_.events[next_event_++];
    world_.apply(event, now_);
    applied_.push_back(&event);
  }
}

void Simulator::tick_modules() {
  static constexpr MmuMeasurements nothing_due{};
  for (std::size_t module = 0; module < mmus_.size(); ++module) {
    Mmu& mmu = mmus_[module];
    ModuleSense& sense = world_.module_senses[module];
    if (std::exchange(sense.is_restart_wanted, false)) mmu.restart(now_);
    const bool is_due = mmu.is_sample_due(now_);
    const MmuFrames frames = mmu.tick(now_, is_due ? world_.measure_module(module) : nothing_due);
    world_.plant.set_balancing(module, mmu.balancing_cells());
    ModuleWire& wire = wires_[module];
    wire.push(frames, sense.wire, now_);
    while (const std::optional<CanFrame> frame = wire.pop(now_)) send(*frame);
  }
}

/// Powered when it is connected. On a node of the pack both answer.
void Simulator::tick_strangers() {
  static constexpr MmuMeasurements measured = stranger_measurements();
  for (std::size_t node = 1; node < strangers_.size(); ++node) {
    std::optional<Mmu>& stranger = strangers_[node];
    if (!world_.has_stranger[node]) {
      stranger.reset();
      continue;
    }
    const auto number = static_cast<std::uint8_t>(node);
    if (!stranger) stranger.emplace(MmuConfig{.node = number, .serial_number = stranger_serial_base + number}, now_);
    for (const CanFrame& frame : stranger->tick(now_, measured)) send(frame);
  }
}

/// All that wakes is that something is on the bus; awake, a module listens to its master alone.
void Simulator::wake_sleepers(const CanFrame& frame) {
  for (Mmu& mmu : mmus_) {
    if (mmu.is_asleep()) mmu.observe(frame, now_);
  }
  for (std::optional<Mmu>& stranger : strangers_) {
    if (stranger && stranger->is_asleep()) stranger->observe(frame, now_);
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
  Scenario alone;
  alone.events.push_back(std::move(*event));
  SimulatorConfig pack;
  pack.modules = world_.modules;
  pack.sensor.has_second = world_.has_second_sensor;
  const ScenarioProblems problems = check_against(alone, pack);
  if (!problems.empty()) return failure(problems.front());
  world_.apply(alone.events.front(), now_);
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

CellPhysics physics_of(const CellModel& model) {
  CellPhysics physics;
  for (std::size_t permille = 0; permille < CellPhysics::ocv_points; ++permille) {
    physics.ocv_V[permille] = ocv_uV(model, static_cast<double>(permille)) * 1e-6;
  }
  physics.capacity_As = static_cast<double>(model.capacity_uAs) * 1e-6;
  physics.series_resistance_Ohm = model.series_resistance_Ohm;
  physics.rc_resistance_Ohm = model.rc_resistance_Ohm;
  physics.rc_time_constant_s = model.rc_time_constant_s > 0.0 ? model.rc_time_constant_s : 1.0;
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
  config.plant.has_charge_contactor = pack.contactors.has_charge_contactor;
  return config;
}

ScenarioProblems check_against(const Scenario& scenario, const SimulatorConfig& config) {
  ScenarioProblems problems;
  for (const ScenarioEvent& event : scenario.events) {
    const TargetKind target = spec_of(event.property).target;
    const auto add = [&](std::string wanted) {
      problems.push_back({event.line, event.target_column, "'" + event.text + "'", std::move(wanted)});
    };
    const bool is_second_sensor =
        target == TargetKind::sensor && event.place.index == static_cast<std::uint8_t>(ScriptedResult::current_2);
    if (is_second_sensor && !config.sensor.has_second) add("a sensor this pack has: it has no second current sensor");
    if (event.place.node == 0 || target == TargetKind::stranger) continue;
    const auto module = std::find_if(config.modules.begin(), config.modules.end(),
                                     [&event](const MmuConfig& one) { return one.node == event.place.node; });
    const bool is_cell = target == TargetKind::cell;
    if (module == config.modules.end()) {
      add("a module this pack has: it has no node " + std::to_string(event.place.node));
    } else if (is_cell && event.place.index >= module->cell_count) {
      add("cell 1 to " + std::to_string(module->cell_count) + " of that module");
    } else if (target == TargetKind::thermistor && event.place.index >= module->temperature_sensor_count) {
      add("sensor 1 to " + std::to_string(module->temperature_sensor_count) + " of that module");
    }
  }
  return problems;
}

}  // namespace bmu

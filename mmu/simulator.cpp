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

}  // namespace

Simulator::Simulator(const SimulatorConfig& config, Scenario scenario, TimePoint started_at)
    : world_(config),
      scenario_(std::move(scenario)),
      started_at_(started_at),
      now_(started_at),
      pdu_(started_at),
      sensor_(config.sensor, started_at) {
  mmus_.reserve(config.modules.size());
  for (const MmuConfig& module : config.modules) mmus_.emplace_back(module, started_at);
  sent_.reserve(4096);
  applied_.reserve(64);
}

void Simulator::observe(const CanFrame& frame, TimePoint now) {
  ++frames_observed_;
  pdu_.observe(frame, now);
  for (Mmu& mmu : mmus_) mmu.observe(frame, now);
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
  tick_sensor();
  sort_by_identifier(std::span(sent_).subspan(first));
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
    if (sense.is_silent) continue;
    for (const CanFrame& frame : frames) send(frame, sense.has_damaged_frames);
  }
}

void Simulator::tick_pdu() {
  const PduFrames frames = pdu_.tick(now_, world_.measure_pdu());
  world_.plant.drive(pdu_.outputs().contactors);
  if (world_.is_pdu_silent) return;
  for (const CanFrame& frame : frames) send(frame, world_.has_pdu_damaged_frames);
}

void Simulator::tick_sensor() {
  const SensorFrames frames = sensor_.tick(now_, world_.measure_sensor());
  for (const CanFrame& frame : frames) {
    const std::size_t channel = frame.id - internal_bus::sensor_current.base_id;
    const bool is_silent = channel < scripted_sensor_channels && world_.sensor_senses[channel].is_silent;
    if (!is_silent) send(frame, false);
  }
}

void Simulator::send(const CanFrame& frame, bool is_damaged) {
  sent_.push_back({now_, frame});
  if (is_damaged) sent_.back().frame.data[7] ^= 0x55U;
}

Result<void, ScenarioProblem> Simulator::apply(std::string_view text) {
  Result<ScenarioEvent, ScenarioProblem> event = parse_event(text);
  if (!event) return failure(event.error());
  Scenario alone;
  alone.events.push_back(std::move(*event));
  SimulatorConfig pack;
  pack.modules = world_.modules;
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
  std::size_t next = 1;
  for (std::size_t permille = 0; permille < CellPhysics::ocv_points; ++permille) {
    while (next + 1 < model.ocv.size() && model.ocv[next].soc_permille < static_cast<std::int32_t>(permille)) ++next;
    const OcvPoint& from = model.ocv[next - 1];
    const OcvPoint& to = model.ocv[next];
    const double share = (static_cast<double>(permille) - from.soc_permille) / (to.soc_permille - from.soc_permille);
    physics.ocv_V[permille] = V_from_uV(from.ocv_uV) + (V_from_uV(to.ocv_uV) - V_from_uV(from.ocv_uV)) * share;
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
  return config;
}

ScenarioProblems check_against(const Scenario& scenario, const SimulatorConfig& config) {
  ScenarioProblems problems;
  for (const ScenarioEvent& event : scenario.events) {
    if (event.place.node == 0) continue;
    const auto module = std::find_if(config.modules.begin(), config.modules.end(),
                                     [&event](const MmuConfig& one) { return one.node == event.place.node; });
    const bool is_cell = spec_of(event.property).target == TargetKind::cell;
    const auto add = [&](std::string wanted) {
      problems.push_back({event.line, event.target_column, "'" + event.text + "'", std::move(wanted)});
    };
    if (module == config.modules.end()) {
      add("a module this pack has: it has no node " + std::to_string(event.place.node));
    } else if (is_cell && event.place.index >= module->cell_count) {
      add("cell 1 to " + std::to_string(module->cell_count) + " of that module");
    } else if (spec_of(event.property).target == TargetKind::thermistor &&
               event.place.index >= module->temperature_sensor_count) {
      add("sensor 1 to " + std::to_string(module->temperature_sensor_count) + " of that module");
    }
  }
  return problems;
}

}  // namespace bmu

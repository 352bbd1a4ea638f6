// The master's partners on the internal bus, in the caller's time: modules (MMUs, or third-party ones), current sensor
// and power distribution unit, with the pack they measure and switch, and a script for all of it.
//
//   Simulator simulator(simulator_config(pack.core), *parse_scenario(text), start);
//   simulator.observe(frame, now);                         a frame of the master, at its time
//   for (const SentFrame& sent : simulator.advance(now))   all whole milliseconds up to now
//     core.observe({sent.at, FrameReceived{Port::internal, sent.frame}});
//   simulator.apply("cell 2.7 voltage_mV 2700");           an event of the script language, at once
//
// The same configuration (its seed draws the script's random numbers too), script and calls give the same frames, bit
// for bit. mmusim drives this with the real clock, the scenario tests with their own. Devices tick at every whole
// millisecond since the start, so an answer is sent at most 1 ms after its POLL if advance() is called that often.
// A frame of any device wakes modules that sleep. Frames of the same millisecond are in the order of their identifiers,
// as by arbitration; there is no bit time, and no limit to the load of the bus.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "daemon/core/types/core_config.hpp"
#include "mmu/scenario/scenario_check.hpp"
#include "mmu/scenario/scenario_player.hpp"
#include "mmu/scenario/world.hpp"

namespace bmu {

struct SentFrame {
  TimePoint at{};
  CanFrame frame;
};

struct SimulatorCounts {
  std::uint64_t frames_observed = 0;
  std::uint64_t frames_sent = 0;
  std::uint64_t polls_answered = 0;  // by all modules together; of third-party modules: questions
  std::uint64_t answers_cut_short = 0;
  std::uint64_t contactor_commands = 0;
  std::uint64_t contactor_timeouts = 0;
};

class Simulator {
 public:
  Simulator(const SimulatorConfig& config, Scenario scenario, TimePoint started_at);

  /// A frame from another node, on the modules' bus. `now` may be between two milliseconds; never before the last one.
  void observe(const CanFrame& frame, TimePoint now);
  /// A frame on another bus than the modules', as given by `served_by`: the devices on that bus receive it, and the
  /// script's conditions.
  void observe_elsewhere(Port bus, const CanFrame& frame, TimePoint now);
  /// While the simulator is not busy, advance() may be called at each whole `calm_step` since the start only: a frame
  /// that is due at such a time, like most periodic ones, is then not late, and everything else (a contact that has
  /// opened, a module that wakes, a result every 7 ms) is sent less than one later. The events themselves occur at
  /// their own times.
  static constexpr Duration calm_step = 5ms;
  /// Whether an answer is in progress, or results are due more often than that.
  [[nodiscard]] bool is_busy() const;
  /// Runs up to `now`. The returned frames, and the script's progress, are valid until the next call.
  std::span<const SentFrame> advance(TimePoint now);
  /// Frames that the chargers sent in it, if they are on another bus than the modules.
  [[nodiscard]] std::span<const SentFrame> sent_by_charger() const { return sent_by_charger_; }
  /// Likewise of the inverter, on its own bus.
  [[nodiscard]] std::span<const SentFrame> sent_by_inverter() const { return sent_by_inverter_; }
  /// Likewise of the device that requests data from the master, on the vehicle's bus if that is another than the
  /// modules'.
  [[nodiscard]] std::span<const SentFrame> sent_by_vehicle() const { return sent_by_vehicle_; }
  /// Likewise of the master of the second pack, on the vehicle's bus or one of its own.
  [[nodiscard]] std::span<const SentFrame> sent_by_second_pack() const { return sent_by_second_pack_; }

  /// Applies one event of the script language without its time, now. A problem changes nothing.
  Result<void, ScenarioProblem> apply(std::string_view event);

  [[nodiscard]] TimePoint now() const { return now_; }
  /// The script: its progress, and its result.
  [[nodiscard]] const ScenarioPlayer& script() const { return player_; }
  [[nodiscard]] ScenarioPlayer& script() { return player_; }
  [[nodiscard]] const World& world() const { return world_; }
  [[nodiscard]] World& world() { return world_; }
  [[nodiscard]] const Plant& plant() const { return world_.plant; }
  /// For MMUs; the next one for third-party modules.
  [[nodiscard]] const Mmu& mmu(std::size_t module) const { return mmus_[module]; }
  [[nodiscard]] const CanModule& can_module(std::size_t module) const { return can_modules_[module]; }
  [[nodiscard]] const Pdu& pdu() const { return pdu_; }
  [[nodiscard]] SimulatorCounts counts() const;

 private:
  void step();
  void tick_mmus();
  void tick_can_modules();
  void set_switches(std::size_t module, CellMask wanted);
  void tick_strangers();
  void wake_sleepers(const CanFrame& frame);
  void tick_pdu();
  void tick_sensors();
  void tick_sensor_unit(SensorUnit& unit, CurrentSensor& sensor);
  void tick_foreign_sensors();
  void tick_chargers();
  void tick_inverter();
  void tick_second_pack();
  void tick_requester();
  void hear(Port bus, const CanFrame& frame, TimePoint now);
  [[nodiscard]] bool is_on(Port bus, Port guest) const { return served_by_[static_cast<std::size_t>(guest)] == bus; }
  void send_result(const CanFrame& frame, ScriptedResult result);
  void send(const CanFrame& frame);

  World world_;
  ScenarioPlayer player_;
  RandomSource random_;  // for events that are applied at once
  TimePoint now_;
  std::vector<Mmu> mmus_;
  std::vector<ModuleWire> wires_;  // of the MMUs
  CanModuleConfig foreign_;
  std::vector<CanModule> can_modules_;
  std::vector<std::optional<Mmu>> strangers_;  // by node
  Pdu pdu_;
  CurrentSensor sensor_;
  CurrentSensor second_sensor_;
  std::array<FrameBytes, scripted_results> last_results_{};
  ServedBy served_by_;
  std::vector<SentFrame> sent_;
  std::vector<SentFrame> sent_by_charger_;
  std::vector<SentFrame> sent_by_inverter_;
  std::vector<SentFrame> sent_by_second_pack_;
  std::vector<SentFrame> sent_by_vehicle_;
  bool sees_second_pack_;  // by the script's conditions
  std::uint64_t frames_observed_ = 0;
  std::uint64_t frames_sent_ = 0;
};

/// The emulated counterpart of a pack: its modules (serial numbers 1000 + node), its type of cell, its sensor's byte
/// order and sign; or third-party devices, as the pack has them. No noise; the caller sets it.
[[nodiscard]] SimulatorConfig simulator_config(const CoreConfig& pack);

}  // namespace bmu

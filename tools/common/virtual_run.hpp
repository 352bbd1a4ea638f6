// A core and the emulated pack around it in virtual time, in one process and without any bus: each observes the frames
// that the other sends. Many times faster than real time; the same configuration, script and seed always give the same
// run.
//
//   VirtualRun run(pack.core, simulator_config(pack.core), scenario);
//   while (!run.simulator().script().is_over()) run.step();
//
// Without a core it is the emulated pack alone, without polls or commands. Frames of the core reach the pack in the
// millisecond they are sent in, and frames of the pack are observed in the next; there is no bus load. The core gets
// its own frames back a millisecond after it has sent them, as from a bus.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "daemon/core/core.hpp"
#include "daemon/core/core_tap.hpp"
#include "mmu/scenario/simulator.hpp"

namespace bmu {

/// The core's states that a script can refer to: its phases, and the faults and other causes that open.
[[nodiscard]] MasterVocabulary core_vocabulary();
[[nodiscard]] MasterReport report_of(const Core& core);

class VirtualRun {
 public:
  /// Core and pack start at `start`.
  VirtualRun(const CoreConfig& master, const SimulatorConfig& pack, Scenario scenario);
  VirtualRun(const SimulatorConfig& pack, Scenario scenario);

  /// Advances both by one millisecond.
  void step();
  /// Gives the core an observation, upon which it may decide at once; while stopped, it is delivered by go_on().
  /// Precondition: there is a core.
  void observe(const ObservedThing& what);
  /// The process of the core stands still, as on a machine that gives it no processor time. When it continues, the core
  /// gets the pending observations as from the daemon's loop: after more than 20 ms with the time of its last
  /// observation, and after a stall longer than it bridges no frames, but their number.
  void stop();
  void go_on();

  /// From now on receives all observations and decisions of the core; must outlive this. Null: none.
  void set_tap(CoreTap* tap) { tap_ = tap; }

  [[nodiscard]] TimePoint now() const { return now_; }
  [[nodiscard]] Duration elapsed() const { return now_ - start; }
  [[nodiscard]] bool has_core() const { return core_.has_value(); }
  [[nodiscard]] const Core& core() const { return *core_; }
  [[nodiscard]] const Simulator& simulator() const { return simulator_; }
  [[nodiscard]] Simulator& simulator() { return simulator_; }
  /// All events of the core since the start.
  [[nodiscard]] const std::vector<Event>& events() const { return events_; }

  static constexpr TimePoint start{1s};

 private:
  [[nodiscard]] Urgency give(const Observation& observation);
  void decide();
  /// The port through which the frames of this one are observed.
  [[nodiscard]] Port serving(Port port) const;
  void observe_guest(Port port, std::span<const SentFrame> frames);
  /// Executes the commands of the script to the master, with all rights.
  void give_orders();

  TimePoint now_ = start;
  std::optional<Core> core_;
  Simulator simulator_;
  TimePoint wake_at_ = start;
  std::vector<CanFrame> echoes_;      // of the frames that the core sent last
  TimePoint stopped_at_{};            // zero: it is running
  TimePoint latest_at_{};             // of the last observation or decision of the core
  std::vector<Observation> waiting_;  // observations until the core continues
  std::vector<Event> events_;
  CoreTap* tap_ = nullptr;
};

}  // namespace bmu

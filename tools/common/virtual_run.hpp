// A core and the emulated pack around it in virtual time, in one process and without any bus: what one sends the other
// observes. Many times faster than real time, and the same configuration, script and seed always go the same way.
//
//   VirtualRun run(pack.core, simulator_config(pack.core), scenario);
//   while (!run.simulator().script().is_over()) run.step();
//
// Without a core it is the emulated pack alone, with nobody who polls or commands. Frames of the core reach the pack in
// the millisecond they are sent in, and what the pack sends is observed with the next; there is no bus load. The core
// gets its own frames back a millisecond after it has sent them, as from a bus.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "daemon/core/core.hpp"
#include "daemon/core/core_tap.hpp"
#include "mmu/scenario/simulator.hpp"

namespace bmu {

/// What a script can ask the core for: its phases, and the faults and other causes that open.
[[nodiscard]] MasterVocabulary core_vocabulary();
[[nodiscard]] MasterReport report_of(const Core& core);

class VirtualRun {
 public:
  /// Core and pack start at `start`.
  VirtualRun(const CoreConfig& master, const SimulatorConfig& pack, Scenario scenario);
  VirtualRun(const SimulatorConfig& pack, Scenario scenario);

  /// One millisecond of both.
  void step();
  /// Gives the core an observation, upon which it may decide at once; while stopped, when it goes on. There must be
  /// one.
  void observe(const ObservedThing& what);
  /// The process of the core stands still, as on a machine that gives it no processor. When it goes on the core gets
  /// what has waited as from the daemon's loop: after more than 20 ms with the time of what it got last, and after more
  /// than the core bridges no frames, but their number.
  void stop();
  void go_on();

  /// Is told, from now on, all that the core is told and decides; must outlive this. None: nobody.
  void set_tap(CoreTap* tap) { tap_ = tap; }

  [[nodiscard]] TimePoint now() const { return now_; }
  [[nodiscard]] Duration elapsed() const { return now_ - start; }
  [[nodiscard]] bool has_core() const { return core_.has_value(); }
  [[nodiscard]] const Core& core() const { return *core_; }
  [[nodiscard]] const Simulator& simulator() const { return simulator_; }
  [[nodiscard]] Simulator& simulator() { return simulator_; }
  /// Everything the core has told since the start.
  [[nodiscard]] const std::vector<Event>& events() const { return events_; }

  static constexpr TimePoint start{1s};

 private:
  [[nodiscard]] Urgency give(const Observation& observation);
  void decide();
  /// The port that tells the frames of this one.
  [[nodiscard]] Port serving(Port port) const;
  void observe_guest(Port port, std::span<const SentFrame> frames);
  /// What the script tells the master, as whoever may do everything.
  void give_orders();

  TimePoint now_ = start;
  std::optional<Core> core_;
  Simulator simulator_;
  TimePoint wake_at_ = start;
  std::vector<CanFrame> echoes_;      // of what the core sent last
  TimePoint stopped_at_{};            // zero: it runs
  TimePoint latest_at_{};             // of what the core was given, or decided, last
  std::vector<Observation> waiting_;  // for the core to go on
  std::vector<Event> events_;
  CoreTap* tap_ = nullptr;
};

}  // namespace bmu

// A core and the emulated pack with a bus between them that takes time, in virtual time: for tests that measure
// reaction times. A value: a copy runs on by itself, so one closed pack serves many trials.
//
// A fault is a change of the environment (`apply`, the scripts' language), of the frames of devices (`on_sent`), of the
// wire, or of the reports of the master's interface. A hook must hold its own state by value.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/core/core.hpp"
#include "mmu/devices/mmu.hpp"
#include "mmu/scenario/simulator.hpp"
#include "tests/support/boxed.hpp"
#include "tests/support/can_bus.hpp"

namespace bmu::test {

/// Fate of a frame that a device sends.
struct Fate {
  bool is_lost = false;
  Duration delay{};
  std::optional<CanFrame> twin{};  // sent after it
};

class WiredPack {
 public:
  /// `devices_ahead`: time for which the devices have been running when the core starts, which shifts their periods
  /// against its ticks and POLLs; less than a second. `starts_at`: the clock's value then. `cell_noise_uV`: of every
  /// sample, uniform over plus and minus this.
  explicit WiredPack(const CoreConfig& config, Duration devices_ahead = {}, const BusConfig& bus = slowest_bus,
                     TimePoint starts_at = start, std::int32_t cell_noise_uV = 0);

  // Faults between the devices and the core.
  std::function<Fate(CanFrame&, const WiredPack&)> on_sent;  // by a device; may change the frame
  std::function<bool(const CanFrame&)> devices_miss;  // a frame of the master that is on the bus: no device receives it
  std::function<void(WiredPack&)> each_ms;
  // Between the core and everything else: may change an observation (false: it is dropped) and a decision before it is
  // carried out.
  std::function<bool(ObservedThing&, const WiredPack&)> on_told;
  std::function<void(Decisions&, const WiredPack&)> on_decided;
  bool is_cut = false;            // the master's wire: no frame passes either way, its own frames are acknowledged
  bool is_swallowing = false;     // the master's frames vanish, though accepted as sent; it receives nothing
  bool sends_fail = false;        // the system takes no frame of the master
  std::optional<CanFrame> flood;  // sent continuously by another node
  Duration latency{};             // of all observations of the core, echoes included
  std::size_t queue_length = 10;  // the kernel's send queue
  std::optional<std::size_t> device_queue_length;  // of each device; none: unlimited, however long it waits

  /// Runs for `duration`; `run_until` stops when the condition is true, and returns whether it is.
  void run(Duration duration);
  [[nodiscard]] bool run_until(const std::function<bool(const WiredPack&)>& condition, Duration at_most);
  /// Applies events of the script language now, separated by semicolons. "$N" is the last module's node, "$C" its last
  /// cell, "$T" its last temperature sensor: those that arbitration sends last.
  void apply(std::string_view events);
  void observe(const ObservedThing& what);
  void give(Command command) { observe(CommandGiven{command}); }
  void send_as_stranger(const CanFrame& frame) { bus_.put(Station::stranger, frame); }
  /// A frame on another bus than this one: of the master to its devices (`are_deaf`: none receives it), or of a device
  /// to the master, which receives it from bus `told_by`. Other traffic of that bus is up to the caller.
  void carry_elsewhere(Port told_by, const CanFrame& frame, bool is_ours, bool are_deaf = false);
  /// Connects another module with power; its cells have 3.6 V. With a node number of the pack it is a real duplicate on
  /// the bus: two controllers that send the same identifiers at the same time.
  void connect_twin(const MmuConfig& module);
  /// For errors on the wire, restarts and plugs: see CanBus. The core receives the states of the master's controller as
  /// the kernel and the daemon's port report them.
  [[nodiscard]] CanBus& bus() { return bus_; }
  [[nodiscard]] const CanBus& bus() const { return bus_; }
  /// The interface disappears, and its send queue with it; or comes back.
  void set_port(bool is_up);
  /// False: no node acknowledges the frames of the master.
  void set_acknowledged(bool is_acknowledged) {
    is_acknowledged ? bus_.connect(Station::master) : bus_.disconnect(Station::master);
  }
  /// The core does nothing for `duration`; frames that arrive meanwhile do not fit the receive queue. `stop` returns at
  /// once, `stall` when it is over.
  void stop(Duration duration) { stalled_until_ = now_ + duration; }
  void stall(Duration duration);

  /// The master's machine loses its power: its core neither ticks nor receives, its station is off the bus, its queue
  /// is empty.
  void cut_power();
  /// Power returns: a new core, with the persistent state of previous sessions.
  void boot(const PersistentState& kept, std::uint8_t first_counter);
  [[nodiscard]] bool has_power() const { return has_power_; }
  /// The master's process is stopped.
  [[nodiscard]] bool is_stalled() const { return now_ < stalled_until_; }

  /// Switches the vehicle on and runs until closed. Returns whether the pack closed.
  [[nodiscard]] bool close();

  [[nodiscard]] TimePoint now() const { return now_; }
  /// Time of its next decision, if nothing happens before.
  [[nodiscard]] TimePoint wake_at() const { return wake_at_; }
  [[nodiscard]] const CoreConfig& config() const { return core_->config(); }
  [[nodiscard]] const Core& core() const { return *core_; }
  [[nodiscard]] const Simulator& simulator() const { return simulator_; }
  [[nodiscard]] Phase phase() const { return core_->sequence().phase; }
  [[nodiscard]] std::uint8_t last_node() const;
  /// Contactors in the last CONTACTOR_COMMAND that was on the bus.
  [[nodiscard]] const ContactorOutputs& commanded() const { return commanded_; }
  [[nodiscard]] bool coils_are_driven() const;
  [[nodiscard]] std::uint8_t poll_counter() const { return poll_counter_; }  // of the last POLL on the bus
  /// Last frame of each identifier, as its device sent it.
  [[nodiscard]] const std::map<std::uint32_t, CanFrame>& last_sent() const { return last_sent_; }
  [[nodiscard]] std::uint64_t phases_entered(Phase phase) const { return entered_[static_cast<std::size_t>(phase)]; }

  static constexpr TimePoint start{1s};

 private:
  struct Due {
    TimePoint at;
    CanFrame frame;
  };
  struct Told {
    TimePoint at;
    ObservedThing what;
  };

  void advance_to(TimePoint now);
  void take_from_bus();
  void take_heard(const BusEvent& event);
  void take_master_state(const BusEvent& event);
  void tell_carrier();
  void tell(const ObservedThing& what);
  void tell_due();
  void raise_ports();
  void tick_devices();
  void put_of_device(Station station, const CanFrame& frame);
  void decide();

  TimePoint now_;
  TimePoint devices_tick_at_;
  TimePoint wake_at_;
  TimePoint stalled_until_{};
  bool has_power_ = true;
  std::uint64_t lost_while_stalled_ = 0;
  Boxed<CoreConfig> given_;
  Boxed<Core> core_;  // large
  Simulator simulator_;
  CanBus bus_;
  bool is_off_ = false;  // the master's controller
  bool is_port_up_ = true;
  std::optional<Mmu> twin_;
  std::optional<TimePoint> carrier_told_at_;  // next check of the interface by the daemon's port
  std::vector<Due> late_;                     // held back by `on_sent`
  std::vector<Told> told_;                    // on their way to the core
  ContactorOutputs commanded_;
  std::uint8_t poll_counter_ = 0;
  std::map<std::uint32_t, CanFrame> last_sent_;
  std::array<std::uint64_t, all_phases.size()> entered_{};
};

[[nodiscard]] Station station_of(const CanFrame& frame);

}  // namespace bmu::test

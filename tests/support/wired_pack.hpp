// A core and the emulated pack with a bus between them that takes time, in virtual time: who wants to know how long a
// reaction takes measures it here. A value: a copy goes on by itself, so one closed pack serves many trials.
//
// A fault is a change of the world (`apply`, the scripts' language), of what devices send (`on_sent`), of the wire, or
// of what the master's interface tells. Whatever a hook remembers it must hold by value.
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

/// What becomes of a frame that a device sends.
struct Fate {
  bool is_lost = false;
  Duration delay{};
  std::optional<CanFrame> twin{};  // goes out behind it
};

class WiredPack {
 public:
  /// `devices_ahead`: how long the devices have been running when the core starts, so that their periods stand to its
  /// ticks and POLLs in another way; less than a second. `starts_at`: what the clock shows then. `cell_noise_uV`:
  /// of every sample, even over plus and minus this.
  explicit WiredPack(const CoreConfig& config, Duration devices_ahead = {}, const BusConfig& bus = slowest_bus,
                     TimePoint starts_at = start, std::int32_t cell_noise_uV = 0);

  // What can be wrong with everything between the devices and the core.
  std::function<Fate(CanFrame&, const WiredPack&)> on_sent;  // by a device; may change the frame
  std::function<bool(const CanFrame&)> devices_miss;  // a frame of the master that is on the bus: no device takes it in
  std::function<void(WiredPack&)> each_ms;
  // Who stands between the core and everything else: may change what it is told (false: it is not told) and what it has
  // decided before that is carried out.
  std::function<bool(ObservedThing&, const WiredPack&)> on_told;
  std::function<void(Decisions&, const WiredPack&)> on_decided;
  bool is_cut = false;         // the master's wire: it hears nobody, nobody hears it, its own frames are acknowledged
  bool is_swallowing = false;  // the master's frames vanish, told as sent; it hears nobody
  bool sends_fail = false;     // the system takes no frame of the master
  std::optional<CanFrame> flood;                   // a stranger sends it all the time
  Duration latency{};                              // of everything the core is told, echoes included
  std::size_t queue_length = 10;                   // the kernel's send queue
  std::optional<std::size_t> device_queue_length;  // of each device; none: it forgets nothing, however long it waits

  /// Until `duration` has passed; `run_until` also until the condition holds, and says whether it does.
  void run(Duration duration);
  [[nodiscard]] bool run_until(const std::function<bool(const WiredPack&)>& condition, Duration at_most);
  /// Events of the script language, separated by semicolons, now. "$N" is the last module's node, "$C" its last cell,
  /// "$T" its last temperature sensor: what arbitration sends last.
  void apply(std::string_view events);
  void observe(const ObservedThing& what);
  void give(Command command) { observe(CommandGiven{command}); }
  void send_as_stranger(const CanFrame& frame) { bus_.put(Station::stranger, frame); }
  /// A frame that another bus than this one has carried: the master's to its devices (`are_deaf`: none takes it in), or
  /// one of theirs to the master, who is told of it by `told_by`. What else is on that bus is the caller's.
  void carry_elsewhere(Port told_by, const CanFrame& frame, bool is_ours, bool are_deaf = false);
  /// Another module is plugged in and powered; its cells have 3.6 V. With a node number of the pack it is on the bus
  /// what such a module is: two controllers that send the same identifiers at the same time.
  void connect_twin(const MmuConfig& module);
  /// Errors on the wire, restarts, plugs: see there. What the master's controller becomes, the core is told as the
  /// kernel and the daemon's port tell it.
  [[nodiscard]] CanBus& bus() { return bus_; }
  [[nodiscard]] const CanBus& bus() const { return bus_; }
  /// The interface goes, and its send queue with it; or comes back.
  void set_port(bool is_up);
  /// Nobody acknowledges what the master sends.
  void set_acknowledged(bool is_acknowledged) {
    is_acknowledged ? bus_.connect(Station::master) : bus_.disconnect(Station::master);
  }
  /// The core does nothing for so long; what arrives meanwhile does not fit the receive queue. `stop` comes back at
  /// once, `stall` when it is over.
  void stop(Duration duration) { stalled_until_ = now_ + duration; }
  void stall(Duration duration);

  /// The machine of the master loses its power: no core that ticks or is told, nobody on the bus, nothing in the queue.
  void cut_power();
  /// And has it again: a new core, with what is kept of former lives.
  void boot(const PersistentState& kept, std::uint8_t first_counter);
  [[nodiscard]] bool has_power() const { return has_power_; }
  /// The master's process is stopped.
  [[nodiscard]] bool is_stalled() const { return now_ < stalled_until_; }

  /// Vehicle on, and run until closed. Returns whether it got there.
  [[nodiscard]] bool close();

  [[nodiscard]] TimePoint now() const { return now_; }
  /// When it is next asked to decide, if nothing happens before.
  [[nodiscard]] TimePoint wake_at() const { return wake_at_; }
  [[nodiscard]] const CoreConfig& config() const { return core_->config(); }
  [[nodiscard]] const Core& core() const { return *core_; }
  [[nodiscard]] const Simulator& simulator() const { return simulator_; }
  [[nodiscard]] Phase phase() const { return core_->sequence().phase; }
  [[nodiscard]] std::uint8_t last_node() const;
  /// The contactors asked for in the last CONTACTOR_COMMAND that was on the bus.
  [[nodiscard]] const ContactorOutputs& commanded() const { return commanded_; }
  [[nodiscard]] bool coils_are_driven() const;
  [[nodiscard]] std::uint8_t poll_counter() const { return poll_counter_; }  // of the last POLL on the bus
  /// What each identifier carried last, as its device sent it.
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
  std::optional<TimePoint> carrier_told_at_;  // when the daemon's port looks at its interface the next time
  std::vector<Due> late_;                     // held back by `on_sent`
  std::vector<Told> told_;                    // on their way to the core
  ContactorOutputs commanded_;
  std::uint8_t poll_counter_ = 0;
  std::map<std::uint32_t, CanFrame> last_sent_;
  std::array<std::uint64_t, all_phases.size()> entered_{};
};

[[nodiscard]] Station station_of(const CanFrame& frame);

}  // namespace bmu::test

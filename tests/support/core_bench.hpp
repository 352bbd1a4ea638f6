// A core on a test bench: a small, obedient world around it in virtual time, every value of which a test can set.
//
// Modules answer each POLL 4 ms later, sensor and PDU send at their periods, contactors follow a command after 15 ms,
// and the link voltage rises during precharge by a settable rate. Nothing here sleeps or knows a real clock. It is kept
// apart from the emulators in mmu/ on purpose: two worlds that were built separately agree only on the protocol.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <vector>

#include "daemon/core/core.hpp"
#include "protocol/tables/internal_bus.hpp"
#include "tests/support/boxed.hpp"

namespace bmu::test {

/// 2 modules x 4 cells, 2 sensors each; limits in round numbers.
[[nodiscard]] CoreConfig small_pack();
/// `modules` x 12 cells, 4 sensors each, otherwise like small_pack.
[[nodiscard]] CoreConfig pack_of(std::size_t modules);

struct BenchModule {
  bool talks = true;
  std::uint8_t node = 1;
  std::uint8_t cell_count = 4;
  std::uint8_t sensor_count = 2;
  std::array<SignalValue, 12> cell_voltage_uV{};
  std::array<SignalValue, 4> cell_temperature_dC{};
  std::uint32_t serial_number = 1000;
  bool limits_not_set = true;
  bool restarted = true;
  std::uint16_t undervoltage_cells = 0;
  std::uint16_t overvoltage_cells = 0;
  SignalValue voltage_age_ms = known(5);
  bool sends_temperatures = true;
  bool sends_status = true;
  bool board_too_hot = false;
  bool ignores_commands = false;
  bool only_says_done = false;     // answers a COMMAND and does not do it
  bool refuses_limits = false;     // answers every COMMAND with "refused in this mode"
  bool refuses_balancing = false;  // the same to minutes only
  internal_bus::Mode mode = internal_bus::Mode::normal;
  bool on_module_supply = false;
  std::uint16_t open_wire_cells = 0;
  std::uint16_t balancing_cells = 0;  // what it says is on
};

class CoreBench {
 public:
  /// `state`: what a life before this one had to remember. `claim`: what the core is fed first, if anything.
  explicit CoreBench(const CoreConfig& config, const PersistentState& state = {}, std::uint8_t first_counter = 0,
                     const std::optional<ClaimBegins>& claim = {});

  // The world, free to change between steps.
  std::vector<BenchModule> modules;
  std::int32_t current_mA = 0;
  std::int32_t precharge_current_mA = 0;        // what the sensor shows during precharge
  std::optional<std::int32_t> pack_voltage_mV;  // default: the sum of the cells
  std::int32_t link_voltage_mV = 0;
  std::int32_t link_rise_mV_per_ms = 200;  // in precharge
  bool sensor_talks = true;
  bool voltage_talks = true;
  bool pdu_talks = true;
  bool bus_echoes = true;  // our own frames come back once they were on the bus; without, nobody else gets them either
  PduState inputs;         // contacts in it are overwritten
  bool contactors_stuck = false;  // they stay as they are
  bool contacts_held_open = false;
  bool pdu_hears = true;              // it gets the contactor commands
  std::function<void()> before_poll;  // called before the modules answer, to change what they will say
  std::function<void()> each_ms;
  std::function<bool(const CanFrame&)> is_lost;  // a frame of somebody else that does not reach the core
  Duration answer_delay = 4ms;
  bool loses_polls = false;
  std::function<bool(const OutgoingFrame&)> echo_is_lost;
  std::array<Duration, 4> contact_delays{15ms, 15ms, 15ms,
                                         15ms};  // to close: main positive, negative, precharge, charge
  bool main_positive_held_open = false;
  bool feedback_lies = false;            // auxiliary contacts say what was commanded
  bool pdu_tells_changes = false;        // of contacts at once, not only every 50 ms
  std::int32_t link_fall_mV_per_ms = 1;  // what discharges the link when nothing feeds it
  bool bus_is_stuck = false;             // nobody acknowledges: what we send waits in the queue
  std::size_t queue_length = 10;
  std::function<void(std::int32_t link_mV, std::int32_t pack_mV)> on_mains_made;

  // Told of everything that goes into the core, for tests that feed it to another one.
  std::function<void(const Observation&)> on_observe;
  std::function<void(TimePoint)> on_decide;

  /// Runs the world and the core until `duration` has passed.
  void run(Duration duration);
  /// Runs until `condition` holds; false if that took longer than `at_most`.
  [[nodiscard]] bool run_until(const std::function<bool()>& condition, Duration at_most);
  /// Vehicle on, and run until closed. Returns whether it got there within 3 s.
  [[nodiscard]] bool close();
  void observe(const ObservedThing& what);
  void deliver(const CanFrame& frame);
  void tell_pdu_status();
  void give(Command command) { observe(CommandGiven{command}); }
  /// What a former life remembered; before anything else.
  void restore(const PersistentState& state) { core_->restore(state); }
  /// Contacts fall open without a command. With contactors_stuck they stay so.
  void drop_contacts() { contacts_ = {}; }
  /// The unit starts anew: everything open, counting from 0.
  void restart_pdu();
  /// The bus works again, and what waited goes out first.
  void free_bus();
  /// Time without ticks: what a stopped process lives through.
  void stall(Duration duration);

  [[nodiscard]] TimePoint now() const { return now_; }
  [[nodiscard]] const Core& core() const { return *core_; }
  [[nodiscard]] ContactorOutputs commanded() const { return commanded_; }  // in the last CONTACTOR_COMMAND sent
  [[nodiscard]] ContactorOutputs contacts() const { return contacts_; }    // what really is closed
  [[nodiscard]] TimePoint opened_at() const { return opened_at_; }         // of the last all-open after a closed one
  [[nodiscard]] const std::vector<OutgoingFrame>& sent() const { return sent_; }
  [[nodiscard]] const std::vector<TimePoint>& sent_at() const { return sent_at_; }
  [[nodiscard]] const std::vector<Event>& events() const { return events_; }
  [[nodiscard]] const Decisions& last() const { return last_; }
  [[nodiscard]] bool has_event(EventId id) const;
  [[nodiscard]] bool is_active(FaultId id) const { return core_->faults().state(id).is_present(); }

 private:
  struct Due {
    TimePoint at;
    CanFrame frame;
  };

  void advance_1ms();
  void decide();
  void put_on_bus(const OutgoingFrame& frame);
  void obey(const OutgoingFrame& sent);
  void answer_poll(const CanFrame& poll);
  void answer_command(const CanFrame& command, std::uint8_t node);
  void send_periodic();
  void follow_contactors();
  [[nodiscard]] std::int32_t cell_sum_mV() const;

  TimePoint now_{1s};
  Boxed<Core> core_;  // large
  Decisions last_;
  TimePoint wake_at_{};
  ContactorOutputs commanded_;
  ContactorOutputs contacts_;
  std::array<TimePoint, 4> contacts_follow_at_{};
  ContactorOutputs told_contacts_;
  bool mains_made_ = false;
  std::deque<OutgoingFrame> queue_;
  TimePoint command_expires_at_{};
  TimePoint opened_at_{};
  std::vector<Due> due_;
  std::vector<OutgoingFrame> echoes_;
  bool opened_by_timeout_ = false;
  std::vector<OutgoingFrame> sent_;
  std::vector<TimePoint> sent_at_;
  std::vector<Event> events_;
  std::uint8_t sensor_counter_ = 0;
  std::uint8_t voltage_counter_ = 0;
  std::uint8_t pdu_counter_ = 0;
};

}  // namespace bmu::test

// A core on a test bench: a small simulated environment in virtual time; a test can set every value of it.
//
// Modules answer each POLL 4 ms later, sensor and PDU send at their periods, contactors follow a command after 15 ms,
// and the DC link voltage rises during precharge by a settable rate. Nothing here sleeps or reads a real clock. It is
// kept apart from the emulators in mmu/ on purpose: two environments that were built separately agree only on the
// protocol.
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
  bool only_says_done = false;     // responds to a COMMAND and does not execute it
  bool refuses_limits = false;     // responds to every COMMAND with "refused in this mode"
  bool refuses_balancing = false;  // the same, to balancing minutes only
  internal_bus::Mode mode = internal_bus::Mode::normal;
  bool on_module_supply = false;
  std::uint16_t open_wire_cells = 0;
  std::uint16_t balancing_cells = 0;  // reported as on
};

class CoreBench {
 public:
  /// `state`: persistent state of a previous session. `claim`: the first observation of the core, if given.
  explicit CoreBench(const CoreConfig& config, const PersistentState& state = {}, std::uint8_t first_counter = 0,
                     const std::optional<ClaimBegins>& claim = {});

  // The environment; a test may change it between steps.
  std::vector<BenchModule> modules;
  std::int32_t current_mA = 0;
  std::int32_t precharge_current_mA = 0;        // shown by the sensor during precharge
  std::optional<std::int32_t> pack_voltage_mV;  // default: the sum of the cells
  std::int32_t link_voltage_mV = 0;
  std::int32_t link_rise_mV_per_ms = 200;  // in precharge
  bool sensor_talks = true;
  bool voltage_talks = true;
  bool pdu_talks = true;
  bool bus_echoes = true;  // the core's own frames are echoed after sending; false: no other node receives them either
  PduState inputs;         // its contacts are not used
  bool contactors_stuck = false;  // they keep their position
  bool contacts_held_open = false;
  bool pdu_hears = true;              // it receives the contactor commands
  std::function<void()> before_poll;  // called before the modules answer, to change their answers
  std::function<void()> each_ms;
  std::function<bool(const CanFrame&)> is_lost;  // a frame of another node that does not reach the core
  Duration answer_delay = 4ms;
  bool loses_polls = false;
  std::function<bool(const OutgoingFrame&)> echo_is_lost;
  std::array<Duration, 4> contact_delays{15ms, 15ms, 15ms,
                                         15ms};  // to close: main positive, negative, precharge, charge
  bool main_positive_held_open = false;
  bool feedback_lies = false;            // auxiliary contacts show the command
  bool pdu_tells_changes = false;        // of contacts at once, not only every 50 ms
  std::int32_t link_fall_mV_per_ms = 1;  // discharge of the DC link when nothing feeds it
  bool bus_is_stuck = false;             // no acknowledgement: frames of the core wait in the queue
  std::size_t queue_length = 10;
  std::function<void(std::int32_t link_mV, std::int32_t pack_mV)> on_mains_made;

  // Called with every input of the core, for tests that feed it to another one.
  std::function<void(const Observation&)> on_observe;
  std::function<void(TimePoint)> on_decide;

  /// Runs the environment and the core for `duration`.
  void run(Duration duration);
  /// Runs until `condition` is true; returns false if that took longer than `at_most`.
  [[nodiscard]] bool run_until(const std::function<bool()>& condition, Duration at_most);
  /// Switches the vehicle on and runs until closed. Returns whether that took no longer than 3 s.
  [[nodiscard]] bool close();
  void observe(const ObservedThing& what);
  void deliver(const CanFrame& frame);
  void tell_pdu_status();
  void give(Command command) { observe(CommandGiven{command}); }
  /// Restores the state of a previous session; before any other call.
  void restore(const PersistentState& state) { core_->restore(state); }
  /// Contacts fall open without a command. With contactors_stuck they stay open.
  void drop_contacts() { contacts_ = {}; }
  /// The PDU restarts: everything open, its counter at 0.
  void restart_pdu();
  /// The bus works again, and the queued frames are sent first.
  void free_bus();
  /// Time without ticks, as for a stopped process.
  void stall(Duration duration);

  [[nodiscard]] TimePoint now() const { return now_; }
  [[nodiscard]] const Core& core() const { return *core_; }
  [[nodiscard]] ContactorOutputs commanded() const { return commanded_; }  // in the last CONTACTOR_COMMAND sent
  [[nodiscard]] ContactorOutputs contacts() const { return contacts_; }    // really closed
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

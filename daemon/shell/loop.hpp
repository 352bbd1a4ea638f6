// The control loop: one thread, one epoll, nothing in it that waits.
//
//   bus frames, line levels, port changes, signals, commands, the wall clock  ->  observations  ->  Core::observe
//   the tick's timer, or an observation that cannot wait  ->  Core::decide  ->  lines, frames, log lines, one timer
//
// What is to be remembered goes to the store after the decision that changed it, whose thread writes it.
//
// Each wake-up reads a bounded number of frames and answers at most one client, so neither a flooded bus nor a busy
// client can hold up the tick. Being alive is told only after a tick has been decided in full.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "daemon/core/core.hpp"
#include "daemon/core/core_tap.hpp"
#include "daemon/history/history_store.hpp"
#include "daemon/shell/can/buses.hpp"
#include "daemon/shell/can/rate_watch.hpp"
#include "daemon/shell/gpio/line_feeder.hpp"
#include "daemon/shell/state/state_store.hpp"
#include "daemon/shell/status/drive_record.hpp"
#include "daemon/shell/status/loop_counters.hpp"
#include "daemon/shell/status/status_socket.hpp"
#include "daemon/shell/system/intake_air.hpp"
#include "daemon/shell/system/journal.hpp"
#include "daemon/shell/system/owned_fd.hpp"
#include "daemon/shell/system/service_notify.hpp"

namespace bmu {

/// Another descriptor, and what is called when it is readable (level).
struct Watched {
  int fd = -1;
  std::function<void()> call;
};

/// Who sent a signal.
struct SignalFrom {
  std::uint32_t user_id = 0;
  std::int64_t process_id = 0;
};

/// How a session claims its pack (master_claim.hpp).
struct ClaimPlan {
  Duration length{};       // zero: no claim, the core sends at once
  Duration kept_max{};     // the previous session's claim is kept over a shorter silence
  TimePoint held_until{};  // by the previous session, through the same ports; zero: there is none
};

struct LoopParts {
  Core& core;
  const Buses& buses;
  StatusSocket& status_socket;
  Journal& journal;
  ServiceNotify& notify;
  StateStore& store;
  RateWatch& rate;
  ClaimPlan claim{};
  LineFeeder* lines = nullptr;            // none: the pack file has no lines of this machine
  IntakeAirReader* intake_air = nullptr;  // none: the temperature of the intake air comes from no file
  const HistoryStore* history = nullptr;
  std::vector<CoreTap*> taps{};  // are told all that the core is told and decides; none of them may wait
  std::vector<std::function<void()>> each_second{};  // what people are told now and then; may not wait either
  std::vector<Watched> watched{};
  std::vector<CommandGiven> first{};                   // orders of the life before that hold in this one
  std::function<void(const SignalFrom&)> on_reload{};  // SIGHUP that somebody sent
};

/// How a life ended.
enum class LoopEnd : std::uint8_t {
  ended,  // by SIGTERM, SIGINT, or a terminal that hung up: the process ends, too
  left,   // by leave(): the next one may begin
};

class Loop {
 public:
  using Answer = StatusSocket::Answer;
  using Picture = StatusSocket::Picture;

  explicit Loop(const LoopParts& parts);

  /// What clients are answered with; both read the core between two decisions.
  void set_answers(Answer answer, Picture picture);
  /// Timer, signals and ports into one epoll. SIGTERM, SIGINT and SIGHUP must be blocked already.
  [[nodiscard]] Result<void, OsError> init();
  /// Runs until the pack is open after SIGTERM, SIGINT or leave(); a second signal ends it at once. Returns an error
  /// if the system refused what a loop cannot do without, or another master commands the pack; the outputs have been
  /// commanded open then too, with another master on the bus without a frame.
  [[nodiscard]] Result<LoopEnd, OsError> run();
  /// This life ends, in the same order, for another one to begin.
  void leave();

  /// An order from a client: taken in and decided on when this returns, so that what it did can be told.
  void carry_out(const CommandGiven& command);
  [[nodiscard]] const LoopCounters& counters() const { return counters_; }
  [[nodiscard]] const DriveRecord& drive() const { return drive_.record(); }

 private:
  /// What has been told of a port so far, so that each change is told once.
  struct Told {
    bool is_up = false;
    std::uint64_t frames_lost = 0;
  };

  void observe(TimePoint at, const ObservedThing& what);
  void read_signals();
  void read_port(Port port);
  [[nodiscard]] bool is_late(TimePoint at) const;
  [[nodiscard]] bool must_discard(TimePoint at) const;
  void catch_up(TimePoint at);
  [[nodiscard]] bool drain_port(Port port, bool discards);
  bool take_old_frame(Port port, ReceivedFrame received, bool discards);
  void take_frame(Port port, const ReceivedFrame& received);
  void tell_port_state(Port port, bool was_down);
  void maintain_ports();
  void look_at_rate();
  void look_at_lines();
  void read_intake_air();
  void drive_lines(const ContactorOutputs& outputs, TimePoint decided_at);
  void maintain_lines();
  void begin_claim();
  void tell_wall_clock();
  void tell_health();
  void keep_state();
  void decide_if_due();
  void decide();
  void send(const Decisions& decisions, TimePoint decided_at);
  void after_tick();
  void arm_timer();
  void take_signal(int number, int code, const SignalFrom& from);
  [[nodiscard]] Result<LoopEnd, OsError> run_to_end();
  void open_for_good();
  [[nodiscard]] Result<LoopEnd, OsError> give_up(const OsError& error);
  void shut_down();
  void end_core();
  [[nodiscard]] bool is_over() const;
  /// What waits from a time when we were away has been taken when this returns.
  [[nodiscard]] TimePoint now();
  [[nodiscard]] bool watch(int fd, std::uint32_t tag);
  void wake(std::uint32_t tag);

  LoopParts parts_;
  Answer answer_;
  Picture picture_;
  OwnedFd epoll_;
  OwnedFd timer_;
  OwnedFd signals_;
  std::array<Told, port_count> told_{};
  GpioState told_lines_ = GpioState::failed;
  std::string told_lines_error_;
  OwnHealth told_health_;
  std::uint32_t kept_generation_ = 0;
  LoopCounters counters_;
  DriveRecorder drive_;
  std::optional<OsError> timer_failure_;  // the next decision has no time at which it is due
  TimePoint latest_time_{};               // what the core was told last: its time never goes back
  TimePoint wake_at_{};
  TimePoint expected_at_{};  // when we were there last, or sleep until by right: what is much later was an absence
  TimePoint maintained_at_{};
  TimePoint told_people_at_{};
  TimePoint shut_down_at_{};
  bool decide_now_ = false;
  bool is_tick_unfinished_ = false;  // decided; what follows a tick is still to be done
  bool is_ready_ = false;
  bool is_shutting_down_ = false;
  bool is_shut_down_ = false;
  bool ends_at_once_ = false;
  bool is_leaving_ = false;
};

/// One line for people: state, voltage, current, charge, what is wrong.
[[nodiscard]] std::string summary_line(const Core& core);

}  // namespace bmu

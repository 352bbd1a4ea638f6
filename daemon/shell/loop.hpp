// The control loop: one thread, one epoll, no call that blocks.
//
//   bus frames, line levels, port changes, signals, commands, the wall clock  ->  observations  ->  Core::observe
//   the tick's timer, or an urgent observation  ->  Core::decide  ->  lines, frames, log lines, one timer
//
// Persistent state goes to the store after the decision that changed it; the thread of the store writes it.
//
// Each wake-up reads a bounded number of frames and answers at most two requests, so neither a flooded bus nor a busy
// client can delay the tick. The watchdog is fed only after a tick has been decided in full.
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

/// Another descriptor, and the function to call when it is readable (level).
struct Watched {
  int fd = -1;
  std::function<void()> call;
};

/// Sender of a signal.
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
  std::vector<CoreTap*> taps{};  // receive all observations and decisions of the core; must not block
  std::vector<std::function<void()>> each_second{};  // for periodic log lines and the like; must not block
  std::vector<Watched> watched{};
  std::vector<CommandGiven> first{};                   // operator commands of the previous session that still hold
  std::function<void(const SignalFrom&)> on_reload{};  // for a SIGHUP from a process
};

/// How a session ended.
enum class LoopEnd : std::uint8_t {
  ended,  // by SIGTERM, SIGINT, or a terminal that hung up: the process ends, too
  left,   // by leave(): the next session may start
};

class Loop {
 public:
  using Answer = StatusSocket::Answer;
  using Picture = StatusSocket::Picture;

  explicit Loop(const LoopParts& parts);

  /// Sets the functions that answer clients; both read the core between two decisions.
  void set_answers(Answer answer, Picture picture);
  /// Adds all descriptors to one epoll. Precondition: SIGTERM, SIGINT and SIGHUP are blocked.
  [[nodiscard]] Result<void, OsError> init();
  /// Runs until the pack is open after SIGTERM, SIGINT or leave(); a second signal ends it at once. Returns an error if
  /// the system refused a call or memory that the loop needs, or another master commands the pack; the outputs have
  /// been commanded open then too, with another master on the bus without a frame.
  [[nodiscard]] Result<LoopEnd, OsError> run();
  /// Ends this session in the same order, for another one to start.
  void leave();

  /// Executes a command of a client: observed and decided on when this returns, so that its effect can be reported.
  void carry_out(const CommandGiven& command);
  [[nodiscard]] const LoopCounters& counters() const { return counters_; }
  [[nodiscard]] const DriveRecord& drive() const { return drive_.record(); }

 private:
  /// State of a port as last observed by the core, so that each change is observed once.
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
  /// The time of the core. Frames that waited during a stall have been handled when this returns.
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
  std::optional<OsError> timer_failure_;  // set: the next decision has no due time
  TimePoint latest_time_{};               // time of the last observation or decision: the core's time never goes back
  TimePoint wake_at_{};
  TimePoint expected_at_{};  // time of the last activity, or planned end of the sleep: a much later time is a stall
  TimePoint maintained_at_{};
  TimePoint told_people_at_{};
  TimePoint shut_down_at_{};
  bool decide_now_ = false;
  bool is_tick_unfinished_ = false;  // decided; after_tick() is still due
  bool is_ready_ = false;
  bool is_shutting_down_ = false;
  bool is_shut_down_ = false;
  bool ends_at_once_ = false;
  bool is_leaving_ = false;
};

/// One line for people: phase, voltage, current, SOC, confirmed faults.
[[nodiscard]] std::string summary_line(const Core& core);

}  // namespace bmu

#include "daemon/shell/loop.hpp"

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <new>
#include <utility>

#include <sys/epoll.h>
#include <sys/signalfd.h>
#include <sys/timerfd.h>
#include <unistd.h>

#include "daemon/shell/late_decision.hpp"
#include "protocol/can_bits.hpp"

namespace bmu {

namespace {

// About 60 ms of a full 500 kbit/s bus; then timers and the other ports are served.
constexpr int frames_per_wake_up = 256;
// A later wake-up shows that the process was stopped or starved: the age of the waiting frames is unknown.
constexpr Duration lateness_max = 20ms;
// More than any receive queue holds.
constexpr int backlog_max = 100'000;
constexpr Duration maintain_period = 100ms;
constexpr Duration tell_people_period = 1s;
// Ticks in which an unreadable state file is reported; the fault then stays until an operator has cleared it.
constexpr std::uint64_t unreadable_told_ticks = 10;
// The core limits its wait for open contacts itself; this limit applies if it fails to.
constexpr Duration shut_down_max = 1500ms;
constexpr int epoll_events = 8;

// Tag of an epoll event: the number of a port, or one of these.
static_assert(port_count <= 10);
constexpr std::uint32_t tag_timer = 10;
constexpr std::uint32_t tag_signals = 11;
constexpr std::uint32_t tag_status_socket = 12;
constexpr std::uint32_t tag_lines = 13;
constexpr std::uint32_t tag_watched = 14;  // and above: index into LoopParts::watched

constexpr std::size_t index_of(Port port) {
  return static_cast<std::size_t>(port);
}

sigset_t awaited_signals() {
  sigset_t set;
  sigemptyset(&set);
  for (const int signal : {SIGTERM, SIGINT, SIGHUP}) sigaddset(&set, signal);
  return set;
}

OsError os_error(const char* what) {
  return {.code = errno, .what = what};
}

std::string rival_text(const MasterClaim& claim) {
  std::array<char, 12> id{};
  std::snprintf(id.data(), id.size(), "%03X", static_cast<unsigned>(claim.rival_id()));
  const std::string frame = std::string(" (frame ") + id.data() + ")";
  switch (claim.loss()) {
    case ClaimLoss::none: break;
    case ClaimLoss::while_listening:
      return "second master: another master commands this pack" + frame +
             "; this daemon sends nothing and exits; remove the other master from the bus first";
    case ClaimLoss::before_own_frame:
      return "second master: another master that started at the same time was first on the bus" + frame +
             "; this daemon exits";
    case ClaimLoss::while_resting:
      return "second master: another master started while the modules of this one were asleep" + frame +
             "; this daemon, which commands all contactors open, exits";
  }
  return "second master";
}

}  // namespace

Loop::Loop(const LoopParts& parts) : parts_(parts), kept_generation_(parts.core.persistent_generation()) {}

void Loop::set_answers(Answer answer, Picture picture) {
  answer_ = std::move(answer);
  picture_ = std::move(picture);
}

bool Loop::watch(int fd, std::uint32_t tag) {
  epoll_event event{};
  event.events = EPOLLIN;
  event.data.u32 = tag;
  return ::epoll_ctl(epoll_.get(), EPOLL_CTL_ADD, fd, &event) == 0;
}

Result<void, OsError> Loop::init() {
  const sigset_t signals = awaited_signals();
  epoll_ = OwnedFd(::epoll_create1(EPOLL_CLOEXEC));
  timer_ = OwnedFd(::timerfd_create(CLOCK_BOOTTIME, TFD_CLOEXEC | TFD_NONBLOCK));
  signals_ = OwnedFd(::signalfd(-1, &signals, SFD_CLOEXEC | SFD_NONBLOCK));
  if (!epoll_.is_open() || !timer_.is_open() || !signals_.is_open()) {
    return failure(os_error("epoll, timer and signal descriptors"));
  }
  bool is_watching = watch(timer_.get(), tag_timer) && watch(signals_.get(), tag_signals) &&
                     watch(parts_.status_socket.fd(), tag_status_socket);
  for (const Port port : all_ports) {
    if (!parts_.buses.is_own(port)) continue;
    is_watching = is_watching && watch(parts_.buses.serving(port).fd(), static_cast<std::uint32_t>(port));
  }
  if (parts_.lines != nullptr) is_watching = is_watching && watch(parts_.lines->lines().fd(), tag_lines);
  for (std::size_t i = 0; i < parts_.watched.size(); ++i) {
    is_watching = is_watching && watch(parts_.watched[i].fd, tag_watched + static_cast<std::uint32_t>(i));
  }
  if (!is_watching) return failure(os_error("epoll_ctl"));
  return {};
}

/// Runs the loop; opens and ends if memory runs out. The core allocates none, but replies to clients and log lines do.
/// After a failed allocation it is unknown which work of the loop was left undone.
Result<LoopEnd, OsError> Loop::run() {
  try {
    return run_to_end();
  } catch (const std::bad_alloc&) {
    // Opens first, because the error text allocates memory, too.
    open_for_good();
    return failure(OsError{.code = ENOMEM, .what = "memory for the control loop"});
  }
}

Result<LoopEnd, OsError> Loop::run_to_end() {
  expected_at_ = monotonic_now();
  wake_at_ = expected_at_;
  // Frames that a port has lost so far belong to a previous session, or to none.
  for (const Port port : all_ports) {
    if (parts_.buses.is_there(port)) told_[index_of(port)].frames_lost = parts_.buses.serving(port).frames_lost();
  }
  begin_claim();
  for (const Port port : all_ports) {
    if (parts_.buses.is_there(port)) tell_port_state(port, false);
  }
  tell_wall_clock();
  tell_health();
  for (const CommandGiven& command : parts_.first) observe(now(), command);
  decide_if_due();
  while (!is_over()) {
    // Before the wait, which might not end without a timer.
    if (timer_failure_) return give_up(*timer_failure_);
    if (parts_.core.claim().is_lost() && !is_shutting_down_)
      return give_up({.code = 0, .what = rival_text(parts_.core.claim())});
    std::array<epoll_event, epoll_events> events{};
    const bool must_not_wait = decide_now_ || parts_.status_socket.has_waiting_requests();
    if (!must_not_wait) expected_at_ = wake_at_;
    const int count = ::epoll_wait(epoll_.get(), events.data(), epoll_events, must_not_wait ? 0 : -1);
    if (count < 0 && errno != EINTR) return give_up(os_error("epoll_wait"));
    ++counters_.wake_ups;
    catch_up(monotonic_now());
    for (int i = 0; i < count; ++i) {
      wake(events[static_cast<std::size_t>(i)].data.u32);
      // An urgent decision does not wait for the other descriptors.
      if (decide_now_) decide_if_due();
    }
    if (parts_.status_socket.has_waiting_requests()) parts_.status_socket.serve(answer_);
    decide_if_due();
  }
  return is_leaving_ ? LoopEnd::left : LoopEnd::ended;
}

/// Opens with a last decision: for a loop that cannot wait, that nothing wakes, or that was left half-way.
void Loop::open_for_good() {
  shut_down();
  decide();
}

Result<LoopEnd, OsError> Loop::give_up(const OsError& error) {
  open_for_good();
  return failure(error);
}

void Loop::wake(std::uint32_t tag) {
  if (tag == tag_signals) return read_signals();
  if (tag == tag_status_socket) return parts_.status_socket.serve(answer_);
  if (tag == tag_lines) return look_at_lines();
  if (tag == tag_timer) {
    std::uint64_t expirations = 0;
    static_cast<void>(::read(timer_.get(), &expirations, sizeof(expirations)));
    return;
  }
  if (tag < port_count) return read_port(static_cast<Port>(tag));
  parts_.watched[tag - tag_watched].call();
}

TimePoint Loop::now() {
  const TimePoint at = monotonic_now();
  catch_up(at);
  return std::max(latest_time_, at);
}

void Loop::observe(TimePoint at, const ObservedThing& what) {
  latest_time_ = std::max(latest_time_, at);
  const Observation observation{.at = latest_time_, .what = what};
  for (CoreTap* tap : parts_.taps) tap->observed(observation);
  if (parts_.core.observe(observation) == Urgency::decide_now) decide_now_ = true;
}

void Loop::carry_out(const CommandGiven& command) {
  observe(now(), command);
  decide();
}

void Loop::read_signals() {
  signalfd_siginfo info{};
  while (::read(signals_.get(), &info, sizeof(info)) == static_cast<ssize_t>(sizeof(info))) {
    take_signal(static_cast<int>(info.ssi_signo), info.ssi_code, {.user_id = info.ssi_uid, .process_id = info.ssi_pid});
  }
}

/// SIGHUP has two meanings: a process sent it and requests a reload, or the kernel sent it because the terminal is
/// gone, and with it the user who started the daemon there.
void Loop::take_signal(int number, int code, const SignalFrom& from) {
  const bool wants_reload = number == SIGHUP && code != SI_KERNEL && parts_.on_reload;
  if (wants_reload) return parts_.on_reload(from);
  if (is_shutting_down_ && !is_leaving_) ends_at_once_ = true;
  shut_down();
}

void Loop::shut_down() {
  if (!is_shutting_down_ || is_leaving_) parts_.notify.stopping();
  is_leaving_ = false;
  end_core();
}

void Loop::leave() {
  if (is_shutting_down_) return;
  is_leaving_ = true;
  end_core();
}

void Loop::end_core() {
  if (is_shutting_down_) return;
  is_shutting_down_ = true;
  shut_down_at_ = now();
  observe(shut_down_at_, CommandGiven{.command = Command::shut_down});
  decide_now_ = true;
}

bool Loop::is_over() const {
  if (!is_shutting_down_) return false;
  return is_shut_down_ || ends_at_once_ || latest_time_ - shut_down_at_ > shut_down_max;
}

// --- ports ----------------------------------------------------------------------------------------------------------

void Loop::read_port(Port port) {
  BusPort& bus = parts_.buses.serving(port);
  bool was_down = false;
  // Remaining frames wait in the port, which stays readable.
  for (int i = 0; i < frames_per_wake_up && !decide_now_; ++i) {
    ReceivedFrame received;
    const ReadStatus status = bus.read(received);
    if (status == ReadStatus::empty) break;
    if (status == ReadStatus::down) {
      was_down = true;
      break;
    }
    const TimePoint read_at = received.received_at;
    if (is_late(read_at)) {
      if (!take_old_frame(port, received, must_discard(read_at))) {
        observe(latest_time_, FramesLost{.port = port, .count = 1});
      }
      catch_up(read_at);
      break;
    }
    expected_at_ = read_at;
    take_frame(port, received);
  }
  tell_port_state(port, was_down);
  for (const Port other : all_ports) {
    const bool is_along = other != port && parts_.buses.is_there(other);
    if (is_along && parts_.buses.served_by[index_of(other)] == port) tell_port_state(other, was_down);
  }
}

bool Loop::is_late(TimePoint at) const {
  return at - expected_at_ > lateness_max;
}

bool Loop::must_discard(TimePoint at) const {
  return at - parts_.core.decided_at() > loop_gap_max;
}

/// Called on waking, with each frame, and whenever the clock is read for an observation or a decision, because a
/// process can be stopped anywhere. Waiting frames are at most as old as the stall; they are handled with that age, and
/// no decision is made before all are in. After a stall longer than the core bridges (loop_gap_max) they are discarded:
/// the core then invalidates all data and must not fill it with frames from before.
void Loop::catch_up(TimePoint at) {
  if (is_late(at)) {
    std::array<bool, port_count> was_down{};
    const bool discards = must_discard(at);
    for (const Port port : all_ports) {
      // The port that serves another one precedes it.
      if (!parts_.buses.is_there(port)) continue;
      const bool is_drained = !parts_.buses.is_own(port);
      const Port serving = parts_.buses.served_by[index_of(port)];
      was_down[index_of(port)] = is_drained ? was_down[index_of(serving)] : drain_port(port, discards);
    }
    expected_at_ = at;
    // After the frames, because this observation has the current time.
    for (const Port port : all_ports) {
      if (parts_.buses.is_there(port)) tell_port_state(port, was_down[index_of(port)]);
    }
  }
  expected_at_ = at;
}

/// Handles or discards all waiting frames. True: the port was down meanwhile.
bool Loop::drain_port(Port port, bool discards) {
  BusPort& bus = parts_.buses.serving(port);
  std::uint64_t discarded = 0;
  bool was_down = false;
  for (int i = 0; i < backlog_max; ++i) {
    ReceivedFrame received;
    const ReadStatus status = bus.read(received);
    if (status == ReadStatus::empty) break;
    was_down = was_down || status == ReadStatus::down;  // frames after the loss are as old as the others
    if (status == ReadStatus::frame && !take_old_frame(port, received, discards)) ++discarded;
  }
  if (discarded > 0) observe(latest_time_, FramesLost{.port = port, .count = discarded});
  return was_down;
}

/// False: the frame was discarded. An error frame is a state of the controller, not a measurement, and is always
/// handled: a bus-off of that time lasts until a frame is received again.
bool Loop::take_old_frame(Port port, ReceivedFrame received, bool discards) {
  if (discards && !received.frame.is_error) return false;
  received.received_at = latest_time_;
  take_frame(port, received);
  return true;
}

void Loop::take_frame(Port port, const ReceivedFrame& received) {
  counters_.bits_seen[index_of(port)] += static_cast<std::uint64_t>(bits_on_wire(received.frame));
  if (received.frame.is_error) {
    return observe(received.received_at,
                   BusErrorSeen{.port = port, .classes = received.frame.id, .controller = received.frame.data[1]});
  }
  if (received.is_own) return observe(received.received_at, FrameEchoed{.port = port, .frame = received.frame});
  observe(received.received_at, FrameReceived{.port = port, .frame = received.frame});
}

void Loop::tell_port_state(Port port, bool was_down) {
  const BusPort& bus = parts_.buses.serving(port);
  Told& told = told_[index_of(port)];
  // Down and up again between two calls is still a loss.
  if (was_down && told.is_up) {
    told.is_up = false;
    observe(now(), PortChanged{.port = port, .is_up = false});
  }
  const bool is_up = bus.state() == BusState::up;
  if (is_up != told.is_up) {
    told.is_up = is_up;
    observe(now(), PortChanged{.port = port, .is_up = is_up});
  }
  // On a shared bus a loss is observed once, like the frames.
  if (!parts_.buses.is_own(port)) return;
  if (const std::uint64_t lost = bus.frames_lost(); lost != told.frames_lost) {
    observe(now(), FramesLost{.port = port, .count = lost - std::exchange(told.frames_lost, lost)});
  }
}

void Loop::maintain_ports() {
  if (latest_time_ - maintained_at_ < maintain_period) return;
  maintained_at_ = latest_time_;
  for (const Port port : all_ports) {
    if (parts_.buses.is_own(port)) parts_.buses.serving(port).maintain();
  }
  for (const Port port : all_ports) {
    if (parts_.buses.is_there(port)) tell_port_state(port, false);
  }
  look_at_rate();
  maintain_lines();
}

/// Only logged: the data of modules that cannot be received goes stale by itself.
void Loop::look_at_rate() {
  if (!parts_.rate.update(parts_.buses.internal())) return;
  parts_.journal.log(parts_.rate.severity(false), parts_.rate.finding().text);
}

// --- lines, clock, store --------------------------------------------------------------------------------------------

void Loop::look_at_lines() {
  if (parts_.lines == nullptr) return;
  const LineImage image = parts_.lines->look();
  const TimePoint at = now();
  observe(at, LinesSeen{.image = image});
  if (const auto pwm = parts_.lines->lines().pulses(at)) observe(at, PulsesSeen{.pwm = *pwm});
}

void Loop::read_intake_air() {
  if (parts_.intake_air == nullptr) return;
  if (const auto reading_dC = parts_.intake_air->take_dC()) {
    observe(now(), IntakeAirSeen{.temperature_dC = *reading_dC});
  }
}

void Loop::drive_lines(const ContactorOutputs& outputs, TimePoint decided_at) {
  if (parts_.lines == nullptr) return;
  // The lines keep their levels, the watchdog line included, until the next decision, which follows at once.
  if (is_too_late(outputs, monotonic_now() - decided_at)) {
    decide_now_ = true;
    return;
  }
  const std::optional<LineImage> failed = parts_.lines->drive(outputs);
  if (failed) observe(now(), LinesSeen{.image = *failed});
}

void Loop::maintain_lines() {
  if (parts_.lines == nullptr) return;
  GpioLines& lines = parts_.lines->lines();
  lines.maintain();
  const std::string error = lines.state() == GpioState::failed ? lines.last_error() : "";
  if (std::exchange(told_lines_, lines.state()) == lines.state() && error == told_lines_error_) return;
  told_lines_error_ = error;
  if (error.empty()) return parts_.journal.log(Severity::info, "GPIO: " + std::string(to_text(lines.state())));
  parts_.journal.log(Severity::error, "GPIO: " + error);
}

/// First observation of the session.
void Loop::begin_claim() {
  const ClaimPlan& plan = parts_.claim;
  if (plan.length <= Duration{}) return;
  const TimePoint at = now();
  const bool is_kept = plan.held_until != TimePoint{} && at - plan.held_until < plan.kept_max;
  observe(at, ClaimBegins{.length = plan.length, .is_kept = is_kept});
}

void Loop::tell_wall_clock() {
  const auto since_1970 = std::chrono::system_clock::now().time_since_epoch();
  observe(now(), WallClockSeen{.unix_time_ms = to_ms(since_1970)});
}

void Loop::tell_health() {
  OwnHealth health = parts_.store.health();
  health.store_unreadable =
      parts_.store.found().found == FileFound::unreadable && parts_.core.ticks() < unreadable_told_ticks;
  health.history_write_failed = parts_.history != nullptr && parts_.history->is_failing();
  if (health == told_health_) return;
  if (health.store_write_failed && !told_health_.store_write_failed) {
    parts_.journal.log(Severity::warning, "state file: write failed: " + parts_.store.last_error());
  }
  told_health_ = health;
  observe(now(), HealthSeen{.health = health});
}

/// A store that is busy gets the state with the next decision.
void Loop::keep_state() {
  const std::uint32_t generation = parts_.core.persistent_generation();
  if (generation != kept_generation_ && parts_.store.offer(parts_.core.persistent())) kept_generation_ = generation;
}

// --- decisions ------------------------------------------------------------------------------------------------------

void Loop::decide_if_due() {
  if (decide_now_ || now() >= wake_at_) decide();
  // Not within decide(): it may be called for a client, and this writes to clients too.
  if (std::exchange(is_tick_unfinished_, false)) after_tick();
}

void Loop::decide() {
  look_at_lines();
  read_intake_air();
  const TimePoint at = now();
  if (at >= wake_at_) {
    is_tick_unfinished_ = true;
    if (at - wake_at_ > tick_period) ++counters_.ticks_late;
    counters_.latest = std::max(counters_.latest, at - wake_at_);
  }
  decide_now_ = false;
  latest_time_ = at;
  const Decisions decisions = parts_.core.decide(at);
  // Before they are executed: a frame that a bus refuses becomes an observation, which follows this decision.
  for (CoreTap* tap : parts_.taps) tap->decided(at, decisions);
  if (parts_.lines != nullptr) parts_.lines->decided();
  drive_lines(decisions.outputs, at);
  send(decisions, at);
  for (const Event& event : decisions.events) parts_.journal.log(severity_of(event), to_text(event));
  wake_at_ = decisions.wake_at;
  is_shut_down_ = decisions.is_shut_down;
  drive_.update(parts_.core);
  keep_state();
  arm_timer();
  const MasterClaim& claim = parts_.core.claim();
  const bool is_set_up = !claim.is_listening() && !claim.is_lost() && !decisions.outputs.any_contactor();
  if (!is_ready_ && !is_shutting_down_ && is_set_up) {
    is_ready_ = true;
    parts_.notify.ready();
  }
}

void Loop::send(const Decisions& decisions, TimePoint decided_at) {
  for (const OutgoingFrame& outgoing : decisions.frames) {
    const bool was_away = is_too_late(outgoing, monotonic_now() - decided_at);
    if (!was_away && parts_.buses.serving(outgoing.port).send(outgoing.frame)) continue;
    // The reaction of the core can wait for the next tick; a bus that accepts no frames must not make the loop spin.
    // After a stall of the loop a new decision is due at once.
    const bool decide_now_before = decide_now_ || was_away;
    // With the time of the decision: after a stall the frames that wait to be read are no younger.
    observe(decided_at, SendFailed{.port = outgoing.port, .frame = outgoing.frame});
    decide_now_ = decide_now_before;
  }
}

void Loop::after_tick() {
  parts_.notify.tick_decided(latest_time_);
  maintain_ports();
  tell_health();
  parts_.status_socket.publish(latest_time_, picture_);
  if (latest_time_ - told_people_at_ < tell_people_period) return;
  told_people_at_ = latest_time_;
  tell_wall_clock();
  parts_.notify.status(latest_time_, summary_line(parts_.core));
  for (const auto& tell : parts_.each_second) tell();
  parts_.journal.tell_lost();
}

void Loop::arm_timer() {
  const Duration since_epoch = wake_at_.time_since_epoch();
  const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(since_epoch);
  itimerspec when{};
  when.it_value.tv_sec = seconds.count();
  when.it_value.tv_nsec = (since_epoch - seconds).count();
  // A time in the past fires at once; only 0, at which no tick is due, would disarm the timer.
  if (::timerfd_settime(timer_.get(), TFD_TIMER_ABSTIME, &when, nullptr) != 0) {
    timer_failure_ = os_error("timerfd_settime");
  }
}

std::string summary_line(const Core& core) {
  std::string line(to_text(core.sequence().phase));
  if (core.claim().stage() != ClaimStage::held) line += ", " + std::string(to_text(core.claim().stage()));
  const auto add = [&](Unit unit, const Measured<std::int32_t>& value) {
    if (value.is_valid()) line += ", " + value_text(unit, value.value);
  };
  add(Unit::mV, core.pack().pack_voltage_mV);
  add(Unit::mA, core.pack().current_mA);
  if (core.soc_permille()) line += ", SOC " + value_text(Unit::permille, *core.soc_permille());
  for (const FaultRow& row : fault_table()) {
    if (core.faults().state(row.id).is_present()) line += ", fault " + std::string(row.name);
  }
  return line;
}

}  // namespace bmu

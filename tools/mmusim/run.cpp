#include "tools/mmusim/run.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <string>

#include <sys/epoll.h>
#include <sys/signalfd.h>
#include <sys/timerfd.h>
#include <unistd.h>

namespace bmu::sim {
namespace {

/// Maximum number of frames read before the timer is served: a flooded bus must not stop the simulation.
constexpr int frames_per_wake_up = 1'000;
constexpr Duration maintain_period = 100ms;

OsError os_error(const char* what) {
  return {errno, what};
}

timespec to_timespec(Duration duration) {
  const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(duration);
  return {.tv_sec = seconds.count(), .tv_nsec = (duration - seconds).count()};
}

Result<void, OsError> watch(const OwnedFd& epoll, int fd) {
  epoll_event event{};
  event.events = EPOLLIN;
  event.data.fd = fd;
  if (::epoll_ctl(epoll.get(), EPOLL_CTL_ADD, fd, &event) != 0) return failure(os_error("epoll_ctl"));
  return {};
}

/// Clears the number of expirations of a timer; it is not used, because the clock gives the time.
void drain(const OwnedFd& timer) {
  std::uint64_t expirations = 0;
  (void)!::read(timer.get(), &expirations, sizeof expirations);
}

std::string ms_text(Duration duration) {
  std::array<char, 32> text{};
  (void)std::snprintf(text.data(), text.size(), "%.3f ms", to_s(duration) * 1e3);
  return text.data();
}

bool is_module_answer(std::uint32_t id) {
  return id > internal_bus::status.base_id && id < internal_bus::command.base_id;
}

}  // namespace

Result<void, OsError> Run::init() {
  epoll_ = OwnedFd(::epoll_create1(EPOLL_CLOEXEC));
  if (!epoll_.is_open()) return failure(os_error("epoll_create1"));
  timer_ = OwnedFd(::timerfd_create(CLOCK_BOOTTIME, TFD_NONBLOCK | TFD_CLOEXEC));
  if (!timer_.is_open()) return failure(os_error("timerfd_create"));
  if (auto armed = arm_timer(); !armed) return armed;
  sigset_t stops{};
  sigemptyset(&stops);
  sigaddset(&stops, SIGINT);
  sigaddset(&stops, SIGTERM);
  signals_ = OwnedFd(::signalfd(-1, &stops, SFD_NONBLOCK | SFD_CLOEXEC));
  if (!signals_.is_open()) return failure(os_error("signalfd"));
  for (const int fd : {timer_.get(), signals_.get()}) {
    if (auto watched = watch(epoll_, fd); !watched) return watched;
  }
  for (const std::unique_ptr<BusPort>& port : ports_.ports) {
    if (port == nullptr) continue;
    if (auto watched = watch(epoll_, port->fd()); !watched) return watched;
  }
  return events_ ? watch(epoll_, events_->fd()) : Result<void, OsError>{};
}

/// Arms the timer for the next time on a grid that starts with the run, because most periods are multiples of its step.
Result<void, OsError> Run::arm_timer() {
  const Duration step = simulator_->is_busy() ? Plant::step_length : Simulator::calm_step;
  const TimePoint wake_at = started_at_ + ((simulator_->now() - started_at_) / step + 1) * step + counts_.left_out;
  const itimerspec once{.it_interval = {}, .it_value = to_timespec(wake_at.time_since_epoch())};
  if (::timerfd_settime(timer_.get(), TFD_TIMER_ABSTIME, &once, nullptr) != 0) {
    return failure(os_error("timerfd_settime"));
  }
  return {};
}

Result<void, OsError> Run::run() {
  if (auto ready = init(); !ready) return ready;
  while (!is_over()) {
    std::array<epoll_event, 8> events{};
    const int count = ::epoll_wait(epoll_.get(), events.data(), static_cast<int>(events.size()), -1);
    if (count < 0 && errno != EINTR) return failure(os_error("epoll_wait"));
    for (int index = 0; index < count; ++index) {
      const int fd = events[static_cast<std::size_t>(index)].data.fd;
      if (fd == signals_.get()) take_signal();
      if (fd == timer_.get()) drain(timer_);
      if (events_ && fd == events_->fd()) take_events();
    }
    if (ended_by_signal_) return {};
    read_frames();
    for (const Port bus : all_ports) {
      if (bus != Port::internal) read_frames_elsewhere(bus);
    }
    advance();
    tell_port();
    if (auto armed = arm_timer(); !armed) return armed;
  }
  return {};
}

void Run::take_signal() {
  signalfd_siginfo signal{};
  const auto length = ::read(signals_.get(), &signal, sizeof signal);
  if (length == sizeof signal) ended_by_signal_ = stop_signal_name(static_cast<int>(signal.ssi_signo));
}

void Run::take_events() {
  for (const LiveEvents::Line& line : events_->read()) apply(line);
  if (!events_->is_over()) return;
  // Before it is closed: another process with the same open description, e.g. a shell, would keep it registered in
  // epoll.
  static_cast<void>(::epoll_ctl(epoll_.get(), EPOLL_CTL_DEL, events_->fd(), nullptr));
  events_.reset();
}

void Run::apply(const LiveEvents::Line& line) {
  auto done =
      line.is_too_long
          ? failure(ScenarioProblem{.column = 1, .found = "a line that is too long", .wanted = "4096 bytes at most"})
          : simulator_->apply(line.text);
  if (!done) {
    done.error().line = line.number;
    std::fprintf(stderr, "mmusim: %s\n", to_text(done.error(), events_->name()).c_str());
    ++events_counted_.refused;
    return;
  }
  ++events_counted_.taken;
  if (options_->is_quiet) return;
  std::fprintf(stderr, "%8.3f s  %s\n", to_s(simulator_->now() - started_at_), line.text.c_str());
}

TimePoint Run::virtual_now() {
  TimePoint now = monotonic_now() - counts_.left_out;
  if (const Duration late = now - simulator_->now(); late > catch_up_max) {
    counts_.left_out += late - catch_up_max;
    now -= late - catch_up_max;
  }
  return now;
}

bool Run::is_over() const {
  const ScenarioPlayer& script = simulator_->script();
  if (script.verdict() != ScriptVerdict::open) return true;
  if (options_->seconds) return to_s(simulator_->now() - started_at_) >= *options_->seconds;
  return script.scenario().is_test() && script.is_over();
}

void Run::read_frames() {
  ReceivedFrame received;
  for (int count = 0; count < frames_per_wake_up; ++count) {
    const ReadStatus status = port_->read(received);
    if (status == ReadStatus::empty) return;
    if (status == ReadStatus::frame) observe(received);
  }
}

void Run::read_frames_elsewhere(Port bus) {
  const std::unique_ptr<BusPort>& port = ports_.ports.at(static_cast<std::size_t>(bus));
  if (port == nullptr) return;
  ReceivedFrame received;
  for (int count = 0; count < frames_per_wake_up; ++count) {
    const ReadStatus status = port->read(received);
    if (status == ReadStatus::empty) return;
    if (status == ReadStatus::frame) simulator_->observe_elsewhere(bus, received.frame, seen_at(received));
  }
}

TimePoint Run::seen_at(const ReceivedFrame& received) const {
  return std::max(received.received_at - counts_.left_out, simulator_->now());
}

void Run::observe(const ReceivedFrame& received) {
  ++counts_.frames_received;
  if (received.frame.id == internal_bus::poll.base_id) {
    ++counts_.polls;
    polled_at_ = received.received_at;
    is_answer_awaited_ = true;
  }
  simulator_->observe(received.frame, seen_at(received));
}

void Run::advance() {
  for (const SentFrame& sent : simulator_->advance(virtual_now())) send(sent);
  send_elsewhere(Port::charger, simulator_->sent_by_charger());
  send_elsewhere(Port::inverter, simulator_->sent_by_inverter());
  send_elsewhere(Port::second_pack, simulator_->sent_by_second_pack());
  send_elsewhere(Port::vehicle, simulator_->sent_by_vehicle());
  tell_news();
}

void Run::send_elsewhere(Port port, std::span<const SentFrame> frames) {
  for (const SentFrame& sent : frames) {
    if (!ports_.serving(port).send(sent.frame)) ++counts_.sends_failed;
  }
}

void Run::send(const SentFrame& sent) {
  if (!port_->send(sent.frame)) {
    ++counts_.sends_failed;
    return;
  }
  ++counts_.frames_sent;
  if (is_answer_awaited_ && is_module_answer(sent.frame.id)) {
    is_answer_awaited_ = false;
    counts_.worst_answer = std::max(counts_.worst_answer, monotonic_now() - polled_at_);
  }
}

void Run::tell_news() const {
  if (options_->is_quiet) return;
  for (const ScenarioNews& news : simulator_->script().news()) {
    std::fprintf(stderr, "%8.3f s  %s\n", to_s(news.at - started_at_), news_text(simulator_->script(), news).c_str());
  }
}

void Run::tell_port() {
  const TimePoint now = monotonic_now();
  if (now >= maintain_at_) {
    for (const std::unique_ptr<BusPort>& port : ports_.ports) {
      if (port != nullptr) port->maintain();
    }
    maintain_at_ = now + maintain_period;
  }
  if (port_->state() == told_state_) return;
  told_state_ = port_->state();
  std::fprintf(stderr, "mmusim: %s is %s\n", port_->name().c_str(), std::string(to_text(told_state_)).c_str());
}

RunResult Run::result() const {
  const auto number = [](std::uint64_t value) { return std::to_string(value); };
  const SimulatorCounts counts = simulator_->counts();
  RunResult result{.script = &simulator_->script(),
                   .ran_s = to_s(simulator_->now() - started_at_),
                   .ended_by_signal = ended_by_signal_};
  result.lines = {
      "bus: " + port_->name(),
      "frames: " + number(counts_.frames_sent) + " sent, " + number(counts_.sends_failed) + " rejected by the bus, " +
          number(counts_.frames_received) + " received, " + number(port_->frames_lost()) + " missed",
      "polls: " + number(counts_.polls) + " seen, " + number(counts.polls_answered) + " answers of modules, " +
          number(counts.answers_cut_short) + " interrupted by the next poll, slowest start " +
          ms_text(counts_.worst_answer),
      "contactors: " + number(counts.contactor_commands) + " commands, " + number(counts.contactor_timeouts) +
          " time-outs",
  };
  if (!options_->events.empty()) {
    result.events = events_counted_;
    result.lines.push_back("events from outside: " + number(events_counted_.taken) + " taken, " +
                           number(events_counted_.refused) + " refused");
  }
  if (counts_.left_out > Duration::zero()) {
    result.lines.push_back("time: " + ms_text(counts_.left_out) + " skipped because the process was stalled");
  }
  return result;
}

}  // namespace bmu::sim

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <system_error>

#include <poll.h>

#include "daemon/shell/can/bus_port.hpp"
#include "tools/bmudump/dump.hpp"
#include "tools/bmudump/follow_screen.hpp"
#include "tools/common/bus_text.hpp"

namespace bmu::dump {
namespace {

/// Maximum number of frames read from one bus before the other buses are read and the output is flushed.
constexpr int batch_size = 1'000;
constexpr Duration maintain_period = 100ms;
/// A bus without frames for this time from the start is reported, because it may be the wrong one: every bus of a pack
/// is busier.
constexpr Duration silence_told_after = 2s;

struct LiveBus {
  std::unique_ptr<BusPort> port;
  std::uint64_t lost = 0;
  bool is_silent = true;  // since the start
};

void tell_state(const BusPort& port) {
  std::fprintf(stderr, "bmudump: %s is %s, waiting for it\n", port.name().c_str(),
               std::string(to_text(port.state())).c_str());
}

std::vector<std::string> can_interfaces() {
  constexpr int can_link_type = 280;  // ARPHRD_CAN
  std::vector<std::string> names;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator("/sys/class/net", ignored)) {
    int type = 0;
    if (std::ifstream(entry.path() / "type") >> type && type == can_link_type) {
      names.push_back(entry.path().filename());
    }
  }
  std::sort(names.begin(), names.end());
  return names;
}

class LiveRun {
 public:
  LiveRun(const Options& options, Dump& dump)
      : options_(&options), dump_(&dump), screen_(dump.follow(), options.is_coloured, true) {}

  [[nodiscard]] bool open();
  void run();

 private:
  [[nodiscard]] bool find_names();
  void wait();
  [[nodiscard]] bool is_over() const;
  void read_batch(LiveBus& bus);
  void tell_loss(LiveBus& bus);
  void tell_silence();
  void tell_unheard() const;
  [[nodiscard]] std::int64_t wall_us(TimePoint at) const {
    return start_wall_us_ + std::chrono::duration_cast<std::chrono::microseconds>(at - start_).count();
  }

  const Options* options_;
  Dump* dump_;
  FollowScreen screen_;
  std::vector<std::string> names_;
  std::vector<LiveBus> buses_;
  // Displayed times are the wall clock at the start, continued by the monotonic clock: setting the clock makes no gap.
  TimePoint start_ = monotonic_now();
  std::int64_t start_wall_us_ =
      std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::system_clock::now().time_since_epoch())
          .count();
  TimePoint end_ = TimePoint::max();
  TimePoint heard_ = start_;
  TimePoint tell_silence_at_ = start_ + silence_told_after;
};

bool LiveRun::open() {
  if (!find_names()) return false;
  PortOptions port_options;
  port_options.receive_errors = true;
  for (const std::string& name : names_) {
    auto port = open_bus(name, port_options);
    if (!port) {
      std::fprintf(stderr, "bmudump: %s\n", open_failure_text(name, port.error()).c_str());
      return false;
    }
    if ((*port)->state() != BusState::up) tell_state(**port);
    buses_.push_back({.port = std::move(*port)});
  }
  if (options_->seconds) {
    end_ = start_ + std::chrono::duration_cast<Duration>(std::chrono::duration<double>(*options_->seconds));
  }
  return true;
}

/// Expands "any" to every CAN interface that exists now.
bool LiveRun::find_names() {
  for (const BusWord& word : options_->buses) {
    if (word.name != "any") {
      names_.push_back(word.name);
      continue;
    }
    const std::vector<std::string> all = can_interfaces();
    names_.insert(names_.end(), all.begin(), all.end());
  }
  if (names_.empty()) std::fputs("bmudump: any: there is no CAN interface\n", stderr);
  return !names_.empty();
}

bool LiveRun::is_over() const {
  const TimePoint now = monotonic_now();
  const bool is_silent = options_->silence && now - heard_ >= *options_->silence;
  return dump_->is_done() || is_stop_requested() || now >= end_ || is_silent;
}

void LiveRun::run() {
  TimePoint maintain_at = start_;
  while (!is_over()) {
    wait();
    for (LiveBus& bus : buses_) read_batch(bus);
    dump_->flush();
    screen_.draw_if_due(wall_us(monotonic_now()));
    tell_silence();
    if (monotonic_now() < maintain_at) continue;
    for (LiveBus& bus : buses_) bus.port->maintain();
    maintain_at = monotonic_now() + maintain_period;
  }
  dump_->heard_until(wall_us(monotonic_now()));
  tell_unheard();
}

void LiveRun::wait() {
  std::vector<pollfd> ready;
  for (const LiveBus& bus : buses_) ready.push_back({bus.port->fd(), POLLIN, 0});
  ready.push_back({screen_.keys_fd(), POLLIN, 0});
  const TimePoint end = options_->silence ? std::min(end_, heard_ + *options_->silence) : end_;
  const std::int64_t left_ms = std::clamp<std::int64_t>(to_ms(end - monotonic_now()) + 1, 0, to_ms(maintain_period));
  if (::poll(ready.data(), ready.size(), static_cast<int>(left_ms)) > 0 && ready.back().revents != 0) {
    screen_.read_keys();
  }
}

void LiveRun::read_batch(LiveBus& bus) {
  ReceivedFrame received;
  for (int count = 0; count < batch_size && !dump_->is_done(); ++count) {
    const ReadStatus status = bus.port->read(received);
    if (status == ReadStatus::empty) break;
    if (status == ReadStatus::down) {
      dump_->forget_counters(bus.port->name());
      tell_state(*bus.port);
      break;
    }
    bus.is_silent = false;
    heard_ = received.received_at;
    dump_->show({.kind = LogLineKind::frame,
                 .direction = received.is_own ? Direction::sent : Direction::received,
                 .time_us = wall_us(received.received_at),
                 .bus = bus.port->name(),
                 .frame = received.frame});
  }
  tell_loss(bus);
}

void LiveRun::tell_loss(LiveBus& bus) {
  const std::uint64_t lost = bus.port->frames_lost();
  if (lost == bus.lost) return;
  std::fprintf(stderr, "bmudump: %s: %llu frames lost, this program could not keep up\n", bus.port->name().c_str(),
               static_cast<unsigned long long>(lost - bus.lost));
  dump_->count_lost(bus.port->name(), lost - bus.lost);
  bus.lost = lost;
}

/// Reports silent buses once: a bus unix:NAME exists as soon as it is named, and a misspelt one stays silent
/// permanently. A bus that is down has been reported already.
void LiveRun::tell_silence() {
  if (monotonic_now() < tell_silence_at_) return;
  tell_silence_at_ = TimePoint::max();
  for (const LiveBus& bus : buses_) {
    if (!bus.is_silent || bus.port->state() != BusState::up) continue;
    std::fprintf(stderr, "bmudump: no frame on %s yet; is another program on this bus?\n", bus.port->name().c_str());
  }
}

/// Called at the end, however early: a reader of the output alone cannot distinguish a quiet bus from one without any
/// node.
void LiveRun::tell_unheard() const {
  const double span_s = to_s(monotonic_now() - start_);
  for (const LiveBus& bus : buses_) {
    if (!bus.is_silent) continue;
    std::fprintf(stderr, "bmudump: %s: no frame received in %.1f s\n", bus.port->name().c_str(), span_s);
  }
}

}  // namespace

int dump_live(const Options& options, Dump& dump) {
  LiveRun live(options, dump);
  if (!live.open()) return exit_system;
  live.run();
  return exit_ok;
}

}  // namespace bmu::dump

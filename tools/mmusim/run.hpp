// The simulator on a real bus in real time: one epoll over the bus, a timer, the stop signals and the live events.
//
// The timer fires every millisecond while a device of the pack is busy with an answer, and else every 5 ms: a pack at
// rest takes little of a machine with one processor, or an emulated one.
//
// Virtual time follows the monotonic clock. After a delay it catches up millisecond by millisecond; beyond
// `catch_up_max` the remaining time is skipped and counted: a stopped simulation must not replay its past onto the bus.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "daemon/shell/can/bus_port.hpp"
#include "daemon/shell/system/owned_fd.hpp"
#include "mmu/scenario/simulator.hpp"
#include "tools/mmusim/live_events.hpp"
#include "tools/mmusim/options.hpp"
#include "tools/mmusim/result.hpp"

namespace bmu::sim {

inline constexpr Duration catch_up_max = 100ms;

struct RunCounts {
  std::uint64_t frames_received = 0;
  std::uint64_t frames_sent = 0;
  std::uint64_t sends_failed = 0;
  std::uint64_t polls = 0;
  Duration worst_answer{};  // from a POLL being read to the first frame of a module after it
  Duration left_out{};      // time that was skipped
};

/// The buses with a device of the emulated pack, by the daemon's names for them.
struct RunPorts {
  ServedBy served_by = all_ports;
  std::array<std::unique_ptr<BusPort>, port_count> ports{};  // null: served by another, or without a device

  [[nodiscard]] BusPort& serving(Port port) const {
    return *ports.at(static_cast<std::size_t>(served_by.at(static_cast<std::size_t>(port))));
  }
};

class Run {
 public:
  Run(const Options& options, Simulator& simulator, RunPorts ports, std::optional<LiveEvents> events,
      TimePoint started_at)
      : options_(&options),
        simulator_(&simulator),
        ports_(std::move(ports)),
        port_(&ports_.serving(Port::internal)),
        events_(std::move(events)),
        started_at_(started_at) {}

  /// Runs until a stop signal, the end of --seconds or the script's verdict; without --seconds also until a script that
  /// is a test is over. Precondition: SIGINT and SIGTERM are blocked.
  [[nodiscard]] Result<void, OsError> run();
  /// Precondition: the script has been concluded.
  [[nodiscard]] RunResult result() const;

 private:
  [[nodiscard]] Result<void, OsError> init();
  [[nodiscard]] Result<void, OsError> arm_timer();
  [[nodiscard]] TimePoint virtual_now();
  [[nodiscard]] bool is_over() const;
  void read_frames();
  void read_frames_elsewhere(Port bus);
  [[nodiscard]] TimePoint seen_at(const ReceivedFrame& received) const;
  void observe(const ReceivedFrame& received);
  void advance();
  void send(const SentFrame& sent);
  void send_elsewhere(Port port, std::span<const SentFrame> frames);
  void tell_news() const;
  void tell_port();
  void take_signal();
  void take_events();
  void apply(const LiveEvents::Line& line);

  const Options* options_;
  Simulator* simulator_;
  RunPorts ports_;
  BusPort* port_;  // of the modules
  std::optional<LiveEvents> events_;
  TimePoint started_at_;
  OwnedFd epoll_;
  OwnedFd timer_;
  OwnedFd signals_;
  BusState told_state_ = BusState::up;
  TimePoint maintain_at_{};
  TimePoint polled_at_{};
  bool is_answer_awaited_ = false;
  std::optional<std::string> ended_by_signal_;
  RunCounts counts_;
  EventCounts events_counted_;
};

}  // namespace bmu::sim

// Receives the opening command and records its time: a thread with priority over all others, with its own port on every
// bus.
//
// It sleeps until it is requested to receive from a bus, and only then costs the senders there any time: the embedded
// bus wakes only waiting participants.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "daemon/shell/can/bus_port.hpp"
#include "daemon/shell/system/owned_fd.hpp"

namespace bmu::latency {

/// As monotonic_now(), to the nanosecond.
[[nodiscard]] TimePoint exact_now();

/// Gives the calling thread priority over all ordinary ones; threads that it starts are ordinary. Throws without the
/// right to do so.
void take_priority(int priority);

class Ear {
 public:
  enum class State : std::uint8_t { deaf, asked, listening, heard, released };

  Ear();
  Ear(const Ear&) = delete;
  Ear& operator=(const Ear&) = delete;
  ~Ear();

  /// Returns the number of the bus for the other functions. Before start().
  std::size_t add(const std::string& bus);
  void start(int priority);

  /// To be called from one thread at a time for each bus. After the request it becomes `listening`, until a command
  /// with all contactors open is received.
  void listen(std::size_t bus);
  void release(std::size_t bus);
  [[nodiscard]] State state(std::size_t bus) const { return places_[bus]->state.load(std::memory_order_acquire); }
  /// Time at which the opening command was received.
  [[nodiscard]] TimePoint heard_at(std::size_t bus) const { return places_[bus]->heard_at; }

 private:
  struct Place {
    std::unique_ptr<BusPort> port;
    std::atomic<State> state{State::deaf};
    TimePoint heard_at{};
  };
  void run();
  void look_around();
  void hear(std::size_t bus);
  void ring();

  std::vector<std::unique_ptr<Place>> places_;
  OwnedFd epoll_;
  OwnedFd bell_;
  std::atomic<bool> is_over_{false};
  std::thread thread_;
};

}  // namespace bmu::latency

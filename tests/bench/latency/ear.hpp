// Who hears the command that opens, and says when: a thread ahead of all others, with a seat of its own on every bus.
//
// It sleeps until it is asked to listen to a bus, and only then costs whoever sends there something: the embedded bus
// wakes those that wait, and nobody else.
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

/// The calling thread before all ordinary ones; those it starts are ordinary again. Throws without the right to it.
void take_priority(int priority);

class Ear {
 public:
  enum class State : std::uint8_t { deaf, asked, listening, heard, released };

  Ear();
  Ear(const Ear&) = delete;
  Ear& operator=(const Ear&) = delete;
  ~Ear();

  /// The number of the bus from here on. Before start().
  std::size_t add(const std::string& bus);
  void start(int priority);

  /// From one thread at a time for each bus. Asked, it is `listening` soon, and once a command that opens everything
  /// has come it is `heard`.
  void listen(std::size_t bus);
  void release(std::size_t bus);
  [[nodiscard]] State state(std::size_t bus) const { return places_[bus]->state.load(std::memory_order_acquire); }
  /// When it was heard.
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

// The pulse output of a Bender IR155 on a wire of the emulated machine's chip: a thread that toggles it at the times of
// the monitor.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <mutex>
#include <string>
#include <thread>

#include <fcntl.h>
#include <unistd.h>

#include "daemon/shell/system/owned_fd.hpp"
#include "protocol/ir155.hpp"
#include "tests/rig/gpio/chip.hpp"

namespace bmu::test {

class InsulationMonitor {
 public:
  /// Outputs this reading from now on.
  explicit InsulationMonitor(const ir155::Reading& reading)
      : pwm_(ir155::encode(reading)), thread_([this] { play(); }) {}
  InsulationMonitor(const InsulationMonitor&) = delete;
  InsulationMonitor& operator=(const InsulationMonitor&) = delete;
  /// The wire keeps its level, like one that has come off.
  ~InsulationMonitor() {
    is_over_ = true;
    thread_.join();
  }
  void say(const ir155::Reading& reading) {
    const std::lock_guard lock(mutex_);
    pwm_ = ir155::encode(reading);
  }
  [[nodiscard]] bool works() const { return works_; }

 private:
  using Clock = std::chrono::steady_clock;

  [[nodiscard]] ir155::Pwm pwm() const {
    const std::lock_guard lock(mutex_);
    return pwm_;
  }
  /// On a time grid of its own, so that a late wake-up moves one edge and not all that follow.
  void play() {
    const OwnedFd wire(::open((chip_folder + "line" + std::to_string(pulse_line)).c_str(), O_WRONLY | O_CLOEXEC));
    auto edge_at = Clock::now();
    while (!is_over_) {
      const ir155::Pwm now = pwm();
      const std::chrono::nanoseconds period{1'000'000'000'000 / now.frequency_mHz};
      const std::chrono::nanoseconds high = period * now.duty_permille / 1'000;
      turn(wire, '1', edge_at);
      turn(wire, '0', edge_at + high);
      edge_at += period;
    }
  }
  void turn(const OwnedFd& wire, char level, Clock::time_point at) {
    std::this_thread::sleep_until(at);
    works_ = works_ && ::write(wire.get(), &level, 1) == 1;
  }

  mutable std::mutex mutex_;
  ir155::Pwm pwm_;
  std::atomic<bool> is_over_ = false;
  std::atomic<bool> works_ = true;
  std::thread thread_;
};

}  // namespace bmu::test

// A core and the emulated pack around it in virtual time, without any bus: what one sends the other observes.
#pragma once

#include <string_view>
#include <vector>

#include "daemon/core/core.hpp"
#include "mmu/simulator.hpp"

namespace bmu::test {

class SimRun {
 public:
  SimRun(const CoreConfig& config, Scenario scenario = {});

  /// Both worlds, a millisecond at a time, until `seconds` since the start.
  void run_to(double seconds);
  /// An event of the script language, now.
  void apply(std::string_view event);
  void give(Command command);

  [[nodiscard]] double seconds() const { return to_s(now_ - start); }
  [[nodiscard]] const Core& core() const { return core_; }
  [[nodiscard]] const Simulator& simulator() const { return simulator_; }
  [[nodiscard]] const std::vector<Event>& events() const { return events_; }
  /// Seconds since the start of the first event of this kind; negative if there was none.
  [[nodiscard]] double first(EventId id) const;

  static constexpr TimePoint start{1s};

 private:
  void observe(const ObservedThing& what);
  void decide();

  TimePoint now_ = start;
  Core core_;
  Simulator simulator_;
  TimePoint wake_at_ = start;
  std::vector<CanFrame> echoes_;  // of what the core sent last
  std::vector<Event> events_;
};

}  // namespace bmu::test

// A core and the emulated pack around it in virtual time, driven by a test.
#pragma once

#include <string_view>
#include <vector>

#include "tools/common/virtual_run.hpp"

namespace bmu::test {

class SimRun {
 public:
  SimRun(const CoreConfig& config, Scenario scenario = {});

  /// Runs both, a millisecond at a time, until `seconds` since the start.
  void run_to(double seconds);
  /// Applies an event of the script language now.
  void apply(std::string_view event);
  /// Feeds an observation to the core, as from outside.
  void observe(const ObservedThing& what) { run_.observe(what); }
  void give(Command command, Authority authority = Authority::user);

  [[nodiscard]] double seconds() const { return to_s(run_.elapsed()); }
  [[nodiscard]] const Core& core() const { return run_.core(); }
  [[nodiscard]] const Simulator& simulator() const { return run_.simulator(); }
  /// For changes that the script language cannot express.
  [[nodiscard]] Simulator& simulator() { return run_.simulator(); }
  [[nodiscard]] const std::vector<Event>& events() const { return run_.events(); }
  /// Seconds since the start of the first event of this kind; negative if there was none.
  [[nodiscard]] double first(EventId id) const;

  static constexpr TimePoint start = VirtualRun::start;

 private:
  VirtualRun run_;
};

}  // namespace bmu::test

// A core and the emulated pack around it in virtual time, as tests drive it.
#pragma once

#include <string_view>
#include <vector>

#include "tools/common/virtual_run.hpp"

namespace bmu::test {

class SimRun {
 public:
  SimRun(const CoreConfig& config, Scenario scenario = {});

  /// Both worlds, a millisecond at a time, until `seconds` since the start.
  void run_to(double seconds);
  /// An event of the script language, now.
  void apply(std::string_view event);
  /// Told to the core, as if it had come from outside.
  void observe(const ObservedThing& what) { run_.observe(what); }
  void give(Command command, Authority authority = Authority::user);

  [[nodiscard]] double seconds() const { return to_s(run_.elapsed()); }
  [[nodiscard]] const Core& core() const { return run_.core(); }
  [[nodiscard]] const Simulator& simulator() const { return run_.simulator(); }
  /// For what no script has a word for.
  [[nodiscard]] Simulator& simulator() { return run_.simulator(); }
  [[nodiscard]] const std::vector<Event>& events() const { return run_.events(); }
  /// Seconds since the start of the first event of this kind; negative if there was none.
  [[nodiscard]] double first(EventId id) const;

  static constexpr TimePoint start = VirtualRun::start;

 private:
  VirtualRun run_;
};

}  // namespace bmu::test

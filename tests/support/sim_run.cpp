#include "tests/support/sim_run.hpp"

#include <stdexcept>
#include <string>
#include <utility>

namespace bmu::test {

SimRun::SimRun(const CoreConfig& config, Scenario scenario)
    : run_(config, simulator_config(config), std::move(scenario)) {}

void SimRun::run_to(double seconds) {
  const TimePoint end = start + std::chrono::duration_cast<Duration>(std::chrono::duration<double>(seconds));
  while (run_.now() < end) run_.step();
}

void SimRun::apply(std::string_view event) {
  const auto result = run_.simulator().apply(event);
  if (!result) throw std::runtime_error("scenario event '" + std::string(event) + "' is not understood");
}

void SimRun::give(Command command, Authority authority) {
  run_.observe(CommandGiven{command, authority});
}

double SimRun::first(EventId id) const {
  for (const Event& event : events()) {
    if (event.id == id) return to_s(event.at - start);
  }
  return -1.0;
}

}  // namespace bmu::test

// The key that is wrong in the pack file, named by the event of the fault that comes of it.
#include <string>

#include "config/pack_config.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/folders.hpp"
#include "tests/support/sim_run.hpp"

using namespace bmu;
using test::SimRun;

namespace {

CoreConfig shipped(const std::string& name) {
  const auto pack = load_pack_config(test::in_source("config/packs/" + name + ".json"));
  REQUIRE(pack.has_value());
  return pack->core;
}

/// All events of that kind, one a line.
std::string text_of(const SimRun& run, EventId id) {
  std::string text;
  for (const Event& event : run.events()) {
    if (event.id == id) text += to_text(event) + "\n";
  }
  return text;
}

bool has(const std::string& text, std::string_view words) {
  return text.find(words) != std::string::npos;
}

bool is_present(const SimRun& run, FaultId fault) {
  return run.core().faults().state(fault).is_present();
}

void run_until_present(SimRun& run, FaultId fault, double until_s) {
  while (!is_present(run, fault) && run.seconds() < until_s) run.run_to(run.seconds() + 0.01);
}

}  // namespace

TEST_CASE("the first drive with the sensor the wrong way round names its key", "[scenario][faults][F18]") {
  for (const std::string_view fault : {"sensor current inverted on", "sensor current stuck on"}) {
    CAPTURE(fault);
    SimRun run(shipped("demo-48s"));
    run.apply(fault);
    run.run_to(2);
    run.apply("vehicle on");
    run.run_to(6);
    REQUIRE(run.core().sequence().phase == Phase::closed);
    run.apply("load profile drive");
    run_until_present(run, FaultId::current_contradicts_voltage, 66);
    REQUIRE(is_present(run, FaultId::current_contradicts_voltage));
    CHECK(has(text_of(run, EventId::fault_confirmed), "sensor/invert_current") ==
          (fault == "sensor current inverted on"));
    // And later, of the open pack.
    run.run_to(run.seconds() + 5);
    const LikelyCause cause = run.core().likely_cause(FaultId::current_contradicts_voltage, SimRun::start + 66s);
    CHECK((cause.key == WrongKey::invert_current_by_cells) == (fault == "sensor current inverted on"));
  }
}

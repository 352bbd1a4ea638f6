// Acceptance test of PB_F.2 (24 V competition pack), at the pack as shipped. Procedure of the authors: more than half
// full, the pack carries 25 A for a minute, then 50 A for 10 s. Their figures: a cell drops by about 0.1 V with each
// 25 A, and warms up from 17 to 22 C.
#include <cmath>
#include <string>

#include "tests/support/catch.hpp"
#include "tests/support/complaints.hpp"
#include "tests/support/patched_pack.hpp"
#include "tests/support/sim_run.hpp"

using namespace bmu;

namespace {

/// Immediate voltage drop of the lowest cell at a load step by 25 A, as the modules measure it.
double drop_of_step_V(test::SimRun& run, const std::string& load) {
  const double before_V = run.core().pack().cell_voltage_uV.min / 1e6;
  run.apply("load current_A " + load);
  run.run_to(run.seconds() + 0.25);
  return before_V - run.core().pack().cell_voltage_uV.min / 1e6;
}

}  // namespace

TEST_CASE(
    "the 24 V pack carries 25 A for a minute and 50 A for 10 s, its cells drop by about 0.1 V and warm up to 22 C",
    "[scenario][accept][PB_F.2][BMS_NF.7]") {
  test::SimRun run(test::patched_pack("{}", "lipo-6s-24v.json"));
  run.apply("pack soc_permille 700");
  run.apply("pack ambient_dC 170");
  run.apply("pack temperature_dC 170");
  run.run_to(3.0);
  run.apply("vehicle on");
  run.run_to(9.0);
  const Core& core = run.core();
  REQUIRE(core.sequence().phase == Phase::closed);
  CHECK(core.limits().discharge.limit_mA >= 25'000);
  CHECK(std::abs(core.pack().cell_temperature_dC.max - 170) <= 2);

  const double first_V = drop_of_step_V(run, "25");
  CHECK(first_V > 0.08);
  CHECK(first_V < 0.14);
  run.run_to(run.seconds() + 60.0);
  CHECK(test::complaints(core).empty());
  CHECK(core.watchers().overload.discharge_used_permille() < 100);
  const double second_V = drop_of_step_V(run, "50");
  CHECK(second_V > 0.08);
  CHECK(second_V < 0.14);
  run.run_to(run.seconds() + 9.75);
  CHECK(core.sequence().phase == Phase::closed);
  CHECK(test::complaints(core).empty());
  CHECK(core.pack().cell_voltage_uV.min > core.config().limits.cell_undervoltage.warn);
  run.apply("load current_A 0");
  run.run_to(run.seconds() + 1.0);
  CHECK(core.sequence().phase == Phase::closed);
  CHECK(core.pack().cell_temperature_dC.max >= 205);
  CHECK(core.pack().cell_temperature_dC.max <= 225);
}

// Acceptance test of PB_F.3 (24 V competition pack), at the pack as shipped. Procedure of the authors: an empty pack is
// charged with 15 A to 25.7 V at the charger's terminals, until the current is below a tenth. Their figure: no cell is
// above its limit. No limit of the pack file is changed for this test.
#include <algorithm>
#include <cmath>
#include <string>

#include "tests/support/catch.hpp"
#include "tests/support/complaints.hpp"
#include "tests/support/patched_pack.hpp"
#include "tests/support/sim_run.hpp"

using namespace bmu;

namespace {

double highest_cell_V(const test::SimRun& run) {
  double highest_V = 0.0;
  const Plant& plant = run.simulator().plant();
  for (std::size_t cell = 0; cell < plant.cell_count(); ++cell) {
    highest_V = std::max(highest_V, plant.cell(cell).voltage_V);
  }
  return highest_V;
}

double current_A(const test::SimRun& run) {
  return run.core().pack().current_mA.value / 1e3;
}

}  // namespace

TEST_CASE("the 24 V pack is charged with 15 A from empty to 25.7 V at the charger's terminals, until a tenth flows",
          "[scenario][accept][slow][PB_F.3]") {
  test::SimRun run(test::patched_pack("{}", "lipo-6s-24v.json"));
  run.apply("pack soc_permille 20");
  // It holds 4.19 V per cell at its sense wires; its leads drop 0.56 V at 15 A.
  run.apply("charger voltage_V 25.14");
  run.apply("charger lead_mOhm 37");
  run.apply("charger current_A 15");
  run.apply("charger obeys nobody");
  run.run_to(3.0);
  run.apply("charger connected");
  run.run_to(10.0);
  const Core& core = run.core();
  REQUIRE(core.sequence().phase == Phase::closed);
  const Plant& plant = run.simulator().plant();
  double terminals_max_V = 0.0;
  double steady_until_s = 0.0;
  double highest_V = 0.0;
  std::string all_complaints;
  while (run.seconds() < 1'800.0 && (run.seconds() < 20.0 || current_A(run) < -1.5)) {
    run.run_to(run.seconds() + 0.5);
    terminals_max_V = std::max(terminals_max_V, plant.charger_V());
    highest_V = std::max(highest_V, highest_cell_V(run));
    if (std::abs(current_A(run) + 15.0) < 0.1) steady_until_s = run.seconds();
    all_complaints += test::complaints(core);
    REQUIRE(core.sequence().phase == Phase::closed);
  }
  CHECK(all_complaints.empty());
  CHECK(current_A(run) >= -1.5);
  CHECK(current_A(run) < -1.0);
  CHECK(std::abs(terminals_max_V - 25.7) < 0.02);
  CHECK(steady_until_s > 500.0);  // 15 A up to the held voltage
  CHECK(highest_V < 4.2);         // where cell_overvoltage warns
  CHECK(highest_V > 4.18);
  CHECK(*core.soc_permille() > 950);
  CHECK(core.watchers().overload.charge_used_permille() == 0);
}

TEST_CASE(
    "a charger that holds 25.7 V at its own terminals, without sense wires, is broken off before a cell is harmed",
    "[scenario][accept][slow][PB_F.3][BMS_F.1]") {
  test::SimRun run(test::patched_pack("{}", "lipo-6s-24v.json"));
  run.apply("pack soc_permille 800");
  run.apply("charger voltage_V 25.7");
  run.apply("charger lead_mOhm 37");
  run.apply("charger senses terminals");
  run.apply("charger current_A 15");
  run.apply("charger obeys nobody");
  run.run_to(3.0);
  run.apply("charger connected");
  run.run_to(10.0);
  REQUIRE(run.core().sequence().phase == Phase::closed);
  double highest_V = 0.0;
  double least_A = 15.0;
  while (run.seconds() < 600.0 && run.core().sequence().phase == Phase::closed) {
    if (run.seconds() > 12.0) least_A = std::min(least_A, -current_A(run));
    run.run_to(run.seconds() + 0.1);
    highest_V = std::max(highest_V, highest_cell_V(run));
  }
  CHECK(run.core().last_opening().fault == FaultId::cell_overvoltage);
  CHECK(least_A > 1.5);       // far from the end current
  CHECK(highest_V > 4.2295);  // its limit, which a module rounds to 0.1 mV ...
  CHECK(highest_V < 4.25);    // ... and the maker's limit
}

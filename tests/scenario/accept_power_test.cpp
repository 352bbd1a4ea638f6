// The accept tests of the 24 V competition pack that are about power, at the pack as shipped: their procedure, and the
// figures of its authors. No limit of the pack file is changed for any of them.
//
//   PB_F.2    more than half full: 25 A for a minute, then 50 A for 10 s; a cell drops by about 0.1 V with each 25 A,
//   and
//             warms up from 17 to 22 C
//   PB_F.3    from empty with 15 A to 25.7 V at the charger's terminals, until the current is below a tenth
//   PB_NF.3   full, at 8 C, 4 A until the pack opens: 0.85 h x 4 A x 22.2 V = 75.5 Wh; at least 70 Wh
#include <algorithm>
#include <cmath>
#include <string>

#include "tests/support/catch.hpp"
#include "tests/support/patched_pack.hpp"
#include "tests/support/sim_run.hpp"

using namespace bmu;

namespace {

CoreConfig shipped() {
  return test::patched_pack("{}", "lipo-6s-24v.json");
}

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

/// Faults that are present, and all warnings but those of a peak: that 50 A flow, and that most of it is used up.
std::string complaints(const Core& core) {
  std::string names;
  for (const FaultRow& row : fault_table()) {
    const FaultState& state = core.faults().state(row.id);
    const bool is_warning =
        state.is_warning && row.id != FaultId::discharge_overload && row.id != FaultId::discharge_overcurrent;
    if (state.is_present() || is_warning) names += std::string(row.name) + " ";
  }
  return names;
}

/// What a step of the load by 25 A takes from the lowest cell at once, as the modules measure it.
double drop_of_step_V(test::SimRun& run, const std::string& load) {
  const double before_V = run.core().pack().cell_voltage_uV.min / 1e6;
  run.apply("load current_A " + load);
  run.run_to(run.seconds() + 0.25);
  return before_V - run.core().pack().cell_voltage_uV.min / 1e6;
}

}  // namespace

TEST_CASE(
    "the 24 V pack carries 25 A for a minute and 50 A for 10 s, its cells drop by about 0.1 V and warm up to 22 C",
    "[scenario][PB_F.2][BMS_NF.7]") {
  test::SimRun run(shipped());
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
  CHECK(complaints(core).empty());
  CHECK(core.watchers().overload.discharge_used_permille() < 100);
  const double second_V = drop_of_step_V(run, "50");
  CHECK(second_V > 0.08);
  CHECK(second_V < 0.14);
  run.run_to(run.seconds() + 9.75);
  CHECK(core.sequence().phase == Phase::closed);
  CHECK(complaints(core).empty());
  CHECK(core.pack().cell_voltage_uV.min > core.config().limits.cell_undervoltage.warn);
  run.apply("load current_A 0");
  run.run_to(run.seconds() + 1.0);
  CHECK(core.sequence().phase == Phase::closed);
  CHECK(core.pack().cell_temperature_dC.max >= 205);
  CHECK(core.pack().cell_temperature_dC.max <= 225);
}

TEST_CASE("the 24 V pack is charged with 15 A from empty to 25.7 V at the charger's terminals, until a tenth flows",
          "[scenario][slow][PB_F.3]") {
  test::SimRun run(shipped());
  run.apply("pack soc_permille 20");
  // It holds 4.19 V a cell where its sense wires are; its leads take 0.56 V of 15 A.
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
    all_complaints += complaints(core);
    REQUIRE(core.sequence().phase == Phase::closed);
  }
  CHECK(all_complaints.empty());
  CHECK(current_A(run) >= -1.5);
  CHECK(current_A(run) < -1.0);
  CHECK(std::abs(terminals_max_V - 25.7) < 0.02);
  CHECK(steady_until_s > 500.0);  // 15 A all the way up
  CHECK(highest_V < 4.2);         // where cell_overvoltage warns
  CHECK(highest_V > 4.18);
  CHECK(*core.soc_permille() > 950);
  CHECK(core.watchers().overload.charge_used_permille() == 0);
}

TEST_CASE(
    "a charger that holds 25.7 V at its own terminals, without sense wires, is broken off before a cell is harmed",
    "[scenario][slow][PB_F.3][BMS_F.1]") {
  test::SimRun run(shipped());
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
  CHECK(least_A > 1.5);       // far from its end
  CHECK(highest_V > 4.2295);  // its limit, which a module rounds to 0.1 mV ...
  CHECK(highest_V < 4.25);    // ... and what its maker allows
}

TEST_CASE("the full 24 V pack gives 70 Wh and more at 8 C and 4 A until it opens", "[scenario][slow][PB_NF.3]") {
  test::SimRun run(shipped());
  run.apply("pack soc_permille 1000");
  run.apply("pack ambient_dC 80");
  run.apply("pack temperature_dC 80");
  run.run_to(3.0);
  run.apply("vehicle on");
  run.run_to(9.0);
  const Core& core = run.core();
  REQUIRE(core.sequence().phase == Phase::closed);
  run.apply("load current_A 4");
  const double began_s = run.seconds();
  while (run.seconds() < 4'000.0 && core.sequence().phase == Phase::closed) run.run_to(run.seconds() + 1.0);
  CHECK(core.last_opening().fault == FaultId::cell_undervoltage);
  constexpr double J_per_Wh = 3'600.0;
  const double truth_Wh = run.simulator().plant().totals().pack_J / J_per_Wh;
  INFO("given " << truth_Wh << " Wh in " << (run.seconds() - began_s) / 3'600.0 << " h");
  CHECK(truth_Wh >= 70.0);
  CHECK(truth_Wh < 80.0);
  CHECK(std::abs((run.seconds() - began_s) / 3'600.0 - 0.85) < 0.05);
  CHECK(std::abs(static_cast<double>(core.charge().energy_out_mWh) / 1e3 - truth_Wh) < 0.5);
}

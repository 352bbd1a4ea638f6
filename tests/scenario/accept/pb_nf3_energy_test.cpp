// Acceptance test of PB_NF.3 (24 V competition pack), at the pack as shipped. Procedure of the authors: the full pack
// delivers 4 A at 8 C until it opens. Their figure: 0.85 h x 4 A x 22.2 V = 75.5 Wh, and at least 70 Wh are required.
#include <cmath>

#include "daemon/core/estimation/energy_left.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/patched_pack.hpp"
#include "tests/support/sim_run.hpp"

using namespace bmu;

constexpr double J_per_Wh = 3'600.0;

TEST_CASE("the full 24 V pack gives 70 Wh and more at 8 C and 4 A until it opens",
          "[scenario][accept][slow][PB_NF.3][SOE_1]") {
  test::SimRun run(test::patched_pack("{}", "lipo-6s-24v.json"));
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
  run.run_to(began_s + 60.0);
  const EnergyLeft left = energy_left(core.estimate(), core.config());
  REQUIRE(left.is_known);
  const double given_before_Wh = run.simulator().plant().totals().pack_J / J_per_Wh;
  while (run.seconds() < 4'000.0 && core.sequence().phase == Phase::closed) run.run_to(run.seconds() + 1.0);
  CHECK(core.last_opening().fault == FaultId::cell_undervoltage);
  const double truth_Wh = run.simulator().plant().totals().pack_J / J_per_Wh;
  CHECK(std::abs(truth_Wh - given_before_Wh - left.energy_Wh) < 2.0 * left.sigma_Wh + 0.02 * left.energy_Wh);
  CHECK(left.sigma_Wh < 0.2 * left.energy_Wh);
  INFO("given " << truth_Wh << " Wh in " << (run.seconds() - began_s) / 3'600.0 << " h");
  CHECK(truth_Wh >= 70.0);
  CHECK(truth_Wh < 80.0);
  CHECK(std::abs((run.seconds() - began_s) / 3'600.0 - 0.85) < 0.05);
  CHECK(std::abs(static_cast<double>(core.charge().energy_out_mWh) / 1e3 - truth_Wh) < 0.5);
}

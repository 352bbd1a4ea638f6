// Acceptance test of MMU_AB (distributed system). Procedure of the authors: a module with unequal cells loses its
// external supply and its master. Their figure: it balances the cells above the imbalance limit for a minute, measures
// all again at rest, and so on until none is above it; then it sleeps.
#include <algorithm>

#include "mmu/scenario/simulator.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/patched_pack.hpp"
#include "tests/support/sim_run.hpp"

using namespace bmu;

namespace {

/// Spread of the cells' voltages at rest.
double spread_mV(const Plant& plant, const CoreConfig& config) {
  double least_uV = 1e9;
  double most_uV = 0.0;
  for (std::size_t cell = 0; cell < plant.cell_count(); ++cell) {
    const double one_uV = ocv_uV(config.cell, plant.cell(cell).soc * 1e3);
    least_uV = std::min(least_uV, one_uV);
    most_uV = std::max(most_uV, one_uV);
  }
  return (most_uV - least_uV) * 1e-3;
}

}  // namespace

TEST_CASE("without supply and master a module balances in rounds of a minute, measures between them, and sleeps",
          "[scenario][accept][MMU_A][MMU_AB][MMU_IMB]") {
  const CoreConfig config = test::patched_pack(R"({"balancing": {"autonomous": true}})", "lipo-6s-24v.json");
  test::SimRun run(config, *parse_scenario("0 pack soc_permille 700\n0 cell 1.2 soc_permille 710"));
  run.run_to(5.0);
  const Mmu& unit = run.simulator().mmu(0);
  REQUIRE(unit.is_autonomous_balancing_allowed());
  REQUIRE(spread_mV(run.simulator().plant(), config) > 6.5);
  run.apply("module 1 external_supply_mV 0");
  int rounds = 0;
  bool was_balancing = false;
  double began_s = 0.0;
  double ended_s = 0.0;
  while (run.seconds() < 1'000.0 && !unit.is_asleep()) {
    run.run_to(run.seconds() + 0.1);
    const bool is_balancing = unit.balancing_cells() != 0;
    if (is_balancing && !was_balancing) {
      ++rounds;
      began_s = run.seconds();
      CHECK(unit.balancing_cells() == cell_bit(1));
      if (rounds > 1) CHECK(began_s - ended_s >= 5.0);  // 51 checks at rest
    }
    if (!is_balancing && was_balancing) {
      ended_s = run.seconds();
      CHECK(ended_s - began_s < 60.2);
      if (rounds == 1) CHECK(ended_s - began_s > 59.8);  // the last one may end sooner
    }
    was_balancing = is_balancing;
  }
  CHECK(unit.is_asleep());
  CHECK(rounds >= 4);
  CHECK(rounds <= 9);
  CHECK(spread_mV(run.simulator().plant(), config) < 6.0);  // 5 mV, the noise, and the hysteresis of the bled charge
}

// SOC anchor from the voltage of a rested cell, independent of counting.
#include "daemon/core/estimation/soc/rest_anchor.hpp"

#include "tests/support/catch.hpp"
#include "tests/support/simulated_cell.hpp"

using namespace bmu;

namespace {

constexpr double warm_C = 25.0;
/// Rest voltage of the sloped cell: the middle between the branches.
double rested_V(double soc) {
  return 3.2 + 0.9 * soc;
}

}  // namespace

TEST_CASE("a rested cell on a slope tells its charge", "[unit][estimators][BMS_F.6]") {
  const CellDynamics cell = test::sloped_cell();
  for (const double soc : {0.1, 0.5, 0.9}) {
    const auto anchor = rest_anchor(cell, rested_V(soc), warm_C, 0.0, 0.0);
    REQUIRE(anchor);
    CHECK(anchor->soc == Approx(soc).margin(1e-3));
    // 2 mV measured, 8 mV of the model, 5 mV of hysteresis, on 0.9 V.
    CHECK(anchor->sigma == Approx(std::hypot(0.002, 0.008, 0.005) / 0.9).epsilon(0.01));
  }
}

TEST_CASE("what the pairs hold back is added and half doubted, the hysteresis is taken off", "[unit][estimators]") {
  const CellDynamics cell = test::sloped_cell();
  const auto after_load = rest_anchor(cell, rested_V(0.5) - 0.018, warm_C, 0.0, 0.018);
  REQUIRE(after_load);
  CHECK(after_load->soc == Approx(0.5).margin(1e-3));
  CHECK(after_load->sigma == Approx(std::hypot(std::hypot(0.002, 0.008), 0.009, 0.005) / 0.9).epsilon(0.01));
  const auto discharged = rest_anchor(cell, rested_V(0.5) - 0.01, warm_C, -1.0, 0.0);
  REQUIRE(discharged);
  CHECK(discharged->soc == Approx(0.5).margin(1e-3));
}

TEST_CASE("a flat stretch and the ends of the curve say nothing", "[unit][estimators]") {
  CHECK_FALSE(rest_anchor(test::flat_cell(), 3.29, warm_C, 0.0, 0.0));
  const CellDynamics cell = test::sloped_cell();
  for (const double soc : {-0.1, 0.0, 0.02, 0.98, 1.0, 1.2})
    CHECK_FALSE(rest_anchor(cell, rested_V(soc), warm_C, 0, 0));
}

TEST_CASE("without a voltage or a temperature there is no anchor", "[unit][estimators]") {
  const CellDynamics cell = test::sloped_cell();
  CHECK_FALSE(rest_anchor(cell, not_measured, warm_C, 0.0, 0.0));
  CHECK_FALSE(rest_anchor(cell, rested_V(0.5), not_measured, 0.0, 0.0));
  CHECK_FALSE(rest_anchor(cell, rested_V(0.5), warm_C, 0.0, not_measured));
}

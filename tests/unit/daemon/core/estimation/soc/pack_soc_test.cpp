// SOC of a pack of cells in series: empty with the first empty cell, full with the first full one.
#include "daemon/core/estimation/soc/pack_soc.hpp"

#include <array>
#include <limits>
#include <vector>

#include "tests/support/catch.hpp"

using namespace bmu;

namespace {

CellSoc cell(double soc, double capacity_As = 100.0, double sigma = 0.01) {
  return {.estimate = {.is_known = true, .soc = soc, .sigma = sigma}, .capacity_As = capacity_As};
}

PackSoc of(const std::vector<CellSoc>& cells) {
  return pack_soc({cells.data(), cells.size()});
}

}  // namespace

TEST_CASE("cells that are alike are the pack", "[unit][estimators][BMS_F.6]") {
  const PackSoc pack = of({cell(0.4), cell(0.4), cell(0.4)});
  REQUIRE(pack.is_known);
  CHECK(pack.soc == Approx(0.4));
  CHECK(pack.sigma == Approx(0.01));
  CHECK(pack.out_As == Approx(40.0));
  CHECK(pack.in_As == Approx(60.0));
  CHECK(pack.capacity_As() == Approx(100.0));
}

TEST_CASE("a pack is empty with its emptiest and full with its fullest cell", "[unit][estimators][BMS_F.6]") {
  const PackSoc empty = of({cell(0.3), cell(0.0), cell(0.2)});
  CHECK(empty.soc == 0.0);
  CHECK(empty.emptiest == 1);
  CHECK(empty.fullest == 0);
  CHECK(empty.capacity_As() == Approx(70.0));
  const PackSoc full = of({cell(0.9), cell(0.8), cell(1.0)});
  CHECK(full.soc == 1.0);
  CHECK(full.emptiest == 1);
  CHECK(full.fullest == 2);
  CHECK(full.capacity_As() == Approx(80.0));
}

TEST_CASE("between, both ends count as near as they are", "[unit][estimators][BMS_F.6]") {
  const PackSoc pack = of({cell(0.5), cell(0.7)});
  CHECK(pack.out_As == Approx(50.0));
  CHECK(pack.in_As == Approx(30.0));
  CHECK(pack.soc == Approx(0.625));
  // 0.375 of the emptiest cell's uncertainty and 0.625 of the fullest's, of a capacity of 80.
  CHECK(pack.sigma == Approx((0.375 * 1.0 + 0.625 * 1.0) / 80.0));
  const PackSoc unsure = of({cell(0.5, 100.0, 0.02), cell(0.7, 100.0, 0.04)});
  CHECK(unsure.sigma == Approx((0.375 * 2.0 + 0.625 * 4.0) / 80.0));
}

TEST_CASE("a small cell ends the pack at both sides", "[unit][estimators][BMS_F.6]") {
  const PackSoc pack = of({cell(0.5), cell(0.5, 60.0)});
  CHECK(pack.emptiest == 1);
  CHECK(pack.fullest == 1);
  CHECK(pack.capacity_As() == Approx(60.0));
  CHECK(pack.soc == Approx(0.5));
}

TEST_CASE("an empty cell beside a full one leaves nothing, and nobody is sure of it", "[unit][estimators]") {
  const PackSoc pack = of({cell(0.0), cell(1.0)});
  REQUIRE(pack.is_known);
  CHECK(pack.soc == 0.0);
  CHECK(pack.capacity_As() == 0.0);
  CHECK(pack.sigma == 1.0);
}

TEST_CASE("a doubt is never more than everything", "[unit][estimators]") {
  CHECK(of({cell(0.1, 100.0, 0.9), cell(0.9, 100.0, 0.9)}).sigma == 1.0);
}

TEST_CASE("a pack with a cell nobody knows is not known", "[unit][estimators]") {
  CHECK_FALSE(of({}).is_known);
  CHECK_FALSE(of({cell(0.5), {}}).is_known);
  CHECK_FALSE(of({cell(0.5), cell(0.5, 0.0)}).is_known);
  CHECK_FALSE(of({cell(0.5), cell(0.5, std::numeric_limits<double>::quiet_NaN())}).is_known);
}

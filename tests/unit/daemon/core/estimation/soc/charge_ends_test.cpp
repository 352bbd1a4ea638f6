// Detection of a full or empty cell from its own samples.
#include "daemon/core/estimation/soc/charge_ends.hpp"

#include <optional>
#include <utility>

#include "tests/support/catch.hpp"
#include "tests/support/plain_cell.hpp"
#include "tests/support/simulated_cell.hpp"

using namespace bmu;
using test::plain_cell;
using test::plain_ends;
using test::plain_sample;

namespace {

struct Bench {
  CellDynamics cell = plain_cell();
  ChargeEnds watch;

  std::optional<ChargeAnchor> hold(double voltage_V, double current_A, int seconds) {
    std::optional<ChargeAnchor> found;
    for (int second = 0; second < seconds; ++second) {
      const auto anchor = watch.update(cell, plain_ends, plain_sample(voltage_V, current_A));
      CHECK_FALSE((anchor && found));  // reported once
      if (anchor) found = anchor;
    }
    return found;
  }
};

}  // namespace

TEST_CASE("a cell that takes hardly any current at the voltage of a full one is full", "[unit][estimators]") {
  Bench bench;
  CHECK_FALSE(bench.hold(3.995, -0.05, 19));
  const auto anchor = bench.hold(3.995, -0.05, 1);
  REQUIRE(anchor);
  CHECK(anchor->soc == 1.0);
  // 0.3 of 50 mOhm times 50 mA, where the curve rises by 1 V.
  CHECK(anchor->sigma == Approx(std::hypot(0.01, 0.3 * 0.05 * 0.05)));
  CHECK_FALSE(bench.hold(3.995, -0.05, 100));
}

TEST_CASE("it is told again only after the cell has left its end", "[unit][estimators]") {
  Bench bench;
  REQUIRE(bench.hold(4.0, -0.01, 20));
  CHECK_FALSE(bench.hold(3.9, 0.5, 1));
  CHECK(bench.hold(4.0, -0.01, 20));
}

TEST_CASE("neither a large current nor a rest nor a lower voltage makes a full cell", "[unit][estimators]") {
  CHECK_FALSE(Bench().hold(4.0, -0.0501, 100));
  CHECK_FALSE(Bench().hold(3.9949, -0.05, 100));
  CHECK_FALSE(Bench().hold(4.0, 0.0, 100));
  CHECK_FALSE(Bench().hold(4.0, 0.01, 100));
}

TEST_CASE("a cell that has sunk to its end though it gives but little is empty", "[unit][estimators]") {
  Bench bench;
  CHECK_FALSE(bench.hold(3.005, 0.2, 19));
  const auto anchor = bench.hold(3.005, 0.2, 1);
  REQUIRE(anchor);
  CHECK(anchor->soc == 0.0);
  CHECK(anchor->sigma == Approx(std::hypot(0.02, 0.3 * 0.05 * 0.2)));
  CHECK(Bench().hold(3.0, 0.0, 20));  // even more so at rest
}

TEST_CASE("neither a large current nor charging nor a higher voltage makes an empty cell", "[unit][estimators]") {
  CHECK_FALSE(Bench().hold(3.0, 0.201, 100));
  CHECK_FALSE(Bench().hold(3.0051, 0.2, 100));
  CHECK_FALSE(Bench().hold(3.0, -0.01, 100));
}

TEST_CASE("what was not measured holds no end, and what is no time is no sample", "[unit][estimators]") {
  Bench bench;
  CHECK_FALSE(bench.hold(4.0, -0.01, 19));
  CHECK_FALSE(bench.watch.update(bench.cell, plain_ends, plain_sample(4.0, -0.01, 0.0)));
  CHECK_FALSE(bench.watch.update(bench.cell, plain_ends, plain_sample(4.0, -0.01, -5.0)));
  CHECK_FALSE(bench.watch.update(bench.cell, plain_ends, plain_sample(not_measured, -0.01)));
  CHECK_FALSE(bench.hold(4.0, -0.01, 19));
  CHECK_FALSE(bench.watch.update(bench.cell, plain_ends, plain_sample(4.0, not_measured)));
  CHECK_FALSE(bench.hold(4.0, -0.01, 19));
  CHECK(bench.hold(4.0, -0.01, 1));
}

TEST_CASE("in the cold, and without a temperature, no voltage makes an empty cell", "[unit][estimators]") {
  for (const auto& [temperature_C, is_empty] :
       {std::pair{25.0, true}, std::pair{15.0, true}, std::pair{14.9, false}, std::pair{not_measured, false}}) {
    CAPTURE(temperature_C);
    Bench bench;
    CellSample low = plain_sample(2.9, 0.1, 20.0);
    low.temperature_C = temperature_C;
    CHECK(bench.watch.update(bench.cell, plain_ends, low).has_value() == is_empty);
  }
}

TEST_CASE("the ends of a kind of cell are those of its curve at 25 C and of its capacity", "[unit][estimators]") {
  CellDynamics cell = test::sloped_cell();
  const ChargeEndConfig config = charge_ends_of(cell);
  CHECK(config.full_V == Approx(4.1 - 0.005));
  CHECK(config.empty_V == Approx(3.2 + 0.005));
  CHECK(config.full_current_A == Approx(0.5));
  CHECK(config.empty_current_A == Approx(2.0));
}

TEST_CASE("without a temperature a full cell is told all the same", "[unit][estimators]") {
  Bench bench;
  CellSample cold = plain_sample(4.0, -0.05, 20.0);
  cold.temperature_C = not_measured;
  const auto anchor = bench.watch.update(bench.cell, plain_ends, cold);
  REQUIRE(anchor);
  CHECK(anchor->sigma == Approx(std::hypot(0.01, 0.3 * 0.05 * 0.05)));
}

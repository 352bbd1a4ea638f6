// A current sensor the wrong way round, seen by voltages that answer it slowly.
#include "daemon/core/estimators/current_direction.hpp"

#include <cmath>
#include <numbers>
#include <optional>

#include "tests/support/catch.hpp"
#include "tests/support/simulated_cell.hpp"

using namespace bmu;

namespace {

constexpr double expected_Ohm = 0.005;

/// The sloped cell of 10 Ah under a load that swells and ebbs between 0 and `most_A` in `period_s`, told with `sign`;
/// after how many seconds it was contradicted, or none.
std::optional<double> contradicted_after(double sign, double most_A, double period_s, double lasts_s,
                                         double noise_V = 0.0, double lag_s = 0.0) {
  const CellDynamics cell = test::sloped_cell();
  test::SimulatedCell truth(cell, {.soc = 0.7, .voltage_noise_V = noise_V});
  CurrentDirection direction(10.0, expected_Ohm);
  constexpr double passed_s = 0.1;
  const auto load_A = [&](double at_s) {
    return 0.5 * most_A * (1.0 - std::cos(2.0 * std::numbers::pi * at_s / period_s));
  };
  for (double at_s = 0.0; at_s < lasts_s; at_s += passed_s) {
    const double voltage_V = truth.run(passed_s, load_A(at_s), 25.0).voltage_V;
    direction.update(passed_s, sign * load_A(at_s - lag_s), voltage_V);
    if (direction.is_contradicted()) return at_s;
  }
  return std::nullopt;
}

}  // namespace

TEST_CASE("a load that swells and ebbs shows a sensor the wrong way round within minutes",
          "[unit][estimators][BMS_F.6]") {
  for (const double period_s : {10.0, 60.0, 240.0}) {
    CAPTURE(period_s);
    const auto after_s = contradicted_after(-1.0, 10.0, period_s, 600.0);
    REQUIRE(after_s);
    CHECK(*after_s < 300.0);
  }
}

TEST_CASE("a sensor the right way round is never contradicted by its cell", "[unit][estimators][BMS_F.6]") {
  for (const double most_A : {2.0, 10.0, 40.0}) {
    for (const double period_s : {1.0, 10.0, 60.0, 600.0}) {
      for (const double lag_s : {0.0, 0.2}) {
        CAPTURE(most_A, period_s, lag_s);
        CHECK_FALSE(contradicted_after(1.0, most_A, period_s, 900.0, 0.002, lag_s));
      }
    }
  }
}

TEST_CASE("a current that hardly moves says nothing of its direction", "[unit][estimators]") {
  CHECK_FALSE(contradicted_after(-1.0, 0.5, 60.0, 1'800.0, 0.001));
  CurrentDirection steady(10.0, expected_Ohm);
  for (int second = 0; second < 3'600; ++second) steady.update(1.0, 10.0, 3.7 + second * 1e-5);
  CHECK_FALSE(steady.is_known());
  CHECK_FALSE(steady.is_contradicted());
}

TEST_CASE("what was not measured, a gap and time that runs back begin anew", "[unit][estimators]") {
  CurrentDirection direction(10.0, expected_Ohm);
  // Alternating: each step would be against it, but none is seen whole.
  for (int turn = 0; turn < 2'000; ++turn) {
    direction.update(1.0, turn % 2 == 0 ? 0.0 : 10.0, turn % 2 == 0 ? 3.6 : 3.7);
    if (turn % 3 == 0) direction.update(1.0, not_measured, 3.6);
    if (turn % 3 == 1) direction.update(1.0, 5.0, not_measured);
    if (turn % 3 == 2) direction.update(turn % 2 == 0 ? 0.0 : -1.0, 5.0, 3.6);
  }
  CHECK_FALSE(direction.is_known());
  for (int turn = 0; turn < 2'000; ++turn) direction.update(3.0, turn % 2 == 0 ? 0.0 : 10.0, turn % 2 == 0 ? 3.6 : 3.7);
  CHECK_FALSE(direction.is_known());
  for (int turn = 0; turn < 200; ++turn) direction.update(1.0, turn % 2 == 0 ? 0.0 : 10.0, turn % 2 == 0 ? 3.6 : 3.7);
  CHECK(direction.is_contradicted());
}

TEST_CASE("what was seen before is forgotten on request", "[unit][estimators]") {
  CurrentDirection direction(10.0, expected_Ohm);
  const auto alternate = [&direction](int turns) {
    for (int turn = 0; turn < turns; ++turn) {
      direction.update(1.0, turn % 2 == 0 ? 0.0 : 10.0, turn % 2 == 0 ? 3.6 : 3.7);
    }
  };
  alternate(200);
  REQUIRE(direction.is_contradicted());
  direction.forget();
  CHECK_FALSE(direction.is_known());
  CHECK_FALSE(direction.is_contradicted());
  alternate(200);
  CHECK(direction.is_contradicted());
}

TEST_CASE("without a cell to compare with nothing is said", "[unit][estimators]") {
  CurrentDirection none;
  for (int turn = 0; turn < 200; ++turn) none.update(1.0, turn % 2 == 0 ? 0.0 : 10.0, turn % 2 == 0 ? 3.6 : 3.7);
  CHECK_FALSE(none.is_known());
  CHECK_FALSE(none.is_contradicted());
}

// Mixed method: counting in the middle of the SOC range, voltage at its ends.
#include "daemon/core/estimation/soc/soc_mixed.hpp"

#include <cmath>
#include <limits>

#include "tests/support/catch.hpp"
#include "tests/support/simulated_cell.hpp"

using namespace bmu;

namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();
constexpr CurrentSensorError exact{.gain = 0.0, .offset_A = 0.0, .unknown_current_A = 0.0};

/// At 25 C: V = 3.2 + 0.9 z, 3 mOhm + 2 mOhm (charge transfer with 20 A) + 3 times 1 mOhm.
struct Mixed {
  CellDynamics cell = test::sloped_cell();
  SocMixed soc_mixed;

  explicit Mixed(double soc, double sigma) { soc_mixed.begin(cell, exact, {.soc = soc, .sigma = sigma}, 25.0); }
  void run(double passed_s, double current_A, double voltage_V) {
    soc_mixed.update({.passed_s = passed_s,
                      .mean_current_A = current_A,
                      .current_A = current_A,
                      .voltage_V = voltage_V,
                      .temperature_C = 25.0});
  }
  [[nodiscard]] double soc() const { return soc_mixed.estimate().soc; }
  [[nodiscard]] double sigma() const { return soc_mixed.estimate().sigma; }
};

/// Voltage drop of this current in steady state.
double taken_V(double current_A) {
  return 0.006 * current_A + 0.002 * 20.0 * std::asinh(current_A / 20.0);
}

}  // namespace

TEST_CASE("in the middle the voltage is not listened to", "[unit][estimators]") {
  Mixed mixed(0.5, 0.2);
  for (int second = 0; second < 360; ++second) mixed.run(1.0, 10.0, 3.88);  // of 84 % after compensation
  CHECK(mixed.soc() == Approx(0.4));
  CHECK(mixed.sigma() == Approx(0.2));
}

TEST_CASE("high up a rested voltage pulls the count in two minutes", "[unit][estimators]") {
  Mixed mixed(0.90, 0.1);
  mixed.run(1.0, 0.0, 3.2 + 0.9 * 0.96);
  const double told_sigma = 0.010 / 0.9;
  const double pull = 1.0 / 120.0 * (1.0 - told_sigma / 0.1);
  CHECK(mixed.soc() == Approx(0.90 + 0.06 * pull).epsilon(1e-5));
  CHECK(mixed.sigma() == Approx(0.1 - (0.1 - told_sigma) * pull).epsilon(1e-5));
  for (int second = 0; second < 3600; ++second) mixed.run(1.0, 0.0, 3.2 + 0.9 * 0.96);
  CHECK(mixed.soc() == Approx(0.96).margin(0.005));
  CHECK(mixed.sigma() >= told_sigma);
  CHECK(mixed.sigma() < 2.0 * told_sigma);
}

TEST_CASE("under a current the same voltage says less, and nothing that was not better known", "[unit][estimators]") {
  // 5 A into the cell cause 40 mV, a fifth of which is uncertain.
  Mixed mixed(0.90, 0.1);
  const double voltage_V = 3.2 + 0.9 * 0.96 - taken_V(-5.0);
  mixed.run(1.0, -5.0, voltage_V);
  const double counted = 0.90 + 5.0 / 36'000.0;
  const double told_sigma = std::hypot(0.010, 0.2 * taken_V(5.0)) / 0.9;
  const double pull = 1.0 / 120.0 * (1.0 - told_sigma / 0.1);
  CHECK(mixed.soc() == Approx(counted + (0.96 - counted) * pull).epsilon(1e-5));
  // 100 A: 20 % of 0.7 V is more than a tenth of the charge.
  Mixed blind(0.90, 0.1);
  blind.run(1.0, -100.0, 3.2 + 0.9 * 0.96 + taken_V(100.0));
  CHECK(blind.soc() == Approx(0.90 + 100.0 / 36'000.0));
  CHECK(blind.sigma() == Approx(0.1));
}

TEST_CASE("in the cold the same current takes more of the voltage", "[unit][estimators]") {
  const CellDynamics cell = test::sloped_cell();
  const double cold = std::exp(3000.0 * (1.0 / 263.15 - 1.0 / 298.15));
  const double taken = (0.006 * cold * -1.0) + 0.04 * std::asinh(-1.0 / (20.0 / cold));
  const double told = (4.0 + taken - 3.2) / 0.9;
  const double told_sigma = std::hypot(0.010, 0.2 * taken) / 0.9;
  const double counted = 0.90 + 1.0 / 36'000.0;
  const double expected = counted + (told - counted) / 120.0 * (1.0 - told_sigma / 0.1);
  // Temperature given at the start, or with the sample.
  SocMixed begun;
  begun.begin(cell, exact, {.soc = 0.90, .sigma = 0.1}, -10.0);
  begun.update({1.0, -1.0, -1.0, 4.0, not_measured});
  CHECK(begun.estimate().soc == Approx(expected).epsilon(1e-5));
  SocMixed cooled;
  cooled.begin(cell, exact, {.soc = 0.90, .sigma = 0.1}, 25.0);
  cooled.update({1.0, -1.0, -1.0, 4.0, -10.0});
  CHECK(cooled.estimate().soc == Approx(expected).epsilon(1e-5));
}

TEST_CASE("where the curve is flat at its end the voltage does not say much", "[unit][estimators]") {
  CellDynamics cell = test::sloped_cell();
  for (CellDynamics::Row& row : cell.rows) {
    for (std::size_t point = 45; point < CellDynamics::curve_points; ++point) {
      row.ocv_V[point] = row.ocv_V[44] + 0.001 * static_cast<double>(point - 44);  // 50 mV per 1
    }
  }
  SocMixed mixed;
  mixed.begin(cell, exact, {.soc = 0.90, .sigma = 0.1}, 25.0);
  mixed.update({1.0, 0.0, 0.0, cell.rows[0].ocv_V[48], 25.0});
  // 10 mV count with a slope of 0.2 V per 1.
  CHECK(mixed.estimate().soc == Approx(0.90 + 0.06 / 120.0 * (1.0 - 0.05 / 0.1)).epsilon(1e-5));
}

TEST_CASE("a voltage below that of an empty cell means empty", "[unit][estimators]") {
  Mixed mixed(0.10, 0.08);
  mixed.run(1.0, 10.0, 3.2 - taken_V(10.0) + 0.001);
  CHECK(mixed.soc() == Approx(0.10 - 10.0 / 36'000.0));
  mixed.run(4.9, 10.0, 3.2 - taken_V(10.0) - 0.001);
  CHECK(mixed.soc() > 0.09);
  mixed.run(0.2, 10.0, 3.2 - taken_V(10.0) - 0.001);
  CHECK(mixed.soc() == 0.0);
  CHECK(mixed.sigma() == Approx(0.03));
}

TEST_CASE("damaged samples of a voltage empty no cell", "[unit][estimators]") {
  Mixed mixed(0.60, 0.08);
  for (int turn = 0; turn < 20; ++turn) {
    mixed.run(1.0, 1.0, 2.0);
    mixed.run(1.0, 1.0, 3.7);
  }
  CHECK(mixed.soc() == Approx(0.60 - 40.0 / 36'000.0));
}

TEST_CASE("a low voltage while charging, or at rest, is no end", "[unit][estimators]") {
  Mixed mixed(0.10, 0.08);
  mixed.run(1.0, -10.0, 3.0);
  CHECK(mixed.soc() == Approx(0.10 + 10.0 / 36'000.0));
  mixed.run(1.0, 0.0, 3.0);
  CHECK(mixed.soc() == Approx(0.10 + 10.0 / 36'000.0));
}

TEST_CASE("a whole discharge ends at empty although it began 15 % too high", "[unit][estimators]") {
  const CellDynamics cell = test::flat_cell();
  test::SimulatedCell truth(cell, {.soc = 0.8});
  SocMixed mixed;
  mixed.begin(cell, {}, {.soc = 0.95, .sigma = 0.2}, 25.0);
  while (truth.soc() > 0.0) mixed.update(truth.run(10.0, 5.0, 25.0));
  for (int turn = 0; turn < 12; ++turn) mixed.update(truth.run(10.0, 5.0, 25.0));
  CHECK(mixed.estimate().soc == 0.0);
  CHECK(mixed.estimate().sigma < 0.05);
}

TEST_CASE("with parts of a sample it counts as far as it can", "[unit][estimators]") {
  SocMixed early;
  early.update({.passed_s = 1.0, .mean_current_A = 5.0, .current_A = 5.0, .voltage_V = 2.0, .temperature_C = 25.0});
  CHECK_FALSE(early.estimate().is_known);

  for (const double bad : {not_measured, infinite, -infinite, 1e308, -1e308}) {
    CAPTURE(bad);
    for (int which = 0; which < 5; ++which) {
      CAPTURE(which);
      Mixed mixed(0.9, 0.1);
      CellSample sample{
          .passed_s = 1.0, .mean_current_A = 1.0, .current_A = 1.0, .voltage_V = 4.0, .temperature_C = 25.0};
      if (which == 0) sample.mean_current_A = bad;
      if (which == 1) sample.current_A = bad;
      if (which == 2) sample.voltage_V = bad;
      if (which == 3) sample.temperature_C = bad;
      if (which == 4) sample = {1.0, bad, bad, bad, bad};
      for (int turn = 0; turn < 10; ++turn) mixed.soc_mixed.update(sample);
      mixed.run(1.0, 1.0, 4.0);
      CHECK((mixed.soc() > 0.85 && mixed.soc() < 0.95));
      CHECK((mixed.sigma() > 0.0 && mixed.sigma() < 0.2));
    }
  }
}

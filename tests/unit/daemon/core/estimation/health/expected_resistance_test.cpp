// Expected resistance of a cell by its model, compared with a calculation by hand.
#include "daemon/core/estimation/health/expected_resistance.hpp"

#include <cmath>

#include "daemon/core/estimation/soc/soc_estimate.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/simulated_cell.hpp"

using namespace bmu;

namespace {

double cold_by(double temperature_C) {
  return std::exp(3000.0 * (1.0 / (temperature_C + 273.15) - 1.0 / 298.15));
}

/// Resistance of the sloped cell: 3 mOhm, charge transfer of 2 mOhm with 20 A, three RC elements of 1 mOhm; all grow by
/// the same factor except the exchange current, which falls by it.
double by_hand_Ohm(double cold) {
  const double exchange_A = 20.0 / cold;
  const double kinetic_Ohm = 0.002 * cold * exchange_A * std::asinh(10.0 / exchange_A) / 10.0;
  const double pairs_Ohm = 0.001 * cold * (2.0 / 12.0 + 2.0 / 102.0 + 2.0 / 1002.0);
  return 0.003 * cold + kinetic_Ohm + pairs_Ohm;
}

}  // namespace

TEST_CASE("what a step shows after a second is the series resistance, the kinetics and a little of the pairs",
          "[unit][estimators][BMS_F.6]") {
  const ExpectedResistance expected(test::sloped_cell());
  CHECK(expected.hour_current_A() == Approx(10.0));
  CHECK(expected.at_reference_Ohm() == Approx(by_hand_Ohm(1.0)));
  CHECK(expected.at_reference_Ohm() == Approx(0.0051131).epsilon(1e-4));
  CHECK(expected.factor(25.0) == Approx(1.0));
  for (const double temperature_C : {-10.0, -50.0, 47.5, 100.0}) {
    CAPTURE(temperature_C);
    CHECK(expected.factor(temperature_C) ==
          Approx(by_hand_Ohm(cold_by(temperature_C)) / by_hand_Ohm(1.0)).epsilon(1e-6));
  }
}

TEST_CASE("between its entries the factor is true to half a percent, beyond them it stays",
          "[unit][estimators][BMS_F.6]") {
  const ExpectedResistance expected(test::sloped_cell());
  CHECK(expected.factor(26.25) == Approx(by_hand_Ohm(cold_by(26.25)) / by_hand_Ohm(1.0)).epsilon(0.005));
  CHECK(expected.factor(-48.75) == Approx(by_hand_Ohm(cold_by(-48.75)) / by_hand_Ohm(1.0)).epsilon(0.005));
  CHECK(expected.factor(-70.0) == expected.factor(-50.0));
  CHECK(expected.factor(130.0) == expected.factor(100.0));
  CHECK(std::isnan(expected.factor(not_measured)));
}

TEST_CASE("what a cell of few numbers should show is its series resistance and the beginning of its pair",
          "[unit][estimators][BMS_F.6]") {
  CellModel model;
  model.ocv.push_back({0, 3'000'000});
  model.ocv.push_back({1000, 4'000'000});
  model.capacity_uAs = 36'000'000'000;
  model.series_resistance_Ohm = 0.004;
  model.rc_resistance_Ohm = 0.003;
  model.rc_time_constant_s = 9.0;
  const ExpectedResistance expected(dynamics_of(model));
  CHECK(expected.at_reference_Ohm() == Approx(0.004 + 0.003 * 2.0 / 11.0));
  CHECK(expected.factor(-20.0) == 1.0);
  CHECK(expected.factor(not_measured) == 1.0);  // the same at every temperature
  model.resistance_activation_K = 2500.0;
  const ExpectedResistance colder(dynamics_of(model));
  CHECK(colder.factor(0.0) == Approx(resistance_factor(2500.0, 0.0)).epsilon(1e-6));
  model.resistance_activation_K = 20.0;  // half a percent is a difference
  const ExpectedResistance hardly(dynamics_of(model));
  CHECK(hardly.factor(0.0) == Approx(resistance_factor(20.0, 0.0)).epsilon(1e-6));
  CHECK(std::isnan(hardly.factor(not_measured)));
}

TEST_CASE("a cell whose resistance depends on its charge is taken half full", "[unit][estimators][BMS_F.6]") {
  CellDynamics cell = test::sloped_cell();
  for (CellDynamics::Row& row : cell.rows) {
    for (std::size_t point = 0; point < row.series_Ohm.size(); ++point) {
      row.series_Ohm[point] *= 1.5 - static_cast<double>(point) / 20.0;
    }
  }
  CHECK(ExpectedResistance(cell).at_reference_Ohm() == Approx(by_hand_Ohm(1.0)));
}

TEST_CASE("without a model, or with one that has no resistance, nothing is divided by zero",
          "[unit][estimators][BMS_F.6]") {
  CHECK(ExpectedResistance().factor(-20.0) == 1.0);
  CHECK(ExpectedResistance().at_reference_Ohm() > 0.0);
  CellDynamics cell = test::sloped_cell();
  for (CellDynamics::Row& row : cell.rows) {
    row.series_Ohm.fill(0.0);
    row.kinetic_Ohm.fill(0.0);
    for (auto& pair_Ohm : row.pair_Ohm) pair_Ohm.fill(0.0);
  }
  CHECK(ExpectedResistance(cell).at_reference_Ohm() > 0.0);
  CHECK(ExpectedResistance(cell).factor(0.0) == 1.0);
}

// Current prediction for all cells: which cell determines which of the four limits, the hold voltages, and cells with a
// measurement only.
#include "daemon/core/limits/pack_forecast.hpp"

#include <cmath>

#include "tests/support/catch.hpp"
#include "tests/support/simulated_cell.hpp"

using namespace bmu;

namespace {

constexpr Element first{.module_node = 1, .number = 1, .pack_number = 1};
constexpr Element second{.module_node = 1, .number = 2, .pack_number = 2};

CoreConfig config() {
  CoreConfig made;
  made.limits.cell_undervoltage = {.warn = 3'200'000, .open = 3'000'000};
  made.limits.cell_overvoltage = {.warn = 4'000'000, .limit = 4'100'000, .open = 4'200'000};
  made.current = {.discharge_continuous_mA = 80'000,
                  .discharge_peak_mA = 120'000,
                  .charge_continuous_mA = 20'000,
                  .charge_peak_mA = 30'000};
  return made;
}

CellForecastInput at_rest(double voltage_V, double soc) {
  return {.voltage_V = voltage_V,
          .current_A = 0.0,
          .temperature_C = 25.0,
          .soc = {.is_known = true, .soc = soc, .sigma = 0.01},
          .hysteresis = 0.0,
          .pair_V = {0.0, 0.0, 0.0},
          .resistance_share = 0.0,
          .resistance_sigma = 0.05};
}

}  // namespace

TEST_CASE("before any cell nothing is known, and nothing is missing", "[unit][limits][prediction]") {
  const CellDynamics cell = test::sloped_cell();
  const PredictedLimits limits = PackForecast(cell, config()).limits();
  CHECK(limits.is_complete);
  for (const PredictedLimit& limit :
       {limits.discharge, limits.charge, limits.discharge_continuous, limits.charge_continuous}) {
    CHECK_FALSE(limit.is_known);
  }
  const PredictedLimits unmade;
  CHECK(unmade.is_complete);
  CHECK_FALSE(unmade.discharge.is_known);
  CHECK(unmade.discharge.limit_mA == 0);
}

TEST_CASE("far from its bounds a cell bears what the pack carries", "[unit][limits][prediction]") {
  const CellDynamics cell = test::sloped_cell();
  PackForecast forecast(cell, config());
  forecast.add(at_rest(3.65, 0.5), first);
  const PredictedLimits& limits = forecast.limits();
  CHECK(limits.is_complete);
  CHECK(limits.charge.is_known);
  CHECK(limits.charge.limit_mA == 30'000);
  CHECK(limits.charge_continuous.limit_mA == 20'000);
  CHECK(limits.discharge.holds_uV == 3'050'000);
  CHECK(limits.charge.holds_uV == 4'175'000);  // from the middle tier on
  CHECK(limits.discharge_continuous.holds_uV == 3'050'000);
  CHECK(limits.charge_continuous.holds_uV == 4'175'000);
  CHECK(limits.charge.voltage_uV == 3'650'000);
  CHECK(limits.charge.element == first);
}

TEST_CASE("of all cells the one that bears least binds, in each direction another", "[unit][limits][prediction]") {
  const CellDynamics cell = test::sloped_cell();
  PackForecast forecast(cell, config());
  forecast.add(at_rest(4.15, 0.95), first);
  forecast.add(at_rest(3.25, 0.05), second);
  const PredictedLimits& limits = forecast.limits();
  CHECK(limits.discharge.element == second);
  CHECK(limits.discharge.voltage_uV == 3'250'000);
  CHECK(limits.discharge.limit_mA > 10'000);
  CHECK(limits.discharge.limit_mA < 50'000);
  CHECK(limits.discharge_continuous.element == second);
  CHECK(limits.discharge_continuous.limit_mA < limits.discharge.limit_mA);
  CHECK(limits.charge.element == first);
  CHECK(limits.charge.voltage_uV == 4'150'000);
  CHECK(limits.charge.limit_mA > 1'000);
  CHECK(limits.charge.limit_mA < 8'000);
  CHECK(limits.charge_continuous.limit_mA < limits.charge.limit_mA);
  PackForecast alone(cell, config());
  alone.add(at_rest(3.25, 0.05), second);
  CHECK(alone.limits().discharge.limit_mA == Approx(limits.discharge.limit_mA).margin(12));
}

TEST_CASE("held is a quarter of the way before the threshold, and there nothing is left",
          "[unit][limits][prediction]") {
  const CellDynamics cell = test::sloped_cell();
  PackForecast forecast(cell, config());
  forecast.add(at_rest(4.1751, 0.99), first);
  CHECK(forecast.limits().charge.limit_mA == 0);
  CHECK(forecast.limits().charge_continuous.limit_mA == 0);
  PackForecast before(cell, config());
  before.add(at_rest(4.1700, 0.99), first);
  CHECK(before.limits().charge.limit_mA > 500);
  PackForecast empty(cell, config());
  empty.add(at_rest(3.0499, 0.01), first);
  CHECK(empty.limits().discharge.limit_mA == 0);
  CHECK(empty.limits().charge.limit_mA == 30'000);
}

TEST_CASE("a cell of which nothing can be said makes the forecast incomplete, and the others still count",
          "[unit][limits][prediction]") {
  const CellDynamics cell = test::sloped_cell();
  PackForecast forecast(cell, config());
  forecast.add(at_rest(3.25, 0.05), first);
  const std::int32_t limit_mA = forecast.limits().discharge.limit_mA;
  CHECK(forecast.limits().is_complete);
  forecast.add({}, second);
  CHECK_FALSE(forecast.limits().is_complete);
  CHECK(forecast.limits().discharge.limit_mA == limit_mA);
  CHECK(forecast.limits().discharge.element == first);
}

TEST_CASE("parts and the user bound what is asked", "[unit][limits][prediction][parts]") {
  const CellDynamics cell = test::sloped_cell();
  CoreConfig bounded = config();
  bounded.user_limits = {.discharge_continuous_mA = 9'000, .discharge_peak_mA = 11'000};
  PackForecast forecast(cell, bounded);
  forecast.add(at_rest(3.65, 0.5), first);
  CHECK(forecast.limits().discharge.limit_mA == 11'000);
  CHECK(forecast.limits().discharge_continuous.limit_mA == 9'000);
  CHECK(forecast.limits().charge.limit_mA == 30'000);
}

TEST_CASE("of a cell that nobody estimates the voltage says in which range its charge is",
          "[unit][limits][prediction]") {
  const CellDynamics cell = test::sloped_cell();  // 0.9 V from empty to full, 10 mV hysteresis, 8 mV model error
  const CellForecastInput rested = measured_only(cell, 3.65, 0.0, 25.0);
  CHECK(rested.voltage_V == 3.65);
  CHECK(rested.current_A == 0.0);
  CHECK(rested.temperature_C == 25.0);
  REQUIRE(rested.soc.is_known);
  CHECK(rested.soc.soc == Approx(0.5).margin(0.001));
  CHECK(2.0 * rested.soc.sigma == Approx((0.010 + 2.0 * 0.008) / 0.9).margin(0.001));
  CHECK_FALSE(is_measured(rested.hysteresis));
  CHECK_FALSE(is_measured(rested.pair_V[0]));
  CHECK_FALSE(is_measured(rested.resistance_share));
  // Under load the RC elements may have settled, 3 mV per ampere, or not.
  const CellForecastInput loaded = measured_only(cell, 3.50, 20.0, 25.0);
  const double at_once_V = 0.060 + 0.002 * 20.0 * std::asinh(1.0);
  const double low = (3.50 + at_once_V - 0.026 - 3.2) / 0.9;
  const double high = (3.50 + at_once_V + 0.060 + 0.026 - 3.2) / 0.9;
  CHECK(loaded.soc.soc == Approx((low + high) / 2.0).margin(0.001));
  CHECK(2.0 * loaded.soc.sigma == Approx((high - low) / 2.0).margin(0.001));
  const CellForecastInput charged = measured_only(cell, 3.80, -20.0, 25.0);
  CHECK(charged.soc.soc == Approx(1.0 - loaded.soc.soc).margin(0.001));
  CHECK(charged.soc.sigma == Approx(loaded.soc.sigma).margin(0.001));
  for (const CellForecastInput& unknown :
       {measured_only(cell, not_measured, 0.0, 25.0), measured_only(cell, 3.65, not_measured, 25.0),
        measured_only(cell, 3.65, 0.0, not_measured), measured_only(CellDynamics{}, 3.65, 0.0, 25.0)}) {
    CHECK_FALSE(unknown.soc.is_known);
  }
}

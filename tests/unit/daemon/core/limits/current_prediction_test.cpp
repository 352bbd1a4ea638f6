// Largest current that the voltage of a cell permits: compared with the equation by hand and with simulated cells, and
// the treatment of unknown values.
#include "daemon/core/limits/current_prediction.hpp"

#include <cmath>
#include <limits>

#include "tests/support/catch.hpp"
#include "tests/support/simulated_cell.hpp"

using namespace bmu;
using bmu::test::SimulatedCell;

namespace {

constexpr double no_number = std::numeric_limits<double>::quiet_NaN();

/// 10 Ah, 3.2 V to 4.1 V linearly; 3 milliohm at once, 1 each in RC elements of 10, 100 and 1000 s; negligible charge
/// transfer and no hysteresis unless a test sets them.
CellDynamics plain_cell() {
  CellDynamics cell = test::sloped_cell();
  for (CellDynamics::Row& row : cell.rows) {
    row.kinetic_Ohm.fill(0.0);
    row.hysteresis_V.fill(0.0);
  }
  return cell;
}

/// Everything is known, and the cell rests at 3.65 V.
CellForecastInput half_full() {
  return {.voltage_V = 3.65,
          .current_A = 0.0,
          .temperature_C = 25.0,
          .soc = {.is_known = true, .soc = 0.5, .sigma = 0.0},
          .hysteresis = 0.0,
          .pair_V = {0.0, 0.0, 0.0},
          .resistance_share = 0.0,
          .resistance_sigma = 0.0};
}

struct OwnRow {
  CellDynamics::Row row;
};
/// Prediction with its own row.
struct AloneForecast : private OwnRow, public CellForecast {
  AloneForecast(const CellDynamics& cell, const CellForecastInput& input)
      : OwnRow{forecast_row(cell, input)}, CellForecast(cell, row, input) {}
};

double settled(double horizon_s, double time_constant_s) {
  return 1.0 - std::exp(-horizon_s / time_constant_s);
}

/// Voltage drop of the plain cell within the horizon, per ampere from rest.
double volts_per_ampere(double horizon_s) {
  return 0.9 * horizon_s / 36'000.0 + 0.003 +
         0.001 * (settled(horizon_s, 10.0) + settled(horizon_s, 100.0) + settled(horizon_s, 1000.0));
}

constexpr double plenty_A = 1'000.0;

}  // namespace

TEST_CASE("from rest the current is the room divided by what an ampere takes", "[unit][limits][prediction]") {
  const CellDynamics cell = plain_cell();
  const AloneForecast forecast(cell, half_full());
  REQUIRE(forecast.is_known());
  for (const double horizon_s : {1.0, 10.0, 60.0}) {
    CAPTURE(horizon_s);
    const double expected_A = 0.25 / volts_per_ampere(horizon_s);
    const double out_A = forecast.discharge_A({.voltage_V = 3.4, .horizon = {cell, horizon_s}, .at_most_A = plenty_A});
    const double in_A = forecast.charge_A({.voltage_V = 3.9, .horizon = {cell, horizon_s}, .at_most_A = plenty_A});
    CHECK(out_A <= expected_A + 1e-9);
    CHECK(out_A > expected_A - 0.11);
    CHECK(in_A <= expected_A + 1e-9);
    CHECK(in_A > expected_A - 0.11);
  }
}

TEST_CASE("the answer is never more than was asked for", "[unit][limits][prediction]") {
  const CellDynamics cell = plain_cell();
  const AloneForecast forecast(cell, half_full());
  const double exactly_A = 0.25 / volts_per_ampere(10.0);
  const auto out_A = [&](double at_most_A) {
    return forecast.discharge_A({.voltage_V = 3.4, .horizon = {cell, 10.0}, .at_most_A = at_most_A});
  };
  CHECK(out_A(7.0) == 7.0);
  CHECK(out_A(exactly_A - 1e-6) == exactly_A - 1e-6);
  CHECK(out_A(exactly_A + 1e-3) < exactly_A + 1e-3);
  CHECK(out_A(exactly_A + 1e-3) > exactly_A - 0.02);
  CHECK(out_A(0.0) == 0.0);
  CHECK(out_A(-1.0) == 0.0);
  CHECK(out_A(no_number) == 0.0);
}

TEST_CASE("a current that flows already is part of the voltage", "[unit][limits][prediction]") {
  const CellDynamics cell = plain_cell();
  CellForecastInput input = half_full();
  input.current_A = 20.0;
  input.voltage_V = 3.65 - 20.0 * 0.006;
  input.pair_V = {0.02, 0.02, 0.02};
  const AloneForecast loaded(cell, input);
  // All RC elements have settled: they add voltage only for the current above 20 A.
  const double more_A = loaded.discharge_A({.voltage_V = 3.4, .horizon = {cell, 10.0}, .at_most_A = plenty_A});
  const double room_V = 3.65 - 0.12 - 3.4;
  const double expected_A = (room_V + 20.0 * (volts_per_ampere(10.0) - 0.9 * 10.0 / 36'000.0)) / volts_per_ampere(10.0);
  CHECK(more_A <= expected_A + 1e-9);
  CHECK(more_A > expected_A - 0.11);
  // Charging starts with the ohmic step back; the RC elements help later, which is not relied on.
  const double in_A = loaded.charge_A({.voltage_V = 3.7, .horizon = {cell, 10.0}, .at_most_A = plenty_A});
  const double held_V = 0.02 * (settled(10.0, 10.0) + settled(10.0, 100.0) + settled(10.0, 1000.0));
  const double in_expected_A = (3.7 - 3.53 - 20.0 * 0.003 - held_V) / volts_per_ampere(10.0);
  CHECK(in_A <= in_expected_A + 1e-9);
  CHECK(in_A > in_expected_A - 0.11);
}

TEST_CASE("the pairs' recovery is not counted on", "[unit][limits][prediction]") {
  const CellDynamics cell = plain_cell();
  CellForecastInput input = half_full();
  input.pair_V = {0.05, 0.05, 0.05};  // a load has just ended: the voltage is recovering
  const ForecastBound bound{.voltage_V = 3.55, .horizon = {cell, 10.0}, .at_most_A = plenty_A};
  const double out_A = AloneForecast(cell, input).discharge_A(bound);
  // Below 50 A each RC element would fall: only the ohmic step and the charge count.
  const double expected_A = 0.1 / (0.003 + 0.9 * 10.0 / 36'000.0);
  CHECK(out_A <= expected_A + 1e-9);
  CHECK(out_A > expected_A - 0.11);
}

TEST_CASE("beyond its bound without a current there is none, at it neither", "[unit][limits][prediction]") {
  const CellDynamics cell = plain_cell();
  const AloneForecast forecast(cell, half_full());
  const auto out_A = [&](double bound_V) {
    return forecast.discharge_A({.voltage_V = bound_V, .horizon = {cell, 10.0}, .at_most_A = plenty_A});
  };
  const auto in_A = [&](double bound_V) {
    return forecast.charge_A({.voltage_V = bound_V, .horizon = {cell, 10.0}, .at_most_A = plenty_A});
  };
  CHECK(out_A(3.66) == 0.0);
  CHECK(out_A(3.65) < 1e-3);
  CHECK(out_A(3.64) > 1.0);
  CHECK(in_A(3.64) == 0.0);
  CHECK(in_A(3.65) < 1e-3);
  CHECK(in_A(3.66) > 1.0);
}

TEST_CASE("beyond its bound only because of the current, less of it is left", "[unit][limits][prediction]") {
  const CellDynamics cell = plain_cell();
  CellForecastInput input = half_full();
  input.current_A = -20.0;
  input.voltage_V = 3.71;  // 60 mV from the current, of which 10 are too much
  const double in_A =
      AloneForecast(cell, input).charge_A({.voltage_V = 3.70, .horizon = {cell, 10.0}, .at_most_A = 100.0});
  CHECK(in_A > 10.0);
  CHECK(in_A < 20.0 - 0.01 / 0.003);
}

TEST_CASE("what is not known makes no current, and says so", "[unit][limits][prediction]") {
  const CellDynamics cell = plain_cell();
  const ForecastBound wide{.voltage_V = 1.0, .horizon = {cell, 10.0}, .at_most_A = 10.0};
  for (double CellForecastInput::*const member :
       {&CellForecastInput::voltage_V, &CellForecastInput::current_A, &CellForecastInput::temperature_C}) {
    for (const double absurd : {no_number, not_measured, 1e6, -1e6, std::numeric_limits<double>::infinity()}) {
      CellForecastInput input = half_full();
      input.*member = absurd;
      const AloneForecast forecast(cell, input);
      CHECK_FALSE(forecast.is_known());
      CHECK(forecast.discharge_A(wide) == 0.0);
    }
  }
  const AloneForecast forecast(cell, half_full());
  CHECK(forecast.discharge_A(wide) == 10.0);
  CHECK(forecast.discharge_A({.voltage_V = no_number, .horizon = {cell, 10.0}, .at_most_A = 10.0}) == 0.0);
  CHECK(forecast.discharge_A({.voltage_V = 1.0, .horizon = {cell, no_number}, .at_most_A = 10.0}) == 0.0);
  CHECK(forecast.discharge_A({.voltage_V = 1.0, .horizon = {cell, 0.0}, .at_most_A = 10.0}) == 0.0);
  CHECK(forecast.discharge_A({.voltage_V = 1.0, .horizon = {cell, -1.0}, .at_most_A = 10.0}) == 0.0);
  CellDynamics none = cell;
  none.capacity_As = 0.0;
  CHECK_FALSE(AloneForecast(none, half_full()).is_known());
  none = cell;
  none.hysteresis_charge = 0.0;
  CHECK_FALSE(AloneForecast(none, half_full()).is_known());
  CHECK_FALSE(AloneForecast(CellDynamics{}, half_full()).is_known());
}

TEST_CASE("less is known, less is allowed", "[unit][limits][prediction]") {
  CellDynamics cell = test::sloped_cell();
  for (CellDynamics::Row& row : cell.rows) {
    for (std::size_t point = 0; point < 10; ++point) row.ocv_V[point] -= 0.05 * static_cast<double>(10 - point);
  }
  const ForecastBound bound{.voltage_V = 3.3, .horizon = {cell, 60.0}, .at_most_A = plenty_A};
  const double all_A = AloneForecast(cell, half_full()).discharge_A(bound);
  const auto out_A = [&](auto change) {
    CellForecastInput input = half_full();
    input.hysteresis = -1.0;
    change(input);
    return AloneForecast(cell, input).discharge_A(bound);
  };
  const double sure_A = out_A([](CellForecastInput&) {});
  CHECK(sure_A >= all_A);
  CHECK(out_A([](CellForecastInput& it) { it.hysteresis = not_measured; }) < sure_A);
  CHECK(out_A([](CellForecastInput& it) { it.hysteresis = 1.0; }) ==
        out_A([](CellForecastInput& it) { it.hysteresis = not_measured; }));
  CHECK(out_A([](CellForecastInput& it) { it.soc.sigma = 0.22; }) < sure_A);
  CHECK(out_A([](CellForecastInput& it) { it.soc.is_known = false; }) <
        out_A([](CellForecastInput& it) { it.soc.sigma = 0.1; }));
  CHECK(out_A([](CellForecastInput& it) { it.soc.soc = no_number; }) ==
        out_A([](CellForecastInput& it) { it.soc.is_known = false; }));
  CHECK(out_A([](CellForecastInput& it) { it.soc.sigma = no_number; }) ==
        out_A([](CellForecastInput& it) { it.soc.is_known = false; }));
  CHECK(out_A([](CellForecastInput& it) { it.soc.sigma = -0.1; }) ==
        out_A([](CellForecastInput& it) { it.soc.is_known = false; }));
  CHECK(out_A([](CellForecastInput& it) { it.resistance_sigma = 0.1; }) < sure_A);
  CHECK(out_A([](CellForecastInput& it) { it.resistance_sigma = no_number; }) ==
        out_A([](CellForecastInput& it) { it.resistance_sigma = 0.25; }));
  CHECK(out_A([](CellForecastInput& it) { it.resistance_share = no_number; }) ==
        out_A([](CellForecastInput& it) { it.resistance_sigma = 0.25; }));
  CHECK(out_A([](CellForecastInput& it) { it.resistance_share = 0.5; }) < sure_A);
  CHECK(out_A([](CellForecastInput& it) { it.resistance_share = 1e3; }) ==
        out_A([](CellForecastInput& it) { it.resistance_share = 9.0; }));
}

TEST_CASE("a resistance that is not sure gives back less than it takes", "[unit][limits][prediction]") {
  const CellDynamics cell = plain_cell();
  CellForecastInput input = half_full();
  input.resistance_sigma = 0.1;
  const ForecastBound bound{.voltage_V = 3.6, .horizon = {cell, 1e-6}, .at_most_A = plenty_A};
  // From rest: 3 milliohm and 20 % more.
  CHECK(AloneForecast(cell, input).discharge_A(bound) == Approx(0.05 / 0.0036).margin(0.11));
  // From 30 A, 60 mV below the bound: 3 milliohm and 20 % less must bring that back.
  input.current_A = 30.0;
  input.voltage_V = 3.54;
  CHECK(AloneForecast(cell, input).discharge_A(bound) == Approx(30.0 - 0.06 / 0.0024).margin(0.11));
}

TEST_CASE("pairs that nobody knows are as bad as the current says", "[unit][limits][prediction]") {
  const CellDynamics cell = plain_cell();
  const ForecastBound bound{.voltage_V = 3.4, .horizon = {cell, 10.0}, .at_most_A = plenty_A};
  CellForecastInput input = half_full();
  const auto out_A = [&](double current_A, double pair_V) {
    input.current_A = current_A;
    input.pair_V.fill(pair_V);
    return AloneForecast(cell, input).discharge_A(bound);
  };
  CHECK(out_A(10.0, not_measured) == out_A(10.0, 0.0));
  CHECK(out_A(-10.0, not_measured) == Approx(out_A(-10.0, -0.01)));
  CHECK(out_A(-10.0, not_measured) < out_A(-10.0, 0.0) - 0.5);
}

TEST_CASE("in the cold the charge transfer takes less of a large current than of a small one",
          "[unit][limits][prediction]") {
  CellDynamics cell = plain_cell();
  for (CellDynamics::Row& row : cell.rows) row.kinetic_Ohm.fill(0.003);
  CellDynamics linear = plain_cell();
  for (CellDynamics::Row& row : linear.rows) row.series_Ohm.fill(row.series_Ohm[0] + 0.003);
  const ForecastBound bound{.voltage_V = 3.0, .horizon = {cell, 1e-6}, .at_most_A = plenty_A};
  const double out_A = AloneForecast(cell, half_full()).discharge_A(bound);
  CHECK(out_A > AloneForecast(linear, half_full()).discharge_A(bound));
  // The equation itself, with I0 of 20 A.
  CHECK(0.003 * out_A + 0.003 * 20.0 * std::asinh(out_A / 20.0) == Approx(0.65).margin(0.001));
}

TEST_CASE("what was promised is kept by cells that live by the model, and by those that do not quite",
          "[unit][limits][prediction]") {
  const std::uint64_t seed = 20'26'11;
  CAPTURE(seed);
  test::Chance chance(seed);
  int nearly_used = 0;
  for (std::uint64_t round = 0; round < 200; ++round) {
    const CellDynamics cell = chance.one_in(2.0) ? test::sloped_cell() : test::flat_cell();
    const double temperature_C = chance.between(-10.0, 40.0);
    const double soc = chance.between(0.05, 0.95);
    const double error = chance.between(-0.02, 0.02);
    SimulatedCell truth(cell, {.soc = soc, .resistance_share = chance.between(-0.1, 0.1), .seed = seed + round});
    const double before_A = chance.between(-20.0, 20.0);
    CellSample sample = truth.run(chance.between(0.1, 30.0), before_A, temperature_C);
    const CellForecastInput input{.voltage_V = sample.voltage_V,
                                  .current_A = sample.current_A,
                                  .temperature_C = temperature_C,
                                  .soc = {.is_known = true, .soc = truth.soc() + error, .sigma = 0.01},
                                  .hysteresis = truth.hysteresis(),
                                  .resistance_share = 0.0,
                                  .resistance_sigma = 0.05};
    const AloneForecast forecast(cell, input);
    const bool is_charge = chance.one_in(2.0);
    const double way_V = chance.between(0.02, 0.3);
    const double sign = is_charge ? -1.0 : 1.0;
    const ForecastBound bound{
        .voltage_V = sample.voltage_V - sign * way_V, .horizon = {cell, 10.0}, .at_most_A = 200.0};
    const double most_A = is_charge ? forecast.charge_A(bound) : forecast.discharge_A(bound);
    CAPTURE(round, soc, temperature_C, before_A, is_charge, way_V, most_A);
    double worst_V = sample.voltage_V;
    for (int step = 0; step < 100; ++step) {
      const double voltage_V = truth.run(0.1, sign * most_A, temperature_C).voltage_V;
      worst_V = is_charge ? std::max(worst_V, voltage_V) : std::min(worst_V, voltage_V);
    }
    if (most_A > 0.0)
      CHECK(sign * (worst_V - bound.voltage_V) >= -0.002);  // without a current the voltage may already be beyond
    if (std::abs(worst_V - bound.voltage_V) < 0.5 * way_V) ++nearly_used;
  }
  CHECK(nearly_used > 100);  // limits of zero would prove nothing
}

// Cause that determines a limit: derating tables, components, the user, predicted voltages, and the limp-home floor;
// for the peak and the continuous limits.
#include <array>
#include <initializer_list>

#include "daemon/core/limits/limits.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

using namespace bmu;

namespace {

constexpr Element hottest{.module_node = 1, .number = 2, .pack_number = 2, .is_temperature_sensor = true};
constexpr Element coldest{.module_node = 2, .number = 1, .pack_number = 3, .is_temperature_sensor = true};
constexpr Element weakest{.module_node = 2, .number = 4, .pack_number = 8};

DeratingTable table(std::initializer_list<DeratingPoint> points) {
  DeratingTable made;
  for (const DeratingPoint& point : points) made.points.push_back(point);
  return made;
}

PartConfig part(const CurrentBounds& most) {
  PartConfig made{.most = most};
  made.name.fill(' ');
  return made;
}

/// 80 A continuous and 120 A peak discharge, 20 A and 30 A charge.
struct Bench {
  Bench() {
    config.current.discharge_peak_mA = 120'000;
    config.current.charge_peak_mA = 30'000;
  }
  CoreConfig config = test::small_pack();
  PackState pack{
      .cell_voltage_uV = {.min = 3'700'000, .max = 3'700'000, .count = 8, .expected = 8},
      .cell_temperature_dC = {.min = 250, .max = 250, .min_at = coldest, .max_at = hottest, .count = 4, .expected = 4}};
  LimitInputs inputs{.is_connected = true, .may_discharge = true, .may_charge = true};

  [[nodiscard]] CurrentLimits limits() const { return evaluate_limits(pack, config, inputs); }
};

void is(const CurrentLimit& limit, std::int32_t limit_mA, LimitCause cause) {
  CHECK(limit.limit_mA == limit_mA);
  CHECK(to_text(limit.cause) == to_text(cause));
}

}  // namespace

TEST_CASE("what may flow for long is the continuous current, and no more than what may flow now", "[unit][limits]") {
  Bench bench;
  is(bench.limits().discharge, 120'000, LimitCause::peak);
  is(bench.limits().discharge_continuous, 80'000, LimitCause::continuous);
  is(bench.limits().charge, 30'000, LimitCause::peak);
  is(bench.limits().charge_continuous, 20'000, LimitCause::continuous);
  bench.pack.cell_temperature_dC.max = 550;  // half way to the opening threshold: half of each
  is(bench.limits().discharge, 60'000, LimitCause::cell_hot);
  is(bench.limits().discharge_continuous, 40'000, LimitCause::cell_hot);
  CHECK(bench.limits().discharge_continuous.unhindered_mA == 80'000);
  bench.pack.cell_temperature_dC.max = 250;
  bench.inputs.discharge_used_permille = 1'000;
  is(bench.limits().discharge_continuous, 80'000, LimitCause::continuous);
  bench.inputs.predicted.discharge = {.is_known = true, .limit_mA = 7'000};
  is(bench.limits().discharge_continuous, 7'000, LimitCause::voltage_would_fall);
  bench.inputs.predicted.charge = {.is_known = true, .limit_mA = 6'000};
  is(bench.limits().charge_continuous, 6'000, LimitCause::voltage_would_rise);
}

TEST_CASE("a fault and an open pack leave nothing for long either", "[unit][limits]") {
  Bench bench;
  bench.inputs.may_discharge = false;
  is(bench.limits().discharge_continuous, 0, LimitCause::fault);
  is(bench.limits().charge_continuous, 20'000, LimitCause::continuous);
  bench.inputs = {.is_connected = true, .may_discharge = true};
  is(bench.limits().charge_continuous, 0, LimitCause::fault);
  bench.inputs = {};
  is(bench.limits().discharge_continuous, 0, LimitCause::not_connected);
  is(bench.limits().charge_continuous, 0, LimitCause::not_connected);
}

TEST_CASE("the coldest and the hottest cell have the share that their table says",
          "[unit][limits][derating][BMU_15][BMU_6]") {
  Bench bench;
  bench.config.derating.charge_over_temperature = table({{0, 0}, {200, 1'000}, {400, 1'000}, {500, 500}});
  bench.config.derating.discharge_over_temperature = table({{-100, 500}, {100, 1'000}, {450, 1'000}, {500, 0}});
  is(bench.limits().charge, 30'000, LimitCause::peak);
  bench.pack.cell_temperature_dC.min = 50;
  is(bench.limits().charge, 7'500, LimitCause::cold);
  is(bench.limits().charge_continuous, 5'000, LimitCause::cold);
  CHECK(bench.limits().charge.value == 50);
  CHECK(bench.limits().charge.derates_from == 250);
  CHECK(bench.limits().charge.element == coldest);
  CHECK(bench.limits().charge.unhindered_mA == 30'000);
  is(bench.limits().discharge, 105'000, LimitCause::cold);
  bench.pack.cell_temperature_dC.min = 0;
  is(bench.limits().charge, 0, LimitCause::cold);
  bench.pack.cell_temperature_dC.min = 250;
  bench.pack.cell_temperature_dC.max = 460;
  is(bench.limits().charge, 21'000, LimitCause::hot);
  CHECK(bench.limits().charge.element == hottest);
  is(bench.limits().discharge, 96'000, LimitCause::hot);
  bench.pack.cell_temperature_dC = {.expected = 4};  // unknown: the previous limit applies
  bench.inputs.before.charge = {.limit_mA = 3'000, .cause = LimitCause::hot};
  is(bench.limits().charge, 3'000, LimitCause::hot);
}

TEST_CASE("the emptiest and the fullest cell have the share that their table says", "[unit][limits][derating]") {
  Bench bench;
  is(bench.limits().discharge, 120'000, LimitCause::peak);  // no table requires the SOC
  bench.config.derating.charge_over_soc = table({{0, 1'000}, {800, 1'000}, {1'000, 200}});
  bench.config.derating.discharge_over_soc = table({{0, 100}, {100, 1'000}, {1'000, 1'000}});
  is(bench.limits().discharge, 12'000, LimitCause::charge_not_known);
  CHECK(bench.limits().discharge.value == 0);
  is(bench.limits().charge, 6'000, LimitCause::charge_not_known);
  bench.inputs.soc_min_permille = 50;
  bench.inputs.soc_max_permille = 900;
  is(bench.limits().discharge, 66'000, LimitCause::empty);
  CHECK(bench.limits().discharge.value == 50);
  CHECK(bench.limits().discharge.derates_from == 550);
  is(bench.limits().charge, 18'000, LimitCause::full);
  CHECK(bench.limits().charge.value == 900);
  bench.inputs.soc_min_permille = 100;
  bench.inputs.soc_max_permille = 800;
  is(bench.limits().discharge, 120'000, LimitCause::peak);
  is(bench.limits().charge, 30'000, LimitCause::peak);
}

TEST_CASE("a voltage that would pass its bound binds, with the cell and where it is held",
          "[unit][limits][prediction]") {
  Bench bench;
  bench.inputs.predicted = {
      .discharge =
          {.is_known = true, .limit_mA = 50'000, .voltage_uV = 3'100'000, .holds_uV = 2'950'000, .element = weakest},
      .charge =
          {.is_known = true, .limit_mA = 9'000, .voltage_uV = 4'100'000, .holds_uV = 4'187'500, .element = weakest},
      .discharge_continuous = {.is_known = true, .limit_mA = 40'000, .voltage_uV = 3'100'000, .holds_uV = 2'950'000},
      .charge_continuous = {.is_known = true, .limit_mA = 4'000, .voltage_uV = 4'100'000, .holds_uV = 4'187'500}};
  const CurrentLimits limits = bench.limits();
  is(limits.discharge, 50'000, LimitCause::voltage_would_fall);
  CHECK(limits.discharge.value == 3'100'000);
  CHECK(limits.discharge.threshold == 2'950'000);
  CHECK(limits.discharge.element == weakest);
  CHECK(limits.discharge.unhindered_mA == 120'000);
  is(limits.charge, 9'000, LimitCause::voltage_would_rise);
  CHECK(limits.charge.value == 4'100'000);
  CHECK(limits.charge.threshold == 4'187'500);
  is(limits.discharge_continuous, 40'000, LimitCause::voltage_would_fall);
  is(limits.charge_continuous, 4'000, LimitCause::voltage_would_rise);
  bench.inputs.predicted.discharge.is_known = false;
  is(bench.limits().discharge, 120'000, LimitCause::peak);
}

TEST_CASE("while nothing can be said of some voltage, limits do not rise", "[unit][limits][prediction]") {
  Bench bench;
  bench.inputs.before.discharge = {.limit_mA = 30'000, .cause = LimitCause::hot};
  is(bench.limits().discharge, 120'000, LimitCause::peak);
  bench.inputs.predicted.is_complete = false;
  is(bench.limits().discharge, 30'000, LimitCause::hot);
}

TEST_CASE("a part binds with what it bears for long and for a moment", "[unit][limits][parts]") {
  Bench bench;
  bench.config.component_limits.push_back(part({.discharge_continuous_mA = 90'000, .discharge_peak_mA = 200'000}));
  bench.config.component_limits.push_back(part({.discharge_continuous_mA = 50'000, .discharge_peak_mA = 100'000}));
  is(bench.limits().discharge, 100'000, LimitCause::component);
  CHECK(bench.limits().discharge.part == 1);
  CHECK(bench.limits().discharge.unhindered_mA == 120'000);
  is(bench.limits().discharge_continuous, 50'000, LimitCause::component);
  CHECK(bench.limits().discharge_continuous.part == 1);
  is(bench.limits().charge, 30'000, LimitCause::peak);
  bench.inputs.discharge_used_permille = 700;  // half of the range between peak and continuous is gone
  is(bench.limits().discharge, 75'000, LimitCause::overload);
  bench.inputs.discharge_used_permille = 900;
  is(bench.limits().discharge, 50'000, LimitCause::overload);
  bench.inputs.discharge_used_permille = 0;
  bench.config.component_limits.push_back(part({.charge_continuous_mA = 8'000, .charge_peak_mA = 9'000}));
  is(bench.limits().charge, 9'000, LimitCause::component);
  CHECK(bench.limits().charge.part == 2);
  is(bench.limits().charge_continuous, 8'000, LimitCause::component);
  bench.config.component_limits.push_back(part({.charge_peak_mA = 1}));  // 0: none; 1 mA is a rating
  is(bench.limits().charge, 1, LimitCause::component);
}

TEST_CASE("the user's wish binds where it is less", "[unit][limits][parts]") {
  Bench bench;
  bench.config.user_limits = {.discharge_continuous_mA = 10'000,
                              .discharge_peak_mA = 15'000,
                              .charge_continuous_mA = 5'000,
                              .charge_peak_mA = 6'000};
  is(bench.limits().discharge, 15'000, LimitCause::user);
  is(bench.limits().discharge_continuous, 10'000, LimitCause::user);
  is(bench.limits().charge, 6'000, LimitCause::user);
  is(bench.limits().charge_continuous, 5'000, LimitCause::user);
  bench.pack.cell_temperature_dC.max = 590;  // a tenth of 120 A is below the user limit, a tenth of 80 A as well
  is(bench.limits().discharge, 12'000, LimitCause::cell_hot);
  is(bench.limits().discharge_continuous, 8'000, LimitCause::cell_hot);
}

TEST_CASE("the excess heat is counted from what all parts and the user leave", "[unit][limits][parts]") {
  Bench bench;
  bench.config.component_limits.push_back(part({.discharge_continuous_mA = 50'000, .discharge_peak_mA = 100'000}));
  bench.config.component_limits.push_back(part({.charge_continuous_mA = 90'000, .charge_peak_mA = 7'000}));
  bench.config.user_limits = {.discharge_peak_mA = 60'000, .charge_continuous_mA = 4'000};
  const CurrentLimitConfig current = carried(bench.config);
  CHECK(current.discharge_continuous_mA == 50'000);
  CHECK(current.discharge_peak_mA == 60'000);
  CHECK(current.charge_continuous_mA == 4'000);
  CHECK(current.charge_peak_mA == 7'000);
  bench.config.user_limits.charge_peak_mA = 1;
  CHECK(carried(bench.config).charge_peak_mA == 1);
  CHECK(current.discharge_peak_for == bench.config.current.discharge_peak_for);
}

TEST_CASE("a limp-home floor holds against tables and lines, and says so", "[unit][limits][limp_home]") {
  Bench bench;
  bench.config.derating.discharge_over_temperature = table({{-100, 0}, {100, 1'000}});
  bench.config.derating.charge_over_temperature = table({{0, 0}, {100, 1'000}});
  bench.pack.cell_temperature_dC.min = -40;  // 0.3 by the table; 160 of 150 by the linear derating: no effect yet
  bench.config.limits.cell_undertemperature = {.warn = -50, .open = -200};
  is(bench.limits().discharge, 36'000, LimitCause::cold);
  bench.config.current.limp_home_discharge_mA = 36'000;
  is(bench.limits().discharge, 36'000, LimitCause::cold);  // not below the floor
  is(bench.limits().discharge_continuous, 36'000, LimitCause::limp_home);
  bench.config.current.limp_home_discharge_mA = 36'001;
  is(bench.limits().discharge, 36'001, LimitCause::limp_home);
  CHECK(bench.limits().discharge.unhindered_mA == 120'000);
  is(bench.limits().charge, 0, LimitCause::cold);  // not for charging
  bench.pack.cell_temperature_dC.min = -150;       // linear derating, too, and the table at its zero
  is(bench.limits().discharge, 36'001, LimitCause::limp_home);
  bench.pack.cell_temperature_dC.min = -199;
  is(bench.limits().discharge, 36'001, LimitCause::limp_home);
  bench.pack.cell_temperature_dC.min = -200;  // at its threshold the floor no longer applies
  is(bench.limits().discharge, 0, LimitCause::cell_cold);
}

TEST_CASE("a limp-home floor is no more than what parts, the user and the voltages leave, and no fault minds it",
          "[unit][limits][limp_home]") {
  Bench bench;
  bench.config.derating.discharge_over_temperature = table({{-100, 0}, {100, 1'000}});
  bench.pack.cell_temperature_dC.min = -80;  // a tenth: 12 A
  bench.config.current.limp_home_discharge_mA = 20'000;
  is(bench.limits().discharge, 20'000, LimitCause::limp_home);
  bench.inputs.predicted.discharge = {.is_known = true, .limit_mA = 20'000};
  is(bench.limits().discharge, 20'000, LimitCause::limp_home);
  bench.inputs.predicted.discharge = {.is_known = true, .limit_mA = 15'000};
  is(bench.limits().discharge, 15'000, LimitCause::voltage_would_fall);
  bench.inputs.predicted.discharge.limit_mA = 12'000;  // same as by the table
  is(bench.limits().discharge, 12'000, LimitCause::cold);
  bench.inputs.predicted.discharge.limit_mA = 11'000;
  is(bench.limits().discharge, 11'000, LimitCause::voltage_would_fall);
  bench.inputs.predicted = {};
  bench.config.user_limits = {.discharge_continuous_mA = 10'000, .discharge_peak_mA = 18'000};
  is(bench.limits().discharge, 18'000, LimitCause::user);
  bench.config.user_limits = {};
  bench.config.component_limits.push_back(part({.discharge_continuous_mA = 9'000, .discharge_peak_mA = 17'000}));
  is(bench.limits().discharge, 17'000, LimitCause::component);
  bench.inputs.may_discharge = false;
  is(bench.limits().discharge, 0, LimitCause::fault);
  bench.inputs.is_connected = false;
  is(bench.limits().discharge, 0, LimitCause::not_connected);
}

TEST_CASE("a limp-home floor holds against a line before it has come to its threshold", "[unit][limits][limp_home]") {
  Bench bench;
  bench.config.limits.cell_undertemperature = {.warn = -50, .open = -200};
  bench.pack.cell_temperature_dC.min = -190;
  const CurrentLimit line = bench.limits().discharge;
  CHECK(line.cause == LimitCause::cell_cold);
  REQUIRE(line.limit_mA > 0);
  REQUIRE(line.limit_mA < 20'000);
  bench.config.current.limp_home_discharge_mA = 20'000;
  is(bench.limits().discharge, 20'000, LimitCause::limp_home);
}

TEST_CASE("what nobody has worked out is nothing", "[unit][limits]") {
  const CurrentLimit limit;
  CHECK(limit.limit_mA == 0);
  CHECK(limit.cause == LimitCause::not_connected);
  CHECK(limit.value == 0);
  CHECK(limit.part == 0);
  const PredictedLimit predicted;
  CHECK_FALSE(predicted.is_known);
  CHECK(predicted.limit_mA == 0);
  CHECK(predicted.voltage_uV == 0);
  CHECK(predicted.holds_uV == 0);
  const DeratingPoint point;
  CHECK(point.at == 0);
  CHECK(point.share_permille == 0);
}

TEST_CASE("without a floor in the pack file there is none", "[unit][limits][limp_home]") {
  Bench bench;
  bench.config.derating.discharge_over_temperature = table({{-100, 0}, {100, 1'000}});
  bench.pack.cell_temperature_dC.min = -100;
  is(bench.limits().discharge, 0, LimitCause::cold);
}

TEST_CASE("of each cause it is known whether it protects, and whether it was measured", "[unit][limits]") {
  for (const LimitCause cause :
       {LimitCause::cell_voltage_low, LimitCause::cell_voltage_high, LimitCause::cell_imbalance, LimitCause::cell_hot,
        LimitCause::cell_cold, LimitCause::too_hot_to_charge, LimitCause::too_cold_to_charge,
        LimitCause::temperature_spread, LimitCause::board_hot, LimitCause::drawn_too_much,
        LimitCause::charged_too_much}) {
    CAPTURE(to_text(cause));
    CHECK(is_protection(cause));
    CHECK(is_measured_cause(cause));
  }
  for (const LimitCause cause : {LimitCause::not_connected, LimitCause::fault}) {
    CAPTURE(to_text(cause));
    CHECK(is_protection(cause));
    CHECK_FALSE(is_measured_cause(cause));
  }
  for (const LimitCause cause : {LimitCause::voltage_would_fall, LimitCause::voltage_would_rise, LimitCause::cold,
                                 LimitCause::hot, LimitCause::empty, LimitCause::full}) {
    CAPTURE(to_text(cause));
    CHECK_FALSE(is_protection(cause));
    CHECK(is_measured_cause(cause));
  }
  for (const LimitCause cause :
       {LimitCause::continuous, LimitCause::peak, LimitCause::overload, LimitCause::charge_not_known,
        LimitCause::component, LimitCause::user, LimitCause::limp_home, LimitCause::measuring, LimitCause::rising,
        LimitCause::power, LimitCause::not_sensed}) {
    CAPTURE(to_text(cause));
    CHECK_FALSE(is_protection(cause));
    CHECK_FALSE(is_measured_cause(cause));
  }
}

TEST_CASE("a pause to measure takes what may be charged, and nothing else", "[unit][limits][charge_pause]") {
  Bench bench;
  bench.inputs.is_charge_paused = true;
  is(bench.limits().charge, 0, LimitCause::measuring);
  is(bench.limits().charge_continuous, 0, LimitCause::measuring);
  is(bench.limits().discharge, 120'000, LimitCause::peak);
  is(bench.limits().discharge_continuous, 80'000, LimitCause::continuous);
  CHECK_FALSE(is_protection(LimitCause::measuring));
  CHECK_FALSE(is_measured_cause(LimitCause::measuring));
  bench.inputs.may_charge = false;  // a limit by a fault is reported as such
  is(bench.limits().charge, 0, LimitCause::fault);
}

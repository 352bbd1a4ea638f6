// Derating of current limits: linear derating to the milliampere, which value limits which direction, and the limits
// while a value is missing.
#include "daemon/core/limits/limits.hpp"

#include <set>

#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

using namespace bmu;

namespace {

constexpr Element hottest{.module_node = 1, .number = 2, .pack_number = 2, .is_temperature_sensor = true};
constexpr Element coldest{.module_node = 2, .number = 1, .pack_number = 3, .is_temperature_sensor = true};
constexpr Element lowest{.module_node = 1, .number = 1, .pack_number = 1};
constexpr Element highest{.module_node = 2, .number = 4, .pack_number = 8};

/// Pack without derating: 80 A discharge, 20 A charge.
struct Bench {
  CoreConfig config = test::small_pack();
  PackState pack{
      .cell_voltage_uV =
          {.min = 3'700'000, .max = 3'700'000, .min_at = lowest, .max_at = highest, .count = 8, .expected = 8},
      .cell_temperature_dC = {.min = 250, .max = 250, .min_at = coldest, .max_at = hottest, .count = 4, .expected = 4}};
  LimitInputs inputs{.is_connected = true, .may_discharge = true, .may_charge = true};

  [[nodiscard]] CurrentLimit discharge() const { return evaluate_limits(pack, config, inputs).discharge; }
  [[nodiscard]] CurrentLimit charge() const { return evaluate_limits(pack, config, inputs).charge; }
};

}  // namespace

TEST_CASE("with nothing special the limits are the continuous ones", "[unit][limits]") {
  const Bench bench;
  CHECK(bench.discharge().limit_mA == 80'000);
  CHECK(bench.discharge().cause == LimitCause::continuous);
  CHECK(bench.charge().limit_mA == 20'000);
  CHECK(bench.charge().cause == LimitCause::continuous);
}

TEST_CASE("limits that nobody evaluated are zero, and inputs that nobody filled in are not connected",
          "[unit][limits]") {
  const CurrentLimit limit;
  CHECK(limit.limit_mA == 0);
  CHECK(limit.cause == LimitCause::not_connected);
  CHECK(limit.value == 0);
  CHECK(limit.derates_from == 0);
  CHECK(limit.threshold == 0);
  CHECK(limit.unhindered_mA == 0);
  const LimitInputs unfilled;
  CHECK_FALSE(unfilled.may_discharge);
  CHECK_FALSE(unfilled.may_charge);
  CHECK(unfilled.discharge_used_permille == 0);
  CHECK(unfilled.charge_used_permille == 0);
  Bench bench;
  bench.inputs = {};
  CHECK(bench.discharge().limit_mA == 0);
  CHECK(bench.charge().limit_mA == 0);
}

TEST_CASE("not connected, and a fault that asks for it, leave no current, and say which", "[unit][limits]") {
  Bench bench;
  bench.inputs.may_charge = false;
  CHECK(bench.charge().limit_mA == 0);
  CHECK(bench.charge().cause == LimitCause::fault);
  CHECK(bench.discharge().limit_mA == 80'000);
  bench.inputs = {.is_connected = true, .may_discharge = false, .may_charge = true};
  CHECK(bench.discharge().limit_mA == 0);
  CHECK(bench.discharge().cause == LimitCause::fault);
  CHECK(bench.charge().limit_mA == 20'000);
  bench.inputs = {.is_connected = false};
  for (const CurrentLimit& limit : {bench.discharge(), bench.charge()}) {
    CHECK(limit.limit_mA == 0);
    CHECK(limit.cause == LimitCause::not_connected);
  }
}

TEST_CASE("between warning and opening threshold the limit falls in a straight line", "[unit][limits][BMU_13]") {
  Bench bench;
  const auto discharge_at_uV = [&bench](std::int32_t min_uV) {  // warns at 3.1 V, opens at 2.9 V
    bench.pack.cell_voltage_uV.min = min_uV;
    return bench.discharge().limit_mA;
  };
  CHECK(discharge_at_uV(3'100'001) == 80'000);
  CHECK(discharge_at_uV(3'100'000) == 80'000);
  CHECK(discharge_at_uV(3'099'999) == 79'920);  // 999 of 1000: in whole permille, rounded down
  CHECK(discharge_at_uV(3'099'800) == 79'920);
  CHECK(discharge_at_uV(3'000'000) == 40'000);
  CHECK(discharge_at_uV(2'900'200) == 80);
  CHECK(discharge_at_uV(2'900'199) == 0);
  CHECK(discharge_at_uV(2'900'000) == 0);
  CHECK(discharge_at_uV(2'800'000) == 0);
  const auto charge_at_uV = [&bench](std::int32_t max_uV) {  // warns at 4.15 V, opens at 4.2 V
    bench.pack.cell_voltage_uV.max = max_uV;
    return bench.charge().limit_mA;
  };
  CHECK(charge_at_uV(4'150'000) == 20'000);
  CHECK(charge_at_uV(4'150'050) == 19'980);
  CHECK(charge_at_uV(4'175'000) == 10'000);
  CHECK(charge_at_uV(4'199'950) == 20);
  CHECK(charge_at_uV(4'200'000) == 0);
  CHECK(charge_at_uV(4'300'000) == 0);
}

TEST_CASE("the last count before an opening threshold still leaves its share", "[unit][limits][BMU_13]") {
  Bench bench;
  bench.pack.cell_temperature_dC.max = 599;  // warns at 50 C, opens at 60 C
  CHECK(bench.discharge().limit_mA == 800);
  bench.pack.cell_temperature_dC.max = 600;
  CHECK(bench.discharge().limit_mA == 0);
}

TEST_CASE("each value limits the directions it is endangered by, and names itself", "[unit][limits][BMU_13]") {
  struct Case {
    LimitCause cause;
    void (*set)(PackState& pack);
    std::int32_t discharge_mA;
    std::int32_t charge_mA;
    std::int32_t value;
    std::int32_t threshold;
    Element element;
  };
  const Case cases[] = {
      {LimitCause::cell_voltage_low, [](PackState& it) { it.cell_voltage_uV.min = 3'000'000; }, 40'000, 20'000,
       3'000'000, 2'900'000, lowest},
      {LimitCause::cell_voltage_high, [](PackState& it) { it.cell_voltage_uV.max = 4'175'000; }, 80'000, 10'000,
       4'175'000, 4'200'000, highest},
      {LimitCause::cell_hot, [](PackState& it) { it.cell_temperature_dC.max = 550; }, 40'000, 10'000, 550, 600,
       hottest},
      {LimitCause::cell_cold, [](PackState& it) { it.cell_temperature_dC.min = -125; }, 40'000, 10'000, -125, -200,
       coldest},
  };
  for (const Case& one : cases) {
    DYNAMIC_SECTION(to_text(one.cause)) {
      Bench bench;
      one.set(bench.pack);
      CHECK(bench.discharge().limit_mA == one.discharge_mA);
      CHECK(bench.charge().limit_mA == one.charge_mA);
      for (const CurrentLimit& limit : {bench.discharge(), bench.charge()}) {
        if (limit.cause == LimitCause::continuous) continue;
        CHECK(limit.cause == one.cause);
        CHECK(limit.value == one.value);
        CHECK(limit.threshold == one.threshold);
        CHECK(limit.element == one.element);
      }
    }
  }
}

TEST_CASE("of several reasons the smallest limit wins, and of equal ones the first", "[unit][limits]") {
  Bench bench;
  bench.pack.cell_voltage_uV.min = 3'000'000;
  bench.pack.cell_temperature_dC.max = 575;
  CHECK(bench.discharge().limit_mA == 20'000);
  CHECK(bench.discharge().cause == LimitCause::cell_hot);
  bench.pack.cell_temperature_dC.max = 550;
  CHECK(bench.discharge().limit_mA == 40'000);
  CHECK(bench.discharge().cause == LimitCause::cell_voltage_low);
  bench.pack.cell_temperature_dC.max = 525;
  CHECK(bench.discharge().limit_mA == 40'000);
  CHECK(bench.discharge().cause == LimitCause::cell_voltage_low);
}

TEST_CASE("a value that is the highest less the lowest limits both directions, and so does a hot board",
          "[unit][limits][BMU_13]") {
  Bench bench;
  bench.config.limits.cell_imbalance = {.warn = 300'000, .open = 800'000};
  bench.config.limits.temperature_spread = {.warn = 150, .open = 300};
  bench.pack.cell_voltage_uV.min = 3'300'000;
  bench.pack.cell_voltage_uV.max = 3'850'000;
  for (const CurrentLimit& limit : {bench.discharge(), bench.charge()}) {
    CHECK(limit.cause == LimitCause::cell_imbalance);
    CHECK(limit.value == 550'000);
    CHECK(limit.threshold == 800'000);
    CHECK(limit.element == highest);
  }
  CHECK(bench.discharge().limit_mA == 40'000);
  CHECK(bench.charge().limit_mA == 10'000);
  bench.pack.cell_temperature_dC.min = 25;
  bench.pack.cell_temperature_dC.max = 295;  // 27 K apart, of 15 K to 30 K
  CHECK(bench.discharge().limit_mA == 16'000);
  CHECK(bench.discharge().cause == LimitCause::temperature_spread);
  CHECK(bench.charge().limit_mA == 4'000);
  bench.config.limits.board_overtemperature = {.warn = 850, .open = 1'000};
  bench.pack.board_temperature_dC = {.min = 200, .max = 985, .max_at = hottest, .count = 1, .expected = 8};
  CHECK(bench.discharge().limit_mA == 8'000);
  CHECK(bench.discharge().cause == LimitCause::board_hot);
  CHECK(bench.discharge().value == 985);
  CHECK(bench.charge().limit_mA == 2'000);
}

TEST_CASE("too hot or too cold to charge says nothing against discharging", "[unit][limits][BMU_13]") {
  Bench bench;
  bench.config.limits.charge_overtemperature = {.warn = 400, .open = 450};
  bench.config.limits.charge_undertemperature = {.warn = 50, .open = 0};
  bench.pack.cell_temperature_dC.max = 425;
  CHECK(bench.charge().limit_mA == 10'000);
  CHECK(bench.charge().cause == LimitCause::too_hot_to_charge);
  CHECK(bench.discharge().limit_mA == 80'000);
  bench.pack.cell_temperature_dC.max = 250;
  bench.pack.cell_temperature_dC.min = 10;
  CHECK(bench.charge().limit_mA == 4'000);
  CHECK(bench.charge().cause == LimitCause::too_cold_to_charge);
  CHECK(bench.charge().element == coldest);
  CHECK(bench.discharge().limit_mA == 80'000);
}

TEST_CASE("derating begins at the middle tier where there is one", "[unit][limits][BMU_13]") {
  Bench bench;
  bench.config.limits.cell_overtemperature = {.warn = 450, .limit = 550, .open = 600};
  bench.pack.cell_temperature_dC.max = 550;
  CHECK(bench.discharge().limit_mA == 80'000);
  bench.pack.cell_temperature_dC.max = 551;
  CHECK(bench.discharge().limit_mA == 78'400);
}

TEST_CASE("a peak is there until half of it is used, and sinks to the continuous current before all is",
          "[unit][limits][BMS_NF.7]") {
  Bench bench;
  bench.config.current.discharge_peak_mA = 180'000;
  bench.config.current.charge_peak_mA = 30'000;
  const auto discharge_at = [&bench](std::int64_t used_permille) {
    bench.inputs.discharge_used_permille = used_permille;
    return bench.discharge();
  };
  CHECK(discharge_at(0).limit_mA == 180'000);
  CHECK(discharge_at(500).limit_mA == 180'000);
  CHECK(discharge_at(500).cause == LimitCause::peak);
  CHECK(discharge_at(501).limit_mA == 179'750);
  CHECK(discharge_at(501).cause == LimitCause::overload);
  CHECK(discharge_at(501).value == 501);
  CHECK(discharge_at(501).derates_from == 500);
  CHECK(discharge_at(501).threshold == 1'000);
  CHECK(discharge_at(501).unhindered_mA == 180'000);
  CHECK(discharge_at(750).limit_mA == 117'500);
  CHECK(discharge_at(899).limit_mA == 80'250);
  CHECK(discharge_at(900).limit_mA == 80'000);
  CHECK(discharge_at(1'000).limit_mA == 80'000);
  CHECK(discharge_at(1'500).limit_mA == 80'000);
  CHECK(bench.charge().limit_mA == 30'000);
  bench.inputs.charge_used_permille = 750;
  CHECK(bench.charge().limit_mA == 23'750);
  CHECK(bench.charge().cause == LimitCause::overload);
  bench.config.current.discharge_peak_mA = 80'000;
  CHECK(discharge_at(750).limit_mA == 80'000);
  CHECK(discharge_at(750).cause == LimitCause::continuous);
}

TEST_CASE("a derating takes its share of the peak, too", "[unit][limits]") {
  Bench bench;
  bench.config.current.discharge_peak_mA = 180'000;
  bench.pack.cell_temperature_dC.max = 550;
  CHECK(bench.discharge().limit_mA == 90'000);
  CHECK(bench.discharge().derates_from == bench.config.limits.cell_overtemperature.derates_from());
  CHECK(bench.discharge().unhindered_mA == 180'000);
}

TEST_CASE("without a single value of a kind nothing is derived from it", "[unit][limits]") {
  Bench bench;
  bench.inputs.before = {.discharge = {.limit_mA = 80'000}, .charge = {.limit_mA = 20'000}};
  bench.pack.cell_voltage_uV = {.expected = 8};
  bench.pack.cell_temperature_dC = {.expected = 4};
  CHECK(bench.discharge().limit_mA == 80'000);
  CHECK(bench.discharge().cause == LimitCause::continuous);
  CHECK(bench.charge().limit_mA == 20'000);
  bench.pack.cell_temperature_dC = {.min = 250, .max = 550, .count = 1, .expected = 4};
  CHECK(bench.discharge().limit_mA == 40'000);
}

TEST_CASE("while a cell or a temperature is missing limits do not rise, but fall", "[unit][limits]") {
  const CurrentLimit before{.limit_mA = 10'000, .cause = LimitCause::cell_hot};
  for (Spread PackState::*const missing : {&PackState::cell_voltage_uV, &PackState::cell_temperature_dC}) {
    Bench bench;
    bench.inputs.before = {.discharge = before, .charge = before};
    CHECK(bench.discharge().limit_mA == 80'000);
    --(bench.pack.*missing).count;
    for (const CurrentLimit& limit : {bench.discharge(), bench.charge()}) {
      CHECK(limit.limit_mA == 10'000);
      CHECK(limit.cause == LimitCause::cell_hot);
    }
    bench.pack.cell_voltage_uV.min = 2'900'000;
    CHECK(bench.discharge().limit_mA == 0);
    CHECK(bench.discharge().cause == LimitCause::cell_voltage_low);
    CHECK(bench.charge().limit_mA == 10'000);
  }
}

TEST_CASE("an equal limit of before does not take the place of the present one", "[unit][limits]") {
  Bench bench;
  bench.inputs.before = {.discharge = {.limit_mA = 80'000, .cause = LimitCause::cell_cold}};
  bench.pack.cell_voltage_uV.count = 7;
  CHECK(bench.discharge().cause == LimitCause::continuous);
}

TEST_CASE("a current beyond the middle tier of its own limit is answered with less, and with nothing where it opens",
          "[unit][limits][BMU_13]") {
  Bench bench;
  LimitConfig& out = bench.config.limits.discharge_overcurrent;
  LimitConfig& in = bench.config.limits.charge_overcurrent;
  out = {.warn = 90'000, .open = 110'000, .hysteresis = 1'000};
  in = {.warn = 25'000, .open = 30'000, .hysteresis = 1'000};
  bench.pack.current_mA = {105'000, TimePoint{1s}, Validity::valid};
  CHECK(bench.discharge().limit_mA == 80'000);  // no tier of its own: the warning changes nothing
  out.limit = 100'000;
  CHECK(bench.discharge().limit_mA == 40'000);
  CHECK(bench.discharge().cause == LimitCause::drawn_too_much);
  CHECK(bench.discharge().value == 105'000);
  CHECK(bench.discharge().derates_from == 100'000);
  CHECK(bench.discharge().threshold == 110'000);
  CHECK(bench.discharge().unhindered_mA == 80'000);
  CHECK(bench.charge().limit_mA == 20'000);
  bench.pack.current_mA.value = 100'000;
  CHECK(bench.discharge().cause == LimitCause::continuous);
  bench.pack.current_mA.value = 110'000;
  CHECK(bench.discharge().limit_mA == 0);
  bench.pack.current_mA.value = 105'000;
  bench.pack.cell_temperature_dC.max = bench.config.limits.cell_overtemperature.open;
  CHECK(bench.discharge().limit_mA == 0);  // the lower limit applies
  CHECK(bench.discharge().cause == LimitCause::cell_hot);
  bench.pack.cell_temperature_dC.max = 250;
  bench.pack.current_mA.validity = Validity::unknown;
  CHECK(bench.discharge().limit_mA == 80'000);
  in.limit = 26'000;
  bench.pack.current_mA = {-29'000, TimePoint{1s}, Validity::valid};
  CHECK(bench.charge().limit_mA == 5'000);
  CHECK(bench.charge().cause == LimitCause::charged_too_much);
  CHECK(bench.charge().value == 29'000);
  CHECK(bench.discharge().limit_mA == 80'000);
}

TEST_CASE("every cause of a limit has a text of its own, and no other number has one", "[unit][limits]") {
  std::set<std::string_view> texts;
  for (int cause = 0; cause <= static_cast<int>(LimitCause::not_sensed); ++cause) {
    texts.insert(to_text(static_cast<LimitCause>(cause)));
  }
  CHECK(texts.size() == 30);
  CHECK_FALSE(texts.contains("?"));
  CHECK(to_text(static_cast<LimitCause>(99)) == "?");
}

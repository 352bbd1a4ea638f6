// How current limits fall: the straight line to the milliampere, which value limits which direction, and what holds
// while something is missing.
#include "daemon/core/limits.hpp"

#include <set>

#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

using namespace bmu;

namespace {

constexpr Element hottest{.module_node = 1, .number = 2, .pack_number = 2, .is_temperature_sensor = true};
constexpr Element coldest{.module_node = 2, .number = 1, .pack_number = 3, .is_temperature_sensor = true};
constexpr Element lowest{.module_node = 1, .number = 1, .pack_number = 1};
constexpr Element highest{.module_node = 2, .number = 4, .pack_number = 8};

/// A pack in its best state: 80 A out, 20 A in.
struct Bench {
  CoreConfig config = test::small_pack();
  PackState pack{
      .cell_voltage_uV =
          {.min = 3'700'000, .max = 3'700'000, .min_at = lowest, .max_at = highest, .count = 8, .expected = 8},
      .cell_temperature_dC = {.min = 250, .max = 250, .min_at = coldest, .max_at = hottest, .count = 4, .expected = 4}};
  LimitInputs inputs{.is_connected = true};

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
  CHECK(limit.threshold == 0);
  Bench bench;
  bench.inputs = {};
  CHECK(bench.discharge().limit_mA == 0);
  CHECK(bench.charge().limit_mA == 0);
}

TEST_CASE("not connected, and a fault that asks for it, leave no current, and say which", "[unit][limits]") {
  Bench bench;
  bench.inputs = {.is_connected = true, .zero_is_demanded = true};
  for (const CurrentLimit& limit : {bench.discharge(), bench.charge()}) {
    CHECK(limit.limit_mA == 0);
    CHECK(limit.cause == LimitCause::fault);
  }
  bench.inputs = {.is_connected = false, .zero_is_demanded = true};
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
  CHECK(discharge_at_uV(3'099'999) == 79'920);  // 999 of 1000: in whole permille, downwards
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

TEST_CASE("every cause of a limit has a text of its own, and no other number has one", "[unit][limits]") {
  std::set<std::string_view> texts;
  for (int cause = 0; cause <= static_cast<int>(LimitCause::cell_cold); ++cause) {
    texts.insert(to_text(static_cast<LimitCause>(cause)));
  }
  CHECK(texts.size() == 7);
  CHECK_FALSE(texts.contains("?"));
  CHECK(to_text(static_cast<LimitCause>(99)) == "?");
}

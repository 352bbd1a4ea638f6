// Pack-file keys that are valid alone but contradict each other or leave the pack unprotected; and defaults that are
// derived from other keys.
#include <string>
#include <vector>

#include "config/checks/bus_budget.hpp"
#include "config/checks/bus_checks.hpp"
#include "config/checks/identifier_checks.hpp"
#include "config/checks/pack_checks.hpp"
#include "config/fields/pack_fields.hpp"
#include "config/pack_config.hpp"
#include "daemon/core/faults/fault_table.hpp"
#include "daemon/core/vehicle/cell_reporter.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/changed_pack.hpp"

namespace bmu {
namespace {

TEST_CASE("open limits may reach the cell's absolute limits and not pass them", "[unit][config][BMS_NF.1]") {
  accepts({{"/limits/cell_overvoltage/open_mV", 4'250}});
  refuses({{"/limits/cell_overvoltage/open_mV", 4'251}}, "/limits/cell_overvoltage/open_mV", "at most 4250");
  accepts({{"/limits/cell_undervoltage/open_mV", 2'500}});
  refuses({{"/limits/cell_undervoltage/open_mV", 2'499}}, "/limits/cell_undervoltage/open_mV", "at least 2500");
  accepts({{"/limits/cell_overtemperature/open_dC", 600}});
  refuses({{"/limits/cell_overtemperature/open_dC", 601}}, "/limits/cell_overtemperature/open_dC", "at most 600");
  accepts({{"/limits/cell_undertemperature/open_dC", -200}});
  refuses({{"/limits/cell_undertemperature/open_dC", -201}}, "/limits/cell_undertemperature/open_dC", "at least -200");
}

TEST_CASE("the warning comes before the opening", "[unit][config][BMU_13]") {
  refuses({{"/limits/cell_overvoltage/warn_mV", 4'230}}, "/limits/cell_overvoltage/warn_mV", "less than open_mV, 4230");
  refuses({{"/limits/cell_undervoltage/warn_mV", 2'800}}, "/limits/cell_undervoltage/warn_mV",
          "more than open_mV, 2800");
  refuses({{"/limits/cell_undertemperature/warn_dC", -101}}, "/limits/cell_undertemperature/warn_dC",
          "more than open_dC");
  refuses({{"/limits/discharge_overcurrent/warn_mA", 90'001}}, "/limits/discharge_overcurrent/warn_mA", "less than");
}

TEST_CASE("a hysteresis is smaller than the distance of warning and opening", "[unit][config]") {
  accepts({{"/limits/cell_overvoltage/hysteresis_mV", 29}});
  refuses({{"/limits/cell_overvoltage/hysteresis_mV", 30}}, "/limits/cell_overvoltage/hysteresis_mV", "less than");
  refuses({{"/limits/cell_undertemperature/hysteresis_dC", 100}}, "/limits/cell_undertemperature/hysteresis_dC",
          "less than");
}

TEST_CASE("undervoltage lies below overvoltage with room between", "[unit][config]") {
  // 4200 - 20 - 50 = 4130: here the two warnings and their hystereses meet.
  accepts({{"/limits/cell_undervoltage/warn_mV", 4'129}});
  refuses({{"/limits/cell_undervoltage/warn_mV", 4'130}}, "/limits/cell_undervoltage/warn_mV", "less than 4130");
  refuses({{"/limits/cell_undertemperature/warn_dC", 470}}, "/limits/cell_undertemperature/warn_dC", "less than 460");
}

TEST_CASE("overcurrent opens above the continuous current, reaching it being enough to open", "[unit][config]") {
  accepts({{"/current/discharge_peak_mA", 0}, {"/current/discharge_continuous_mA", 89'999}});
  refuses({{"/current/discharge_peak_mA", 0}, {"/current/discharge_continuous_mA", 90'000}},
          "/limits/discharge_overcurrent/open_mA", "more than 90000");
  refuses({{"/current/charge_continuous_mA", 30'000}}, "/limits/charge_overcurrent/open_mA", "more than 30000");
}

TEST_CASE("contactors break at least what flows for ever, where the file says what they break",
          "[unit][config][PB_F.1]") {
  accepts({{"/contactors/break_current_max_mA", 0}});
  accepts({{"/contactors/break_current_max_mA", 60'000}});
  refuses({{"/contactors/break_current_max_mA", 59'999}}, "/contactors/break_current_max_mA",
          "at least discharge_continuous_mA, 60000");
  refuses({{"/contactors/break_current_max_mA", 28'999},
           {"/current/discharge_continuous_mA", 1'000},
           {"/current/charge_continuous_mA", 29'000}},
          "/contactors/break_current_max_mA", "at least charge_continuous_mA, 29000");
}

TEST_CASE("confirming takes no longer than the reaction allows", "[unit][config][FS_2]") {
  accepts({{"/limits/cell_overvoltage/confirm_ms", 190}});
  refuses({{"/limits/cell_overvoltage/confirm_ms", 191}}, "/limits/cell_overvoltage/confirm_ms",
          "found 191, expected at most 190 with cell_voltage_ms 250, so that cell_overvoltage opens the pack within "
          "450 ms");
  // A temperature that crosses its limit just after the module's sample is measured with the next sample and read with
  // the next poll.
  accepts({{"/limits/cell_overtemperature/confirm_ms", 340}});
  refuses(
      {{"/limits/cell_overtemperature/confirm_ms", 341}}, "/limits/cell_overtemperature/confirm_ms",
      "at most 340 where modules sample every 500 ms and are polled every 100 ms, so that cell_overtemperature opens "
      "the pack within 950 ms");
  refuses({{"/ages/temperature_ms", 640}, {"/limits/cell_overtemperature/confirm_ms", 301}},
          "/limits/cell_overtemperature/confirm_ms", "at most 300 with temperature_ms 640");
  accepts({{"/limits/charge_overcurrent/confirm_ms", 240}});
  refuses({{"/limits/charge_overcurrent/confirm_ms", 241}}, "/limits/charge_overcurrent/confirm_ms", "at most 240");
  accepts({{"/limits/pack_voltage_mismatch/confirm_ms", 740}});
  refuses({{"/limits/pack_voltage_mismatch/confirm_ms", 741}}, "/limits/pack_voltage_mismatch/confirm_ms",
          "at most 740");
}

TEST_CASE("a limit that lets the current fall first has that much less to confirm", "[unit][config][FS_2]") {
  REQUIRE(row_of(FaultId::cell_undertemperature).grace == 150ms);
  accepts({{"/limits/cell_undertemperature/confirm_ms", 190}});
  refuses(
      {{"/limits/cell_undertemperature/confirm_ms", 191}}, "/limits/cell_undertemperature/confirm_ms",
      "at most 190 where modules sample every 500 ms and are polled every 100 ms, so that cell_undertemperature opens "
      "the pack within 950 ms, its grace of 150 ms included");
}

TEST_CASE("what no pack needs is refused", "[unit][config]") {
  accepts({{"/contactors/precharge_current_max_mA", 5'000}, {"/contactors/precharge_overcurrent_mA", 5'001}});
  refuses({{"/contactors/precharge_current_max_mA", 100'000}}, "/contactors/precharge_current_max_mA",
          "found 100000, expected a whole number from 1 to 5000, a higher current is a load or a short circuit");
  accepts({{"/contactors/feedback_timeout_ms", 240}});
  refuses({{"/contactors/feedback_timeout_ms", 241}}, "/contactors/feedback_timeout_ms", "300 ms reaction time");
  accepts({{"/limits/discharge_overcurrent/open_mA", 1'500'000}});
  refuses({{"/limits/discharge_overcurrent/open_mA", 2'000'000}}, "/limits/discharge_overcurrent/open_mA",
          "from 10 to 1500000");
  refuses({{"/current/discharge_continuous_mA", 1'500'001}}, "/current/discharge_continuous_mA", "from 1 to 1500000");
  refuses({{"/soc/rest_current_mA", 5'001}}, "/soc/rest_current_mA", "from 1 to 5000");
}

TEST_CASE("a precharge may last longer than the slowest contact and the fastest link need, and no longer than 10 s",
          "[unit][config]") {
  accepts({{"/contactors/precharge_timeout_ms", 301}});
  refuses({{"/contactors/precharge_timeout_ms", 300}}, "/contactors/precharge_timeout_ms",
          "found 300, expected more than settle_ms and feedback_timeout_ms, 300");
  accepts({{"/contactors/precharge_timeout_ms", 720}, {"/contactors/precharge_min_ms", 600}});
  refuses({{"/contactors/precharge_timeout_ms", 719}, {"/contactors/precharge_min_ms", 600}},
          "/contactors/precharge_timeout_ms", "found 719, expected precharge_min_ms, 600, and 120 ms at least");
  accepts({{"/contactors/precharge_timeout_ms", 10'000}});
  refuses({{"/contactors/precharge_timeout_ms", 10'001}}, "/contactors/precharge_timeout_ms",
          "expected a whole number from 100 to 10000, a resistor that takes longer does not fit the DC link");
}

TEST_CASE("every pack says how soon a link cannot be charged", "[unit][config]") {
  Json pack = valid_pack();
  pack["contactors"].erase("precharge_min_ms");
  refuses_text(pack.dump(), "/contactors/precharge_min_ms", "missing, expected this required key");
  pack.erase("contactors");
  refuses_text(pack.dump(), "/contactors", "missing, expected this required key");
  accepts({{"/contactors/precharge_min_ms", 80}});
  refuses({{"/contactors/precharge_min_ms", 79}}, "/contactors/precharge_min_ms",
          "expected a whole number from 80 to 1000, the interval of the DC link voltage is 60 ms");
}

TEST_CASE("a precharge resistor can do what is asked of it", "[unit][config]") {
  // 48 cells of 4.23 V and 100 ohm: 203.04 V, 2.03 A, 412 W.
  accepts({{"/contactors/precharge_overcurrent_mA", 2'031}});
  refuses({{"/contactors/precharge_overcurrent_mA", 2'030}}, "/contactors/precharge_overcurrent_mA",
          "found 2030, expected more than 2030, with which the precharge of a full pack of 203040 mV begins");
  accepts({{"/contactors/precharge_overcurrent_mA", 0}});
  // To 95 % in 100 ms or more: at least 412 W * 0.1 s * 0.9975 / (2 * ln 20) = 6.86 J.
  accepts({{"/contactors/precharge_energy_J", 7}});
  refuses({{"/contactors/precharge_energy_J", 6}}, "/contactors/precharge_energy_J",
          "found 6, expected at least 7, what charging any link in precharge_min_ms or longer");
  accepts({{"/contactors/precharge_energy_J", 0}});
  accepts({{"/contactors/precharge_energy_J", 1}, {"/contactors/precharge_done_permille", 1'000}});
  accepts({{"/contactors/precharge_overcurrent_mA", 600},
           {"/contactors/precharge_resistance_Ohm", 0},
           {"/contactors/precharge_energy_J", 0}});
}

TEST_CASE("of two keys that mean nothing alone the one that is missing is named", "[unit][config]") {
  for (const auto& [given, missing] :
       {std::pair{"fan_on_dC", "fan_off_dC"}, std::pair{"fan_off_dC", "fan_on_dC"},
        std::pair{"heater_on_dC", "heater_off_dC"}, std::pair{"heater_off_dC", "heater_on_dC"}}) {
    CAPTURE(given);
    refuses({{"/auxiliary", Json{{given, 200}}}}, std::string("/auxiliary/") + missing,
            std::string("missing, expected this key, as ") + given + " is given");
  }
  accepts({{"/auxiliary/throttle_on_permille", 60}, {"/auxiliary/throttle_off_permille", 1}});
  refuses({{"/auxiliary/throttle_on_permille", 60}}, "/auxiliary/throttle_off_permille",
          "found 0, expected more than 0, or what throttle_on_permille has switched on stays on");
}

TEST_CASE("what a pack closed for charging may lose is between the sensor's accuracy and 1 A", "[unit][config]") {
  accepts({{"/contactors/charge_only_discharge_mA", 100}});
  accepts({{"/contactors/charge_only_discharge_mA", 1'000}});
  refuses({{"/contactors/charge_only_discharge_mA", 99}}, "/contactors/charge_only_discharge_mA", "from 100 to 1000");
  refuses({{"/contactors/charge_only_discharge_mA", 1'001}}, "/contactors/charge_only_discharge_mA",
          "the minimum is the accuracy of sensors");
}

TEST_CASE("two numbers that contradict each other are both named", "[unit][config]") {
  refuses({{"/current/discharge_peak_mA", 59'999}}, "/current/discharge_peak_mA",
          "found 59999, expected at least discharge_continuous_mA, 60000");
  refuses({{"/current/discharge_peak_mA", 90'000}}, "/limits/discharge_overcurrent/open_mA",
          "found 90000, expected more than discharge_peak_mA, 90000");
  refuses({{"/contactors/precharge_overcurrent_mA", 500}}, "/contactors/precharge_overcurrent_mA",
          "more than precharge_current_max_mA, 500");
  refuses({{"/contactors/precharge_resistance_Ohm", 0}}, "/contactors/precharge_resistance_Ohm",
          "found 0, expected more than 0, so that precharge_energy_J can be watched");
  refuses({{"/insulation/warn_Ohm_per_V", 500}}, "/insulation/warn_Ohm_per_V", "more than open_Ohm_per_V, 500");
  refuses({{"/auxiliary/fan_on_dC", 300}, {"/auxiliary/fan_off_dC", 300}}, "/auxiliary/fan_on_dC",
          "more than fan_off_dC, 300");
  refuses({{"/auxiliary/heater_on_dC", 50}, {"/auxiliary/heater_off_dC", 50}}, "/auxiliary/heater_off_dC",
          "more than heater_on_dC, 50");
  refuses({{"/auxiliary/throttle_off_permille", 1}}, "/auxiliary/throttle_on_permille",
          "at least throttle_off_permille, 1");
  refuses({{"/limits/charge_overtemperature/open_dC", 581}}, "/limits/cell_overtemperature/open_dC",
          "found 580, expected at least open_dC of charge_overtemperature, 581");
  refuses({{"/limits/charge_undertemperature/limit_dC", 51}}, "/limits/charge_undertemperature/limit_dC",
          "found 51, expected from warn_dC, 50, to before open_dC, 0");
  refuses({{"/insulation/monitoring", "perhaps"}}, "/insulation/monitoring", "ok_line or measured");
}

TEST_CASE("limits that guard nothing, or cross each other, are refused with what would do", "[unit][config][F79]") {
  const auto limit = [](const char* text) { return Json::parse(text); };
  const Json deep = limit(R"({"warn_mV":2600,"open_mV":2500,"hysteresis_mV":50,"confirm_ms":100,"clear_ms":1000})");
  accepts({{"/limits/cell_deep_discharge", deep}});
  refuses({{"/limits/cell_deep_discharge", deep}, {"/limits/cell_deep_discharge/open_mV", 2'499}},
          "/limits/cell_deep_discharge/open_mV",
          "found 2499, expected at least 2500, the cell's absolute voltage_min_mV");
  // 420 - 20 - 10 = 390: here the two warnings and their hystereses meet.
  accepts({{"/limits/charge_undertemperature/limit_dC", 389}, {"/limits/charge_undertemperature/warn_dC", 389}});
  refuses({{"/limits/charge_undertemperature/limit_dC", 390}, {"/limits/charge_undertemperature/warn_dC", 390}},
          "/limits/charge_undertemperature/warn_dC",
          "found 390, expected less than 390, which is warn_dC of charge_overtemperature less both hystereses");
  const Json board = limit(R"({"warn_dC":-309,"open_dC":-200,"hysteresis_dC":20,"confirm_ms":100,"clear_ms":1000})");
  accepts({{"/limits/board_overtemperature", board}});
  refuses({{"/limits/board_overtemperature", board}, {"/limits/board_overtemperature/warn_dC", -310}},
          "/limits/board_overtemperature/warn_dC",
          "found -310, expected more than -310, which is warn_dC of board_undertemperature and both hystereses");
  accepts({{"/auxiliary", limit(R"({"fan_on_dC":300,"fan_off_dC":251,"heater_on_dC":200,"heater_off_dC":250})")}});
  refuses({{"/auxiliary", limit(R"({"fan_on_dC":300,"fan_off_dC":250,"heater_on_dC":200,"heater_off_dC":250})")}},
          "/auxiliary/fan_off_dC", "found 250, expected more than heater_off_dC, 250");
}

TEST_CASE("a difference that opens is less than what it is a difference of", "[unit][config][F79]") {
  // 48 cells of 4.23 V.
  accepts({{"/limits/pack_voltage_mismatch/open_mV", 20'304}});
  refuses({{"/limits/pack_voltage_mismatch/open_mV", 20'305}}, "/limits/pack_voltage_mismatch/open_mV",
          "found 20305, expected at most 20304, a tenth of the full pack");
  const Json module =
      Json::parse(R"({"warn_mV":100,"open_mV":5076,"hysteresis_mV":50,"confirm_ms":100,"clear_ms":1000})");
  accepts({{"/limits/module_voltage_mismatch", module}});
  refuses({{"/limits/module_voltage_mismatch", module}, {"/limits/module_voltage_mismatch/open_mV", 5'077}},
          "/limits/module_voltage_mismatch/open_mV", "at most 5076, a tenth of the smallest module when it is full");
  refuses({{"/limits/module_voltage_mismatch", module},
           {"/modules/1", {{"node", 9}, {"cells", 2}, {"temperature_sensors", 0}}}},
          "/limits/module_voltage_mismatch/open_mV", "at most 846");
  accepts({{"/limits/cell_imbalance/open_mV", 1'429}});
  refuses({{"/limits/cell_imbalance/open_mV", 1'430}}, "/limits/cell_imbalance/open_mV",
          "found 1430, expected at most 1429, less than the distance from cell_undervoltage to cell_overvoltage");
  const Json spread =
      Json::parse(R"({"warn_dC":100,"open_dC":679,"hysteresis_dC":20,"confirm_ms":100,"clear_ms":1000})");
  accepts({{"/limits/temperature_spread", spread}});
  refuses({{"/limits/temperature_spread", spread}, {"/limits/temperature_spread/open_dC", 680}},
          "/limits/temperature_spread/open_dC", "at most 679, less than the distance from cell_undertemperature");
}

TEST_CASE("limits the wrong way round are told of where they stand, not in what follows from them", "[unit][config]") {
  const Json spread =
      Json::parse(R"({"warn_dC":100,"open_dC":200,"hysteresis_dC":20,"confirm_ms":100,"clear_ms":1000})");
  const std::vector<Change> wrong_ways_round[] = {
      {{"/limits/cell_undervoltage/open_mV", 4'300}},
      {{"/limits/cell_undertemperature/open_dC", 900}, {"/limits/temperature_spread", spread}},
  };
  for (const std::vector<Change>& changes : wrong_ways_round) {
    const ConfigProblems problems = problems_of(changed(changes).dump());
    INFO(all_text(problems));
    CHECK_FALSE(problems.empty());
    for (const ConfigProblem& problem : problems) {
      CHECK(problem.path.find("cell_imbalance") == std::string::npos);
      CHECK(problem.path.find("temperature_spread") == std::string::npos);
    }
  }
}

TEST_CASE("a pack whose file leaves a difference to its default is not blamed for it", "[unit][config]") {
  // A tenth of one cell of 2.5 V would be less than the 300 mV of module_voltage_mismatch.
  accepts({{"/modules/1", {{"node", 9}, {"cells", 1}, {"temperature_sensors", 0}}},
           {"/limits/cell_undervoltage/warn_mV", 2'600},
           {"/limits/cell_undervoltage/open_mV", 2'500},
           {"/limits/cell_overvoltage/warn_mV", 2'900},
           {"/limits/cell_overvoltage/open_mV", 2'950},
           {"/limits/cell_imbalance/warn_mV", 100},
           {"/limits/cell_imbalance/limit_mV", 150},
           {"/limits/cell_imbalance/open_mV", 300}});
}

TEST_CASE("a limit between two current sensors wants two", "[unit][config]") {
  const Json apart =
      Json::parse(R"({"warn_mA":1000,"open_mA":2000,"hysteresis_mA":100,"confirm_ms":100,"clear_ms":1000})");
  accepts({{"/limits/current_sensors_disagree", apart}, {"/sensor/has_second_current", true}});
  refuses({{"/limits/current_sensors_disagree", apart}}, "/limits/current_sensors_disagree",
          "found a limit, expected nothing, as sensor/has_second_current is false");
}

TEST_CASE("every fault of the table with a confirm time of its own has a key for it", "[unit][config]") {
  std::size_t count = 0;
  for (const FaultRow& row : fault_table()) {
    if (row.confirm_time == nullptr) continue;
    ++count;
    CAPTURE(row.name);
    const auto parsed = parse(changed({{"/confirm", {{std::string(row.name) + "_ms", 13}}}}).dump());
    REQUIRE(parsed);
    CHECK(parsed->core.limits.confirm.*row.confirm_time == 13ms);
  }
  CHECK(count == confirm_fields().size());
  refuses({{"/confirm", {{"emergency_stop_ms", 0}}}}, "/confirm/emergency_stop_ms", "unknown key");
}

TEST_CASE("resistances and overloads have limits of the pack file's own, within what makes sense", "[unit][config]") {
  const auto limit = [](int warn, int open) {
    return Json{{"warn_permille", warn},
                {"open_permille", open},
                {"hysteresis_permille", 50},
                {"confirm_ms", 0},
                {"clear_ms", 1'000}};
  };
  const auto parsed = parse(
      changed({{"/limits/cell_resistance", limit(1'300, 1'600)}, {"/limits/charge_overload", limit(700, 950)}}).dump());
  REQUIRE(parsed);
  CHECK(parsed->core.limits.cell_resistance.open == 1'600);
  CHECK(parsed->core.limits.charge_overload.open == 950);
  CHECK(parsed->core.limits.charge_overload.confirm == 0ms);
  refuses({{"/limits/pack_resistance", limit(1'000, 1'600)}}, "/limits/pack_resistance/warn_permille", "from 1050");
  refuses({{"/limits/discharge_overload", limit(800, 1'001)}}, "/limits/discharge_overload/open_permille", "to 1000");
  refuses({{"/limits/discharge_overload", limit(800, 900)}}, "/limits/discharge_overload/open_permille",
          "found 900, expected more than 900");
}

TEST_CASE("a limit of current may take from the allowed current before it opens", "[unit][config][BMU_13]") {
  const auto parsed = parse(changed({{"/limits/discharge_overcurrent/limit_mA", 85'000}}).dump());
  REQUIRE(parsed);
  CHECK(parsed->core.limits.discharge_overcurrent.limit == 85'000);
  refuses({{"/limits/charge_overcurrent/limit_mA", 30'000}}, "/limits/charge_overcurrent/limit_mA",
          "from warn_mA, 25000, to before open_mA, 30000");
}

TEST_CASE("a value that stands still opens the pack within 10 s", "[unit][config][F12]") {
  const Json stuck =
      Json::parse(R"({"warn_ms":3000,"open_ms":8000,"hysteresis_ms":1,"confirm_ms":200,"clear_ms":1000})");
  accepts({{"/limits/stuck_values", stuck}});
  refuses({{"/limits/stuck_values", stuck}, {"/limits/stuck_values/open_ms", 8'001}}, "/limits/stuck_values/open_ms",
          "from 500 to 8000");
}

TEST_CASE("all contradictions are told at once", "[unit][config][F79]") {
  const ConfigProblems problems = problems_of(changed({{"/limits/pack_voltage_mismatch/open_mV", 100'000},
                                                       {"/limits/cell_imbalance/open_mV", 6'000},
                                                       {"/limits/charge_undertemperature/warn_dC", 450},
                                                       {"/limits/cell_overvoltage/warn_mV", 4'230}})
                                                  .dump());
  INFO(all_text(problems));
  CHECK(problems.size() == 4);
}

TEST_CASE("what a pack file leaves out follows from the cell and from the limits beside it", "[unit][config]") {
  Json given = valid_pack();
  given["limits"].erase("cell_imbalance");
  given["limits"].erase("charge_overtemperature");
  given["limits"].erase("charge_undertemperature");
  given["current"].erase("discharge_peak_mA");
  const auto pack = parse_pack_config(given.dump(), "pack.json", "");
  REQUIRE(pack.has_value());
  const LimitsConfig& limits = pack->core.limits;
  CHECK(limits.charge_overtemperature == limits.cell_overtemperature);
  CHECK(limits.charge_undertemperature.open == 0);  // below it, cells may be discharged, but not charged
  CHECK(limits.cell_deep_discharge.open == pack->core.cell.voltage_min_uV);
  CHECK(limits.cell_deep_discharge.warn < limits.cell_undervoltage.open);
  CHECK(limits.cell_imbalance.open == (limits.cell_overvoltage.open - limits.cell_undervoltage.open) / 2);
  CHECK(limits.insulation_low.open == 500 * 4'230 / 1'000 * 48);
  CHECK(limits.current_sensors_disagree == never_above);
  CHECK(pack->core.current.discharge_peak_mA == limits.discharge_overcurrent.warn);
  CHECK(pack->core.current.charge_peak_mA == limits.charge_overcurrent.warn);
}

TEST_CASE("the insulation limit is so many ohms for each volt of a full pack, and never below the absolute one",
          "[unit][config][BMU_5]") {
  constexpr std::int32_t full_V = 4'230 * 48 / 1'000;
  const auto limit_with = [](const Json& insulation) {
    Json pack = valid_pack();
    pack["insulation"] = insulation;
    const auto read = parse_pack_config(pack.dump(), "pack.json", "");
    REQUIRE(read.has_value());
    return read->core.limits.insulation_low;
  };
  Json insulation = valid_pack()["insulation"];
  insulation["open_Ohm_per_V"] = 100;
  insulation["warn_Ohm_per_V"] = 300;
  insulation["open_min_Ohm"] = 0;
  CHECK(limit_with(insulation).open / 100 == full_V);
  CHECK(limit_with(insulation).warn / 300 == full_V);
  insulation["open_min_Ohm"] = 100 * full_V + 1'000;
  CHECK(limit_with(insulation).open == 100 * full_V + 1'000);
  CHECK(limit_with(insulation).warn / 300 == full_V);
  // The warning threshold stays above the fault threshold.
  insulation["open_min_Ohm"] = 1'000'000;
  CHECK(limit_with(insulation).open == 1'000'000);
  CHECK(limit_with(insulation).warn == 1'100'000);
}

TEST_CASE("a section balancing that contradicts itself or the limits is refused", "[unit][config][balancing][MMU_3]") {
  const Json on = {{"enabled", true}};
  const auto with = [&on](const std::string& key, const Json& value) {
    Json section = on;
    section[key] = value;
    return std::vector<Change>{{"/balancing", section}};
  };
  accepts({{"/balancing", on}});
  accepts(with("voltage_min_mV", 3'001));
  refuses(with("voltage_min_mV", 3'000), "/balancing/voltage_min_mV",
          "found 3000, expected more than warn_mV of cell_undervoltage, 3000");
  accepts(with("voltage_min_mV", 4'199));
  refuses(with("voltage_min_mV", 4'200), "/limits/cell_overvoltage/warn_mV", "more than voltage_min_mV of balancing");
  refuses(with("method", "ocv2"), "/balancing/method", "terminal_voltage, ocv or charge");
  // A cell of 4.23 V and no more than 250 mA.
  accepts(with("bleed_resistance_Ohm", 17));
  refuses(with("bleed_resistance_Ohm", 16), "/balancing/bleed_resistance_Ohm", "at least 17");
  accepts(with("board_max_dC", 101));
  refuses(with("board_max_dC", 100), "/balancing/board_max_dC", "found 100, expected more than board_min_dC");
  Json by_terminals = on;
  by_terminals["method"] = "terminal_voltage";
  by_terminals["top_mV"] = 4'200;
  accepts({{"/balancing", by_terminals}});
  by_terminals["top_mV"] = 4'201;
  refuses({{"/balancing", by_terminals}}, "/limits/cell_overvoltage/warn_mV", "at least top_mV of balancing");
  by_terminals["top_mV"] = 4'100;
  by_terminals["voltage_min_mV"] = 4'100;
  refuses({{"/balancing", by_terminals}}, "/balancing/top_mV", "more than voltage_min_mV");
}

TEST_CASE("what balancing leaves out follows from the limits and the cell's curve", "[unit][config][balancing]") {
  const auto pack = parse_pack_config(changed({{"/balancing", {{"enabled", true}}}}).dump(), "pack.json", "");
  REQUIRE(pack.has_value());
  const BalancingConfig& balancing = pack->core.balancing;
  CHECK(balancing.is_enabled);
  CHECK(balancing.method == BalancingMethod::ocv);
  CHECK(balancing.requires_closed);
  CHECK_FALSE(balancing.without_board_sensor);
  CHECK(balancing.voltage_min_uV == 3'120'000);
  CHECK(balancing.top_uV > balancing.voltage_min_uV);
  CHECK(balancing.top_uV <= pack->core.limits.cell_overvoltage.warn);
  const auto silent = parse_pack_config(without("", "balancing").dump(), "pack.json", "");
  REQUIRE(silent.has_value());
  CHECK_FALSE(silent->core.balancing.is_enabled);
}

TEST_CASE("every module has a node number of its own", "[unit][config]") {
  refuses({{"/modules/0/nodes", {1, 2, 2}}}, "/modules/0/nodes/2", "taken by /modules/0/nodes/1");
  refuses({{"/modules/1", {{"node", 3}, {"cells", 2}, {"temperature_sensors", 0}}}}, "/modules/1/node",
          "a node number no other module has");
  refuses({{"/modules/0/nodes", {1, 64}}}, "/modules/0/nodes/1", "from 1 to 63");
  refuses({{"/modules/0/nodes", {0}}}, "/modules/0/nodes/0", "from 1 to 63");
  refuses({{"/modules/0/node", 9}}, "/modules/0", "either \"node\" or \"nodes\"");
  refuses({{"/modules/0/nodes", Json::array()}}, "/modules/0/nodes", "a list of node numbers");
  refuses({{"/modules", Json::array()}}, "/modules", "a list of modules");
}

TEST_CASE("a module's serial number is its own, one for each node", "[unit][config][BMS_F.2]") {
  Json pack = changed({{"/modules/0",
                        {{"nodes", {1, 2, 3}},
                         {"serial_numbers", {4711, nullptr, 4294967295U}},
                         {"cells", 12},
                         {"temperature_sensors", 4}}},
                       {"/modules/1", {{"node", 4}, {"serial_number", 0}, {"cells", 12}, {"temperature_sensors", 4}}}});
  const auto parsed = parse(pack.dump());
  REQUIRE(parsed);
  const auto& modules = parsed->core.modules;
  CHECK(modules[0].serial_number == 4711U);
  CHECK_FALSE(modules[1].serial_number.has_value());
  CHECK(modules[2].serial_number == 4294967295U);
  CHECK(modules[3].serial_number == 0U);
  const auto in = [&](const std::string& pointer, const Json& value) {
    return Change{"/modules", [&] {
                    Json list = pack["modules"];
                    list[Json::json_pointer(pointer)] = value;
                    return list;
                  }()};
  };
  refuses({in("/0/serial_numbers", {4711, 4712})}, "/modules/0/serial_numbers", "as many as \"nodes\" has, 3");
  refuses({in("/0/serial_numbers", 4711)}, "/modules/0/serial_numbers", "as many as \"nodes\" has, 3");
  refuses({in("/0/serial_numbers/1", -1)}, "/modules/0/serial_numbers/1", "from 0 to 4294967295");
  refuses({in("/0/serial_numbers/1", 4711)}, "/modules/0/nodes/1", "node 1 has it");
  refuses({in("/0/serial_number", 5)}, "/modules/0/serial_number", "\"serial_numbers\" beside \"nodes\"");
  refuses({in("/1/serial_number", 4711)}, "/modules/1/node", "one that no other module has; node 1 has it");
  refuses({in("/1/serial_numbers", {5})}, "/modules/1/serial_numbers", "\"serial_number\" beside \"node\"");
}

TEST_CASE("a fast pace is not slower, a parked one not faster, left out they follow", "[unit][config]") {
  accepts({{"/poll/fast_period_ms", 100}, {"/poll/parked_period_ms", 100}});
  refuses({{"/poll/fast_period_ms", 101}}, "/poll/fast_period_ms", "found 101, expected at most period_ms, 100");
  refuses({{"/poll/parked_period_ms", 99}}, "/poll/parked_period_ms", "found 99, expected at least period_ms, 100");
  refuses({{"/poll/parked_period_ms", 501}}, "/poll/parked_period_ms",
          "found 501, expected a whole number from 20 to 500");
  const auto pack = parse(valid_pack().dump());
  REQUIRE(pack);
  CHECK(pack->core.poll.fast_period == 50ms);
  CHECK(pack->core.poll.parked_period == 500ms);
  const auto large = load_pack_config(packs_directory / "traction-16x12.json");
  REQUIRE(large);
  CHECK(large->core.poll.period == 50ms);
  CHECK(large->core.poll.fast_period == 50ms);  // 16 modules with two single polls need nearly all of it
}

TEST_CASE("a board limit that the pack file names is the modules' own, too", "[unit][config][MMU_2]") {
  const auto left_out = parse(without("/limits", "board_overtemperature").dump());
  REQUIRE(left_out);
  CHECK_FALSE(left_out->core.module_board_limit_dC.has_value());
  const Json board{{"warn_dC", 758}, {"open_dC", 950}, {"hysteresis_dC", 50}, {"confirm_ms", 100}, {"clear_ms", 1'000}};
  const auto named = parse(changed({{"/limits/board_overtemperature", board}}).dump());
  REQUIRE(named);
  CHECK(named->core.module_board_limit_dC == 750);
}

TEST_CASE("a pack without any temperature sensor is refused", "[unit][config]") {
  refuses({{"/modules/0/temperature_sensors", 0}}, "/modules", "no temperature sensor");
}

TEST_CASE("the OCV table rises from 0 to 1000 permille", "[unit][config]") {
  refuses({{"/cell/ocv/0/0", 10}}, "/cell/ocv/0/0", "0 in the first pair");
  refuses({{"/cell/ocv/12/0", 999}}, "/cell/ocv/12/0", "1000 in the last pair");
  refuses({{"/cell/ocv/4/0", 100}}, "/cell/ocv/4/0", "more than in the pair before, 100");
  refuses({{"/cell/ocv/4/1", 3'430}}, "/cell/ocv/4/1", "more than in the pair before, 3430");
  refuses({{"/cell/ocv/4/1", 3'430.0005}}, "/cell/ocv/4/1", "microvolts");
  refuses({{"/cell/ocv", {{0, 3'000}}}}, "/cell/ocv", "found 1 pairs, expected a list of 2 to 64 pairs");
  accepts({{"/cell/ocv", {{0, 3'000}, {1'000, 4'100}}}});
  accepts({{"/cell/ocv/4/1", 3'430.001}});
}

TEST_CASE("what a cell does slowly, when cold, and after a turn may be left out, and is checked", "[unit][config]") {
  const auto read = parse(changed({{"/cell/slow_rc_resistance_mOhm", 0.7},
                                   {"/cell/slow_rc_time_constant_s", 31},
                                   {"/cell/resistance_activation_K", 2'500},
                                   {"/cell/hysteresis_mV", 12.5},
                                   {"/cell/hysteresis_charge_permille", 50},
                                   {"/cell/self_discharge_permille_per_month", 20}})
                              .dump());
  REQUIRE(read);
  const CellModel& cell = read->core.cell;
  CHECK(cell.slow_rc_resistance_Ohm == Approx(0.0007));
  CHECK(cell.slow_rc_time_constant_s == 31.0);
  CHECK(cell.resistance_activation_K == 2'500.0);
  CHECK(cell.hysteresis_V == Approx(0.0125));
  CHECK(cell.hysteresis_charge_permille == 50.0);
  CHECK(cell.self_discharge_permille_per_month == 20.0);
  refuses({{"/cell/slow_rc_time_constant_s", 30}}, "/cell/slow_rc_time_constant_s",
          "found 30, expected more than rc_time_constant_s, 30");
  accepts({{"/cell/slow_rc_time_constant_s", 30}, {"/cell/slow_rc_resistance_mOhm", 0}});
  refuses({{"/cell/hysteresis_mV", 200.1}}, "/cell/hysteresis_mV", "200");
  refuses({{"/cell/hysteresis_charge_permille", 0.9}}, "/cell/hysteresis_charge_permille", "1");
  refuses({{"/cell/resistance_activation_K", -1}}, "/cell/resistance_activation_K", "0");
}

TEST_CASE("the OCV table lies within the cell's absolute limits", "[unit][config][BMS_NF.1]") {
  accepts({{"/cell/ocv/12/1", 4'250}});
  refuses({{"/cell/ocv/12/1", 4'251}}, "/cell/ocv", "to voltage_max_mV, 4250");
  refuses({{"/cell/ocv/0/1", 2'499}}, "/cell/ocv", "from voltage_min_mV, 2500");
}

TEST_CASE("a cell's lower absolute limits lie below the upper ones", "[unit][config]") {
  refuses({{"/cell/temperature_min_dC", 600}}, "/cell/temperature_min_dC", "less than temperature_max_dC, 600");
}

TEST_CASE("the vehicle's nine identifiers stay within 11 bits and off the internal bus", "[unit][config]") {
  accepts({{"/vehicle/base_id", "6a0"}});
  accepts({{"/vehicle/base_id", "7F7"}});
  refuses({{"/vehicle/base_id", "7F8"}}, "/vehicle/base_id", "\"0\" to \"7F7\"");
  refuses({{"/vehicle/base_id", "0x620"}}, "/vehicle/base_id", "hexadecimal");
  refuses({{"/vehicle/base_id", "-1"}}, "/vehicle/base_id", "hexadecimal");
  refuses({{"/vehicle/base_id", 620}}, "/vehicle/base_id", "hexadecimal");
  accepts({{"/vehicle/base_id", "3C0"}});
  refuses({{"/vehicle/base_id", "3BF"}}, "/vehicle/base_id", "3BF is RESPONSE");
  accepts({{"/vehicle/base_id", "518"}});
  refuses({{"/vehicle/base_id", "519"}}, "/vehicle/base_id", "521 is SENSOR_CURRENT");
}

TEST_CASE("the vehicle's dialect, requests and second pack are read", "[unit][config][BMS_F.8]") {
  const auto pack = parse(changed({{"/vehicle/dialect", "elithion"},
                                   {"/vehicle/request_id", "745"},
                                   {"/vehicle/may_clear_faults", true},
                                   {"/second_pack", Json{{"base_id", "640"}, {"dialect", "original"}}},
                                   {"/buses/second_pack", "can7"}})
                              .dump());
  REQUIRE(pack);
  CHECK(pack->core.vehicle.dialect == VehicleDialect::elithion);
  CHECK(pack->core.vehicle.request_id == 0x745);
  CHECK(reply_id_of(pack->core.vehicle) == 0x74D);
  CHECK(pack->core.vehicle.may_clear_faults);
  CHECK(pack->core.second_pack.base_id == 0x640);
  CHECK(pack->core.second_pack.dialect == VehicleDialect::original);
  CHECK(pack->buses.name(Port::second_pack) == "can7");
  CHECK(pack->core.served_by[static_cast<std::size_t>(Port::second_pack)] == Port::second_pack);
  const auto plain = parse(changed({}).dump());
  REQUIRE(plain);
  CHECK(plain->core.vehicle.request_id == 0);
  CHECK(plain->core.second_pack.base_id == 0);
  CHECK(plain->buses.name(Port::second_pack) == plain->buses.vehicle);
  refuses({{"/vehicle/dialect", "klingon"}}, "/vehicle/dialect", "iha, original or elithion");
  refuses({{"/vehicle/request_id", "800"}}, "/vehicle/request_id", "7FF");
  refuses({{"/vehicle/request_id", "7x"}}, "/vehicle/request_id", "7FF");
  refuses({{"/second_pack", Json{{"base_id", "7F8"}}}}, "/second_pack/base_id", "7F7");
}

TEST_CASE("protocols that clash on one bus are refused with both names", "[unit][config][identifiers]") {
  const auto second = [](const char* id) { return Json{{"base_id", id}}; };
  accepts({{"/second_pack", second("629")}});
  refuses({{"/second_pack", second("628")}}, "/second_pack/base_id",
          "628 would be both the messages to the vehicle and the messages of the second pack");
  accepts({{"/second_pack", second("617")}});
  refuses({{"/second_pack", second("618")}}, "/second_pack/base_id", "620 would be both");
  // On another bus only the identifiers of the internal bus remain reserved.
  accepts({{"/second_pack", second("620")}, {"/buses/second_pack", "can7"}});
  refuses({{"/second_pack", second("340")}, {"/buses/second_pack", "can7"}}, "/second_pack/base_id", "340 is COMMAND");
  accepts({{"/vehicle/request_id", "745"}});
  refuses({{"/vehicle/request_id", "625"}}, "/vehicle/request_id",
          "625 would be both the messages to the vehicle and requests for data");
  refuses({{"/vehicle/request_id", "618"}}, "/vehicle/reply_id", "620 would be both");
  accepts({{"/vehicle/request_id", "618"}, {"/vehicle/reply_id", "619"}});
  refuses({{"/vehicle/request_id", "745"}, {"/vehicle/reply_id", "745"}}, "/vehicle/reply_id",
          "745 would be both requests for data and answers to requests");
  refuses({{"/vehicle/request_id", "040"}}, "/vehicle/request_id", "040 is CONTACTOR_COMMAND");
  refuses({{"/vehicle/request_id", "745"}, {"/second_pack", second("73D")}}, "/second_pack/base_id",
          "745 would be both requests for data and the messages of the second pack");
}

TEST_CASE("cell data has identifiers of its own, and a period that its frames fit into",
          "[unit][config][identifiers][VEH_1]") {
  const auto plain = parse(changed({}).dump());
  REQUIRE(plain);
  CHECK(plain->core.vehicle.cell_voltages_id == 0);
  CHECK(plain->core.vehicle.cell_temperatures_id == 0);
  const std::vector<Change> both{{"/vehicle/cell_voltages_id", "650"}, {"/vehicle/cell_temperatures_id", "651"}};
  const auto with_both = [&both](const Change& other) {
    std::vector<Change> changes = both;
    changes.push_back(other);
    return changes;
  };
  const auto pack = parse(changed(both).dump());
  REQUIRE(pack);
  CHECK(pack->core.vehicle.cell_voltages_id == 0x650);
  CHECK(pack->core.vehicle.cell_temperatures_id == 0x651);
  CHECK(pack->core.vehicle.cell_data_period == 1s);
  refuses({{"/vehicle/cell_voltages_id", "625"}}, "/vehicle/cell_voltages_id",
          "625 would be both the messages to the vehicle and the cell voltages");
  refuses({{"/vehicle/cell_temperatures_id", "145"}}, "/vehicle/cell_temperatures_id", "145 is CELLS_1");
  refuses({{"/vehicle/cell_voltages_id", "650"}, {"/vehicle/cell_temperatures_id", "650"}},
          "/vehicle/cell_temperatures_id", "650 would be both the cell voltages and the cell temperatures");
  refuses(with_both({"/vehicle/request_id", "650"}), "/vehicle/cell_voltages_id",
          "650 would be both requests for data and the cell voltages");
  refuses({{"/vehicle/cell_voltages_id", "800"}}, "/vehicle/cell_voltages_id", "7FF");
  // 48 cells and 16 sensors: 16 and 6 frames.
  CHECK(cell_data_blocks(pack->core).count() == 22);
  accepts(with_both({"/vehicle/cell_data_period_ms", 220}));
  refuses(with_both({"/vehicle/cell_data_period_ms", 219}), "/vehicle/cell_data_period_ms",
          "at least 220, as a round has 22 frames");
}

TEST_CASE("cell data counts with the load of the vehicle's bus", "[unit][config][VEH_1]") {
  const auto load_permille = [](const std::vector<Change>& changes) {
    std::vector<Change> all = changes;
    all.push_back({"/buses/vehicle", "can1"});
    const auto pack = parse(changed(all).dump());
    REQUIRE(pack);
    return guest_load_permille(pack->core, Port::vehicle, 125);
  };
  const std::int64_t without = load_permille({});
  const std::int64_t with_data = load_permille({{"/vehicle/cell_voltages_id", "650"},
                                                {"/vehicle/cell_temperatures_id", "651"},
                                                {"/vehicle/cell_data_period_ms", 220}});
  // A hundred frames a second of 8 bytes, each 135 bits at worst: 10.8 %.
  CHECK(with_data - without >= 107);
  CHECK(with_data - without <= 110);
}

TEST_CASE("a bus that the cyclic cell data fill is warned of, and one that they overfill is refused",
          "[unit][config][VEH_1]") {
  const auto pack_with = [](const std::vector<Change>& changes) {
    std::vector<Change> all = changes;
    all.push_back({"/buses/vehicle", "can1"});
    const auto parsed = parse(changed(all).dump());
    REQUIRE(parsed);
    return *parsed;
  };
  PackConfig without = pack_with({});
  PackConfig with_data = pack_with({{"/vehicle/cell_voltages_id", "650"},
                                    {"/vehicle/cell_temperatures_id", "651"},
                                    {"/vehicle/cell_data_period_ms", 220}});
  // Slower than a pack file permits: at the lowest permitted bit rate, 125 kbit/s, the cell data alone take 11 % at
  // most.
  const auto problems_at = [](PackConfig& pack, std::int32_t rate_kbit_per_s) {
    pack.interfaces.vehicle_kbit_per_s = rate_kbit_per_s;
    ProblemList problems;
    check_own_buses(pack, Place{"pack.json", ""}, problems);
    return problems.take();
  };
  constexpr std::int32_t filled_kbit_per_s = 20;
  CHECK(problems_at(without, filled_kbit_per_s).empty());
  CHECK(bus_warnings(without, "pack.json").empty());
  CHECK(problems_at(with_data, filled_kbit_per_s).empty());
  const ConfigProblems warnings = bus_warnings(with_data, "pack.json");
  REQUIRE(warnings.size() == 1);
  CHECK(warnings[0].path == "/interfaces/vehicle_kbit_per_s");
  CHECK(warnings[0].found == "20, at which can1 is filled to up to 74 %");

  constexpr std::int32_t overfilled_kbit_per_s = 14;
  CHECK(problems_at(without, overfilled_kbit_per_s).empty());
  const ConfigProblems problems = problems_at(with_data, overfilled_kbit_per_s);
  REQUIRE(problems.size() == 1);
  CHECK(problems[0].path == "/interfaces/vehicle_kbit_per_s");
  CHECK(problems[0].found == "14, at which can1 is filled to up to 105 %");
}

TEST_CASE("a charger is asked for what it can do, and for what the cells may have", "[unit][config][charger][BMU_11]") {
  const auto charger = [](const Json& more) {
    Json all{{"protocol", "elcon_tc"}};
    all.update(more);
    return std::vector<Change>{{"/charger", all}};
  };
  accepts(charger(Json::object()));
  const auto pack = parse(changed(charger(Json::object())).dump());
  REQUIRE(pack);
  const ChargerConfig& read = pack->core.charger;
  REQUIRE(read.driver != nullptr);
  CHECK(read.driver->name == "elcon_tc");
  CHECK(read.cell_full_uV == 4'180'000);  // end of the curve; the warning is at 4.20 V
  CHECK(read.voltage_max_mV == 201'600);  // 48 cells at the warning, which is less than half a percent above
  CHECK(read.current_max_mA == pack->core.current.charge_continuous_mA);
  CHECK(read.end_current_mA == 1'500);      // 30 Ah in 20 hours
  CHECK(read.balance_window_uV == 13'000);  // the dead band of 5 mV and twice the hysteresis of 4 mV
  refuses(charger({{"protocol", "elcon"}}), "/charger/protocol", "brusa_nlg5 or elcon_tc");
  accepts(charger({{"units", 4}}));
  refuses(charger({{"units", 5}}), "/charger/units", "4");
  refuses(charger({{"protocol", "brusa_nlg5"}, {"units", 2}}), "/charger/units", "at most 1: brusa_nlg5");
  accepts(charger({{"cell_full_mV", 4'199}}));
  refuses(charger({{"cell_full_mV", 4'200}}), "/charger/cell_full_mV", "less than that of cell_overvoltage, 4200");
  refuses(charger({{"cell_full_mV", 3'000}}), "/charger/cell_full_mV", "more than the warning of cell_undervoltage");
  refuses(charger({{"cell_full_mV", 3'600}}), "/charger/cell_full_mV", "half full");
  accepts(charger({{"end_current_mA", 10'000}}));
  refuses(charger({{"end_current_mA", 10'001}}), "/charger/end_current_mA", "at most half");
  refuses(charger({{"voltage_max_mV", 200'639}}), "/charger/voltage_max_mV", "at least 200640");
  accepts(charger({{"voltage_max_mV", 200'640}}));
  accepts(charger({{"current_max_mA", 1'000}}));  // the end current is lower then
  accepts(charger({{"voltage_max_mV", 203'040}}));
  refuses(charger({{"voltage_max_mV", 203'041}}), "/charger/voltage_max_mV", "at most 203040");
  accepts(charger({{"resume_below_permille", 900}, {"opens_when_full", false}}));
  refuses(charger({{"resume_below_permille", 900}}), "/charger/resume_below_permille", "opens_when_full");
  accepts(charger({{"protocol", "brusa_nlg5"}, {"requests_mains", true}}));
  refuses(charger({{"requests_mains", true}}), "/charger/requests_mains", "elcon_tc does not support it");
  refuses(charger({{"protocol", ""}, {"requests_mains", true}}), "/charger/requests_mains", "no protocol is named");
  accepts(charger({{"master_address", "F5"}}));
  accepts(charger({{"protocol", "brusa_nlg5"}, {"master_address", "F4"}}));
  refuses(charger({{"master_address", "F6"}}), "/charger/master_address", "F5");
  refuses(charger({{"protocol", "brusa_nlg5"}, {"master_address", "F5"}}), "/charger/master_address",
          "brusa_nlg5 has no such address");
  refuses(charger({{"protocol", ""}, {"master_address", "F5"}}), "/charger/master_address", "no protocol is named");
}

TEST_CASE("a window of full cells that balancing cannot reach is warned of", "[unit][config]") {
  const auto warnings_with = [](const Json& charger, const std::vector<Change>& more = {}) {
    std::vector<Change> changes{{"/charger", charger}};
    changes.insert(changes.end(), more.begin(), more.end());
    const auto pack = parse(changed(changes).dump());
    REQUIRE(pack);
    return pack_warnings(*pack, "pack.json");
  };
  const auto elcon = [](int window_mV) { return Json{{"protocol", "elcon_tc"}, {"balance_window_mV", window_mV}}; };
  const ConfigProblems warnings = warnings_with(elcon(12));
  REQUIRE(warnings.size() == 1);
  CHECK(to_text(warnings[0]) ==
        "pack.json: /charger/balance_window_mV: found 12, expected at least 13, which balancing leaves: "
        "balancing/dead_band_mV, 5, and twice the cell's hysteresis_mV");
  CHECK(warnings_with(elcon(13)).empty());
  CHECK(warnings_with(elcon(0)).empty());  // the width that balancing leaves
  CHECK(warnings_with(elcon(0), {{"/balancing/dead_band_mV", 50}}).empty());
  CHECK(warnings_with(elcon(13), {{"/balancing/dead_band_mV", 6}}).size() == 1);
  // Balancing disabled or not based on voltages, or no charger.
  CHECK(warnings_with(elcon(1), {{"/balancing/enabled", false}}).empty());
  CHECK(warnings_with(elcon(1), {{"/balancing/method", "charge"}}).empty());
  CHECK(warnings_with(Json{{"balance_window_mV", 1}}).empty());
}

TEST_CASE("a charger's identifiers clash with others on its bus only, and are named", "[unit][config][identifiers]") {
  const Json brusa{{"protocol", "brusa_nlg5"}};
  accepts({{"/charger", brusa}});
  refuses({{"/charger", brusa}, {"/vehicle/base_id", "612"}}, "/charger/protocol", "Brusa NLG5 charger");
  accepts({{"/charger", brusa}, {"/vehicle/base_id", "612"}, {"/buses/charger", "can7"}});
  // 29-bit identifiers never equal 11-bit ones.
  accepts({{"/charger", Json{{"protocol", "elcon_tc"}}}, {"/vehicle/base_id", "0F0"}});
}

TEST_CASE("what was apart in the file clashes when the command line joins the buses", "[unit][config][identifiers]") {
  auto pack = parse(changed({{"/second_pack", Json{{"base_id", "620"}}}, {"/buses/second_pack", "can7"}}).dump());
  REQUIRE(pack);
  CHECK(bus_clashes(*pack).empty());
  BusNames names = pack->buses;
  names.second_pack = names.vehicle;
  set_buses(*pack, names);
  const ConfigProblems clashes = bus_clashes(*pack);
  REQUIRE(clashes.size() == 1);
  CHECK(clashes[0].path == "/second_pack/base_id");
  CHECK(clashes[0].wanted.find("620 would be both") != std::string::npos);
}

}  // namespace
}  // namespace bmu

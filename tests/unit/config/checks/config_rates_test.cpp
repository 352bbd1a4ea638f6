// Poll rates, maximum ages of answers and the resulting bus load: rejected values and warnings.
#include <string>
#include <vector>

#include "config/checks/bus_checks.hpp"
#include "config/fields/pack_fields.hpp"
#include "config/pack_config.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/changed_pack.hpp"

namespace bmu {
namespace {

TEST_CASE("ages leave room for one lost answer and for safety's reaction", "[unit][config][FS_1][BMS_F.3]") {
  accepts({{"/ages/module_status_ms", 250}});
  refuses({{"/ages/module_status_ms", 249}}, "/ages/module_status_ms", "at least 250: twice the poll period");
  accepts({{"/ages/module_status_ms", 290}});
  refuses({{"/ages/module_status_ms", 291}}, "/ages/module_status_ms", "opens the pack within 300 ms");
  refuses({{"/ages/cell_voltage_ms", 291}}, "/ages/cell_voltage_ms", "from 50 to 290");
  accepts({{"/ages/pdu_status_ms", 150}});
  refuses({{"/ages/pdu_status_ms", 149}}, "/ages/pdu_status_ms", "at least 150");
  accepts({{"/ages/pdu_status_ms", 290}});
  refuses({{"/ages/pdu_status_ms", 291}}, "/ages/pdu_status_ms", "within 300 ms");
  refuses({{"/ages/pack_current_ms", 89}}, "/ages/pack_current_ms", "at least 90");
  refuses({{"/ages/pack_current_ms", 291}}, "/ages/pack_current_ms", "within 300 ms");
  refuses({{"/ages/pack_voltage_ms", 169}}, "/ages/pack_voltage_ms", "at least 170");
}

Json modules_of_12(int count) {
  Json nodes = Json::array();
  for (int node = 1; node <= count; ++node) nodes.push_back(node);
  return Json::array({{{"nodes", nodes}, {"cells", 12}, {"temperature_sensors", 4}}});
}

std::vector<Change> large(int modules, int rate_kbit_per_s, int age_ms) {
  return {{"/modules", modules_of_12(modules)},
          {"/buses/internal_kbit_per_s", rate_kbit_per_s},
          {"/ages/cell_voltage_ms", age_ms},
          {"/contactors/precharge_resistance_Ohm", 0},
          {"/contactors/precharge_energy_J", 0},
          {"/contactors/precharge_overcurrent_mA", 0},
          {"/limits/cell_undervoltage/confirm_ms", 100},
          {"/limits/cell_overvoltage/confirm_ms", 100}};
}

TEST_CASE("a cycle that does not fit between two polls is refused, with what would do", "[unit][config][BMS_F.2]") {
  // 35 modules take 89.2 ms, and 94.6 with two single polls; 38 take 96.5 and 102.4.
  std::vector<Change> tight = large(35, 500, 290);
  tight.push_back({"/poll/period_ms", 94});
  refuses(tight, "/poll/period_ms", "at least 95 at 500 kbit/s, or buses/internal_kbit_per_s 1000");
  tight.back() = {"/poll/period_ms", 95};
  accepts(tight);
  tight.back() = {"/poll/period_ms", 96};
  accepts(tight);
  refuses(
      large(38, 500, 290), "/poll/period_ms",
      "at least 103 at 500 kbit/s, or buses/internal_kbit_per_s 1000: all answers of 38 modules take up to 97 ms at "
      "500 kbit/s, with single polls of modules up to 103 ms");
  refuses(large(63, 500, 290), "/poll/period_ms", "buses/internal_kbit_per_s 1000: all answers of 63 modules take up");
  refuses(large(8, 125, 290), "/poll/period_ms", "at least 113 at 125 kbit/s, or buses/internal_kbit_per_s 250");
  refuses({{"/buses/internal_kbit_per_s", 124}}, "/buses/internal_kbit_per_s", "from 125 to 1000");
  refuses({{"/buses/internal_kbit_per_s", 1001}}, "/buses/internal_kbit_per_s", "from 125 to 1000");
}

TEST_CASE("a fast pace whose answers do not fit is refused, with what would do", "[unit][config][BMS_F.2]") {
  // 16 modules take 42.5 ms at 500 kbit/s, 47.9 with two single polls.
  const auto with_fast = [](int fast_ms, int rate_kbit_per_s) {
    std::vector<Change> changes = large(16, rate_kbit_per_s, 290);
    changes.push_back({"/poll/fast_period_ms", fast_ms});
    return changes;
  };
  refuses(with_fast(47, 500), "/poll/fast_period_ms",
          "at least 48 at 500 kbit/s, or buses/internal_kbit_per_s 1000: all answers of 16 modules take up to 43 ms at "
          "500 kbit/s, with single polls of modules up to 48 ms");
  accepts(with_fast(48, 500));
  accepts(with_fast(49, 500));
  accepts(with_fast(47, 1'000));
  // If the normal period is too short for the answers, both keys are reported, each with its own remedy.
  std::vector<Change> both = large(38, 500, 290);
  both.push_back({"/poll/fast_period_ms", 60});
  const auto parsed = parse(changed(both).dump());
  REQUIRE_FALSE(parsed);
  REQUIRE(parsed.error().size() >= 2);
  CHECK(parsed.error()[0].path == "/poll/period_ms");
  CHECK(parsed.error()[1].path == "/poll/fast_period_ms");
  CHECK(parsed.error()[1].wanted.find("buses/internal_kbit_per_s 1000: ") == 0);
}

TEST_CASE("a parked pace is held against the bus, too", "[unit][config][BMS_F.2]") {
  std::vector<Change> changes = large(38, 500, 290);
  for (const int parked_ms : {102, 103}) {
    changes.push_back({"/poll/parked_period_ms", parked_ms});
    const auto parsed = parse(changed(changes).dump());
    REQUIRE_FALSE(parsed);
    const bool is_named = std::any_of(parsed.error().begin(), parsed.error().end(), [](const ConfigProblem& problem) {
      return problem.path == "/poll/parked_period_ms" && problem.wanted.find("at least 103 at 500 kbit/s") == 0;
    });
    CHECK(is_named == (parked_ms < 103));
  }
}

TEST_CASE("a fast pace that is left out fits, and leaves room on the bus", "[unit][config][BMS_F.2]") {
  const auto fast_of = [](int modules, int rate_kbit_per_s) {
    const auto parsed = parse(changed(large(modules, rate_kbit_per_s, 290)).dump());
    REQUIRE(parsed);
    CHECK(parsed->poll_in_file.fast_period == 0ms);
    CHECK(bus_warnings(*parsed, "pack.json").empty());
    return parsed->core.poll.fast_period;
  };
  CHECK(fast_of(4, 500) == 50ms);
  CHECK(fast_of(16, 500) == 50ms);  // 47.9 ms
  CHECK(fast_of(16, 1'000) == 50ms);
  CHECK(fast_of(20, 500) == 60ms);   // 58.2 ms
  CHECK(fast_of(30, 500) == 100ms);  // 82.7 ms, but below 97 the load is more than 70 %
}

TEST_CASE("an age must have room for a lost answer and the longest cycle", "[unit][config][BMS_F.2]") {
  accepts(large(19, 500, 250));  // 49.8 ms
  refuses(large(20, 500, 252), "/ages/cell_voltage_ms",
          "at least 253: twice the poll period and 53 ms, which all answers may take");
  accepts(large(20, 500, 253));
  accepts(large(63, 1'000, 280));  // 79.6 ms
  // Sensor results wait for the answers; the PDU status has a higher priority.
  std::vector<Change> changes = large(20, 500, 253);
  changes.push_back({"/ages/pack_current_ms", 92});
  refuses(changes, "/ages/pack_current_ms", "at least 93");
  changes.back() = {"/ages/pdu_status_ms", 150};
  accepts(changes);
}

TEST_CASE("a bus that is in use for more than 70 % of the time is warned of", "[unit][config][BMS_F.2]") {
  const auto warnings_of = [](const std::vector<Change>& changes) {
    const auto parsed = parse(changed(changes).dump());
    REQUIRE(parsed);
    return bus_warnings(*parsed, "pack.json");
  };
  CHECK(warnings_of({}).empty());
  CHECK(warnings_of(large(30, 500, 280)).empty());  // 68.5 %, the messages to the vehicle included
  CHECK(warnings_of(large(16, 250, 290)).size() == 1);
  const ConfigProblems warnings = warnings_of(large(32, 500, 290));
  REQUIRE(warnings.size() == 1);
  CHECK(to_text(warnings[0]) ==
        "pack.json: /poll/period_ms: found 100, which fills the internal bus to up to 73 %, expected at least 105 at "
        "500 kbit/s, or buses/internal_kbit_per_s 1000, for at most 70 %");
}

TEST_CASE("who else is on the modules' bus counts for its load", "[unit][config][BMS_F.2]") {
  std::vector<Change> changes = large(30, 500, 280);
  changes.push_back({"/sensor", Json{{"has_second_current", true}, {"second_protocol", "lem_cab"}}});
  const auto parsed = parse(changed(changes).dump());
  REQUIRE(parsed);
  const ConfigProblems warnings = bus_warnings(*parsed, "pack.json");
  REQUIRE(warnings.size() == 1);
  CHECK(warnings[0].path == "/poll/period_ms");
  CHECK(warnings[0].found.find("up to 72 %") != std::string::npos);
}

TEST_CASE("a bus without modules is refused if what is on it does not fit, and warned of above 70 %",
          "[unit][config][BMS_F.2]") {
  // A LEM CAB sends 100 frames of 135 bits per second, the daemon nine: 14.6 kbit/s. The CAB supports 500 kbit/s only,
  // and a file with less is rejected for that reason (device_rates_test.cpp).
  const auto parsed = parse(
      changed({{"/buses/internal", "can0"},
               {"/buses/vehicle", "can1"},
               {"/sensor", Json{{"has_second_current", true}, {"second_protocol", "lem_cab"}, {"bus", "vehicle"}}}})
          .dump());
  REQUIRE(parsed);
  PackConfig pack = *parsed;
  const auto problems_at = [&pack](int kbit_per_s) {
    pack.interfaces.vehicle_kbit_per_s = kbit_per_s;
    ProblemList problems;
    check_own_buses(pack, Place{"pack.json", ""}, problems);
    return problems.take();
  };
  const ConfigProblems problems = problems_at(14);
  REQUIRE(problems.size() == 1);
  CHECK(to_text(problems[0]) ==
        "pack.json: /interfaces/vehicle_kbit_per_s: found 14, at which can1 is filled to up to 105 %, expected at "
        "least 125, or fewer on that bus, for at most 70 %");
  CHECK(problems_at(20).empty());
  const ConfigProblems warnings = bus_warnings(pack, "pack.json");
  REQUIRE(warnings.size() == 1);
  CHECK(warnings[0].path == "/interfaces/vehicle_kbit_per_s");
  CHECK(warnings[0].found == "20, at which can1 is filled to up to 74 %");
  pack.interfaces.vehicle_kbit_per_s = 22;
  CHECK(bus_warnings(pack, "pack.json").empty());
}

TEST_CASE("a fast pace that fills the bus is warned of by its own key", "[unit][config][BMS_F.2]") {
  const auto warnings_at = [](int fast_ms) {
    std::vector<Change> changes = large(30, 500, 290);
    changes.push_back({"/poll/fast_period_ms", fast_ms});
    const auto parsed = parse(changed(changes).dump());
    REQUIRE(parsed);
    return bus_warnings(*parsed, "pack.json");
  };
  const ConfigProblems warnings = warnings_at(90);
  REQUIRE(warnings.size() == 1);
  CHECK(warnings[0].path == "/poll/fast_period_ms");
  const std::string wanted = warnings[0].wanted;
  REQUIRE(wanted.find("at least ") == 0);
  const int least_ms = std::stoi(wanted.substr(9));
  CHECK(warnings_at(least_ms - 1).size() == 1);
  CHECK(warnings_at(least_ms).empty());
  CHECK(warnings_at(100).empty());
  CHECK(to_text(warnings[0]) ==
        "pack.json: /poll/fast_period_ms: found 90, which fills the internal bus to up to 74 %, expected at least " +
            std::to_string(least_ms) + " at 500 kbit/s, or buses/internal_kbit_per_s 1000, for at most 70 %");
  CHECK(least_ms == 97);
}

TEST_CASE("no shipped pack is warned of", "[unit][config]") {
  for (const auto& file : std::filesystem::directory_iterator(packs_directory)) {
    if (file.path().extension() != ".json") continue;
    const auto pack = load_pack_config(file.path());
    INFO(file.path().string());
    REQUIRE(pack);
    CHECK(bus_warnings(*pack, "pack.json").empty());
  }
}

TEST_CASE("ages of temperatures follow how often they are asked for", "[unit][config][FS_1]") {
  refuses({{"/poll/temperature_every", 2}}, "/ages/temperature_ms", "at least 450");
  accepts({{"/poll/temperature_every", 2},
           {"/ages/temperature_ms", 450},
           {"/limits/cell_overtemperature/confirm_ms", 240},
           {"/limits/charge_overtemperature/confirm_ms", 90},
           {"/limits/charge_undertemperature/confirm_ms", 90},
           {"/limits/cell_undertemperature/confirm_ms", 90}});
  // With every third poll a sample arrives every 300 ms: no maximum age both tolerates that and lets a low temperature
  // open within 950 ms.
  refuses(
      {{"/poll/temperature_every", 3}, {"/ages/temperature_ms", 650}, {"/limits/cell_overtemperature/confirm_ms", 140}},
      "/ages/temperature_ms", "at most 500 where a sample comes every 300 ms");
}

TEST_CASE("a temperature that is no longer told opens the pack in time", "[unit][config][FS_1]") {
  CHECK(ConfirmTimes{}.temperature_not_measured == temperature_lost_confirm);
  refuses({{"/confirm", {{"temperature_not_measured_ms", 101}}}}, "/confirm/temperature_not_measured_ms", "0 to 100");
  accepts({{"/ages/temperature_ms", 590},
           {"/limits/cell_overtemperature/confirm_ms", 340},
           {"/limits/charge_overtemperature/confirm_ms", 190},
           {"/limits/charge_undertemperature/confirm_ms", 190},
           {"/limits/cell_undertemperature/confirm_ms", 190}});
  refuses({{"/ages/temperature_ms", 841}}, "/ages/temperature_ms", "from 50 to 840");
}

TEST_CASE("there are at most 63 modules", "[unit][config][BMS_F.2]") {
  accepts(large(63, 1'000, 280));
  refuses({{"/modules", modules_of_12(64)}}, "/modules", "found 64 modules, expected at most 63");
}

}  // namespace
}  // namespace bmu

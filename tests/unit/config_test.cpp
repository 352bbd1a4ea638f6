// The pack file: what is accepted, and that everything wrong with a file is said, where it is, in one go.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "config/bus_checks.hpp"
#include "config/pack_config.hpp"
#include "config/pack_fields.hpp"
#include "daemon/core/fault_table.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temporary_folder.hpp"

namespace bmu {
namespace {

using Json = nlohmann::json;

const std::filesystem::path packs_directory = std::filesystem::path(BMUD_SOURCE_DIR) / "config/packs";
const std::filesystem::path cells_directory = std::filesystem::path(BMUD_SOURCE_DIR) / "config/cells";

std::string bytes_of(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  REQUIRE(stream);
  std::ostringstream bytes;
  bytes << stream.rdbuf();
  return bytes.str();
}

/// The demonstration pack as a tree, its cell in place, so that a test can change any key of either.
Json valid_pack() {
  Json pack = Json::parse(bytes_of(packs_directory / "demo-48s.json"), nullptr, true, true);
  pack["cell"] = Json::parse(bytes_of(cells_directory / "nmc-30ah-10p.json"), nullptr, true, true);
  return pack;
}

Result<PackConfig, ConfigProblems> parse(const std::string& text) {
  return parse_pack_config(text, "pack.json", packs_directory);
}

ConfigProblems problems_of(const std::string& text) {
  const auto result = parse(text);
  return result ? ConfigProblems{} : result.error();
}

std::string all_text(const ConfigProblems& problems) {
  std::string text;
  for (const ConfigProblem& problem : problems) text += to_text(problem) + "\n";
  return text;
}

using Change = std::pair<std::string, Json>;  // JSON pointer, value

Json changed(const std::vector<Change>& changes) {
  Json pack = valid_pack();
  for (const auto& [pointer, value] : changes) pack[Json::json_pointer(pointer)] = value;
  return pack;
}

Json without(const std::string& parent, const std::string& key) {
  Json pack = valid_pack();
  pack[Json::json_pointer(parent)].erase(key);
  return pack;
}

void accepts(const std::vector<Change>& changes) {
  const ConfigProblems problems = problems_of(changed(changes).dump());
  INFO(all_text(problems));
  CHECK(problems.empty());
}

/// Exactly one problem, at this path, whose text holds these words.
void refuses_text(const std::string& text, const std::string& path, const std::string& words) {
  const ConfigProblems problems = problems_of(text);
  INFO(all_text(problems));
  REQUIRE(problems.size() == 1);
  CHECK(problems.front().path == path);
  CHECK(to_text(problems.front()).find(words) != std::string::npos);
}

void refuses(const std::vector<Change>& changes, const std::string& path, const std::string& words) {
  refuses_text(changed(changes).dump(), path, words);
}

// --- what is accepted -----------------------------------------------------------------------------------------------

TEST_CASE("every pack that is shipped loads", "[unit][config][BMS_NF.1][FS_8][RR_1]") {
  std::size_t count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(packs_directory)) {
    const auto pack = load_pack_config(entry.path());
    INFO((pack ? entry.path().string() : all_text(pack.error())));
    REQUIRE(pack);
    CHECK(cell_count(pack->core) >= 6);
    ++count;
  }
  CHECK(count == 6);
}

TEST_CASE("the pack that speeds are measured with loads", "[unit][config]") {
  const auto pack = load_pack_config(std::filesystem::path(BMUD_SOURCE_DIR) / "tests/bench/largest.json");
  INFO((pack ? "" : all_text(pack.error())));
  REQUIRE(pack);
  CHECK(cell_count(pack->core) == 756);
}

TEST_CASE("every cell that is shipped is complete and says where its numbers come from", "[unit][config][BMS_NF.1]") {
  for (const auto& entry : std::filesystem::directory_iterator(cells_directory)) {
    const Json cell = Json::parse(bytes_of(entry.path()), nullptr, true, true);
    CHECK(cell.at("origin").get<std::string>().find("measurement") != std::string::npos);
    // Only the cell's keys are of interest: the demonstration's limits need not suit it.
    for (const ConfigProblem& problem : problems_of(changed({{"/cell", cell}}).dump())) {
      INFO(to_text(problem));
      CHECK(problem.path.rfind("/cell", 0) != 0);
    }
  }
}

TEST_CASE("values arrive in the units of the core", "[unit][config]") {
  const auto loaded = load_pack_config(packs_directory / "demo-48s.json");
  REQUIRE(loaded);
  const PackConfig& pack = *loaded;
  CHECK(pack.name == "demo 48s");
  CHECK(pack.cell_name == "NMC 3.0 Ah, 10 parallel");
  CHECK(pack.buses.internal == "unix:demo");
  CHECK(pack.buses.vehicle == "unix:demo");
  REQUIRE(pack.core.modules.size() == 4);
  CHECK(pack.core.modules[2].node == 3);
  CHECK(pack.core.modules[2].cell_count == 12);
  CHECK(pack.core.modules[2].temperature_sensor_count == 4);
  CHECK(pack.core.limits.cell_overvoltage.open == 4'230'000);
  CHECK(pack.core.limits.cell_overvoltage.hysteresis == 20'000);
  CHECK(pack.core.limits.cell_overvoltage.confirm == 140ms);
  CHECK(pack.core.limits.cell_undertemperature.open == -100);
  CHECK(pack.core.limits.discharge_overcurrent.open == 90'000);
  CHECK(pack.core.limits.pack_voltage_mismatch.open == 4'000);
  CHECK(pack.core.current.discharge_continuous_mA == 60'000);
  CHECK(pack.core.cell.capacity_uAs == 30 * uAs_per_Ah);
  CHECK(std::abs(pack.core.cell.series_resistance_Ohm - 0.0019) < 1e-12);
  CHECK(pack.core.cell.voltage_max_uV == 4'250'000);
  REQUIRE(pack.core.cell.ocv.size() == 13);
  CHECK(pack.core.cell.ocv.back().soc_permille == 1'000);
  CHECK(pack.core.cell.ocv.back().ocv_uV == 4'180'000);
  CHECK(pack.core.vehicle.base_id == 0x620);
  CHECK(std::string(pack.core.vehicle.name.begin(), pack.core.vehicle.name.end()) == "BMUD    ");
}

TEST_CASE("optional sections fall back to the defaults of the core", "[unit][config]") {
  Json pack = valid_pack();
  for (const char* key : {"$schema", "ages", "poll", "sensor", "soc", "vehicle"}) pack.erase(key);
  pack["contactors"] = {{"precharge_min_ms", 100}};
  const auto parsed = parse(pack.dump());
  REQUIRE(parsed);
  CHECK(parsed->core.ages.temperature == AgeConfig{}.temperature);
  CHECK(parsed->core.poll.period == PollConfig{}.period);
  CHECK(parsed->core.contactors.precharge_timeout == ContactorConfig{}.precharge_timeout);
  CHECK(parsed->core.vehicle.version == VehicleConfig{}.version);
  CHECK_FALSE(parsed->core.sensor.invert_current);
}

TEST_CASE("a section may give some of its keys", "[unit][config]") {
  const auto parsed =
      parse(changed({{"/contactors", Json::parse(R"({"settle_ms": 80, "precharge_min_ms": 80})")}}).dump());
  REQUIRE(parsed);
  CHECK(parsed->core.contactors.settle == 80ms);
  CHECK(parsed->core.contactors.feedback_timeout == ContactorConfig{}.feedback_timeout);
}

TEST_CASE("modules may be listed one by one or several at once, in the order of their cells",
          "[unit][config][BMS_F.2]") {
  const auto parsed = parse(changed({{"/modules", Json::parse(R"([
      {"node": 7, "cells": 5, "temperature_sensors": 0},
      {"nodes": [2, 63], "cells": 12, "temperature_sensors": 4}])")}})
                                .dump());
  REQUIRE(parsed);
  REQUIRE(parsed->core.modules.size() == 3);
  CHECK(parsed->core.modules[0].node == 7);
  CHECK(parsed->core.modules[1].node == 2);
  CHECK(parsed->core.modules[2].node == 63);
  CHECK(cell_count(parsed->core) == 29);
}

TEST_CASE("a whole number may be written with a point or an exponent", "[unit][config]") {
  std::string text = changed({{"/poll/period_ms", 77}}).dump();
  text.replace(text.find("77"), 2, "1.0e2");
  const auto parsed = parse(text);
  REQUIRE(parsed);
  CHECK(parsed->core.poll.period == 100ms);
}

// --- one class of problem each --------------------------------------------------------------------------------------

TEST_CASE("text that is no JSON is refused as file:line:column", "[unit][config]") {
  refuses_text("{\n  \"name\": \"x\",\n  oops\n}", "", "pack.json:3:3: found a syntax error");
  refuses_text("", "", "pack.json:1:1: ");
  refuses_text("{\"name\": 1e999}", "", "number overflow");
  refuses_text("{\"name\": NaN}", "", "pack.json:1:10: ");
  refuses_text("{\"name\": \"\xFF\"}", "", "pack.json:1:11: ");
  refuses_text("{} {}", "", "pack.json:1:4: ");
  refuses_text("[]", "", "pack.json: found [], wanted an object");
}

TEST_CASE("the column is where the wrong word begins", "[unit][config]") {
  refuses_text("{\"name\": 28O0}", "", "pack.json:1:10: ");
  refuses_text("{\n  \"name\": \"x\"\n  \"buses\": 1}", "", "pack.json:3:3: ");
  refuses_text("{\n  \"name\": \"x\"\n", "", "pack.json:3:1: ");
}

TEST_CASE("nesting without end is refused, not followed", "[unit][config]") {
  refuses_text(std::string(100'000, '['), "/0/0/0/0/0/0/0/0/0/0/0/0/0/0/0/0", "16 levels");
}

TEST_CASE("a key given twice is refused with its path", "[unit][config]") {
  std::string text = valid_pack().dump();
  const std::string key = R"("settle_ms":)";
  text.insert(text.find(key), R"("settle_ms":50,)");
  refuses_text(text, "/contactors/settle_ms", "second time");
}

TEST_CASE("an unknown key is refused with a hint to the one that was meant", "[unit][config]") {
  refuses({{"/limits/cell_overvoltage/open_V", 4}}, "/limits/cell_overvoltage/open_V", "did you mean \"open_mV\"?");
  refuses({{"/modules/0/temperature_sensor", 4}}, "/modules/0/temperature_sensor", "\"temperature_sensors\"");
  refuses({{"/moduls", 1}}, "/moduls", "\"modules\"");
  refuses({{"/cell/capacity_mAh", 1}}, "/cell/capacity_mAh", "\"capacity_Ah\"");
  refuses({{"/sensor/zzzzzzzzzzzzzzzz", 1}}, "/sensor/zzzzzzzzzzzzzzzz", "one of little_endian, invert_current");
  refuses({{"/a~1b~0c", 1}}, "/a~1b~0c", "unknown key");
}

TEST_CASE("a missing required key is refused", "[unit][config]") {
  refuses_text(without("", "name").dump(), "/name", "found nothing");
  refuses_text(without("", "buses").dump(), "/buses", "required");
  refuses_text(without("", "cell").dump(), "/cell", "required");
  refuses_text(without("", "modules").dump(), "/modules", "required");
  refuses_text(without("", "limits").dump(), "/limits", "required");
  refuses_text(without("", "current").dump(), "/current", "required");
  refuses_text(without("/limits", "charge_overcurrent").dump(), "/limits/charge_overcurrent", "required");
  refuses_text(without("/limits/cell_overvoltage", "confirm_ms").dump(), "/limits/cell_overvoltage/confirm_ms",
               "required");
  refuses_text(without("/cell", "ocv").dump(), "/cell/ocv", "required");
}

TEST_CASE("a value of the wrong type is refused", "[unit][config]") {
  refuses({{"/name", 5}}, "/name", "found 5, wanted a text");
  refuses({{"/buses", "can0"}}, "/buses", "found \"can0\", wanted an object");
  refuses({{"/limits/cell_overvoltage", 4'200}}, "/limits/cell_overvoltage", "an object");
  refuses({{"/poll/period_ms", "100"}}, "/poll/period_ms", "found \"100\", wanted a whole number from 20 to 120");
  refuses({{"/poll/period_ms", nullptr}}, "/poll/period_ms", "found null");
  refuses({{"/sensor/invert_current", 1}}, "/sensor/invert_current", "true or false");
  refuses({{"/cell", 3}}, "/cell", "cell file");
  refuses({{"/modules", Json::object()}}, "/modules", "a list of modules");
  refuses({{"/modules/0", 4}}, "/modules/0", "an object");
  refuses({{"/modules/0/nodes", 4}}, "/modules/0/nodes", "a list of node numbers");
  refuses({{"/cell/ocv/3", 4}}, "/cell/ocv/3", "a pair");
}

TEST_CASE("a number that is not whole is refused where a whole one is wanted", "[unit][config]") {
  refuses({{"/poll/period_ms", 100.5}}, "/poll/period_ms", "found 100.5, wanted a whole number");
  refuses({{"/modules/0/cells", 11.5}}, "/modules/0/cells", "a whole number from 1 to 12");
}

TEST_CASE("a number out of its range is refused, the ends of the range are not", "[unit][config]") {
  accepts({{"/modules/0/cells", 1},
           {"/limits/pack_voltage_mismatch/warn_mV", 500},
           {"/limits/pack_voltage_mismatch/open_mV", 1'000},
           {"/limits/pack_voltage_mismatch/hysteresis_mV", 100}});
  refuses({{"/modules/0/cells", 0}}, "/modules/0/cells", "from 1 to 12");
  refuses({{"/modules/0/cells", 13}}, "/modules/0/cells", "from 1 to 12");
  refuses({{"/modules/0/temperature_sensors", 5}}, "/modules/0/temperature_sensors", "from 0 to 4");
  accepts({{"/contactors/precharge_done_permille", 900}});
  accepts({{"/contactors/precharge_done_permille", 1'000}});
  refuses({{"/contactors/precharge_done_permille", 899}}, "/contactors/precharge_done_permille", "from 900 to 1000");
  refuses({{"/contactors/precharge_done_permille", 1'001}}, "/contactors/precharge_done_permille", "from 900 to 1000");
  refuses({{"/contactors/settle_ms", 1e30}}, "/contactors/settle_ms", "from 20 to 1000");
  refuses({{"/contactors/settle_ms", -5}}, "/contactors/settle_ms", "found -5");
  refuses({{"/cell/capacity_Ah", 0}}, "/cell/capacity_Ah", "from 0.01");
}

TEST_CASE("names of buses follow the rules of their kind", "[unit][config]") {
  for (const char* name : {"can0", "vcan0", "slcan-left", "a", "fifteen-letters", "unix:a", "unix:A.b_c-9",
                           "unix:12345678901234567890123456789012"}) {
    CAPTURE(name);
    accepts({{"/buses/internal", name}});
  }
  for (const char* name : {"", "sixteen--letters", "can 0", "can/0", ".", "..", "tcp:host", "can\t0",
                           "unix:", "unix:a/b", "unix:a b", "unix:123456789012345678901234567890123"}) {
    CAPTURE(name);
    refuses({{"/buses/internal", name}}, "/buses/internal", "an interface name");
  }
}

TEST_CASE("texts for the vehicle are at most eight ASCII characters", "[unit][config]") {
  accepts({{"/vehicle/name", "EXACTLY8"}});
  refuses({{"/vehicle/name", "MORETHAN8"}}, "/vehicle/name", "1 to 8 ASCII");
  refuses({{"/vehicle/name", "N\xC3\x84ME"}}, "/vehicle/name", "1 to 8 ASCII");
  refuses({{"/vehicle/version", ""}}, "/vehicle/version", "1 to 8 ASCII");
  refuses({{"/name", "two\nlines"}}, "/name", "a text");
}

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
  // 4200 - 20 - 50 = 4130: there the two meet.
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

namespace {

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

}  // namespace

TEST_CASE("a cycle that does not fit between two polls is refused, with what would do", "[unit][config][BMS_F.2]") {
  // 35 modules take 89.2 ms, and 94.6 with two asked alone; 38 take 96.5 and 102.4.
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
      "500 kbit/s, with those of modules asked alone up to 103 ms");
  refuses(large(63, 500, 290), "/poll/period_ms", "buses/internal_kbit_per_s 1000: all answers of 63 modules take up");
  refuses(large(8, 125, 290), "/poll/period_ms", "at least 113 at 125 kbit/s, or buses/internal_kbit_per_s 250");
  refuses({{"/buses/internal_kbit_per_s", 124}}, "/buses/internal_kbit_per_s", "from 125 to 1000");
  refuses({{"/buses/internal_kbit_per_s", 1001}}, "/buses/internal_kbit_per_s", "from 125 to 1000");
}

TEST_CASE("a fast pace whose answers do not fit is refused, with what would do", "[unit][config][BMS_F.2]") {
  // 16 modules take 42.5 ms at 500 kbit/s, 47.9 with two asked alone.
  const auto with_fast = [](int fast_ms, int rate_kbit_per_s) {
    std::vector<Change> changes = large(16, rate_kbit_per_s, 290);
    changes.push_back({"/poll/fast_period_ms", fast_ms});
    return changes;
  };
  refuses(with_fast(47, 500), "/poll/fast_period_ms",
          "at least 48 at 500 kbit/s, or buses/internal_kbit_per_s 1000: all answers of 16 modules take up to 43 ms at "
          "500 kbit/s, with those of modules asked alone up to 48 ms");
  accepts(with_fast(48, 500));
  accepts(with_fast(49, 500));
  accepts(with_fast(47, 1'000));
  // Where the normal period is too short for the answers, both are said, and each with its own way out.
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
  // Results of the sensor wait for the answers; the word of the unit goes ahead of them.
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
        "pack.json: /poll/period_ms: found 100, which fills the internal bus to up to 73 %, wanted at least 105 at 500 "
        "kbit/s, or buses/internal_kbit_per_s 1000, for at most 70 %");
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
        "pack.json: /poll/fast_period_ms: found 90, which fills the internal bus to up to 74 %, wanted at least " +
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
  // Every third poll there is a sample each 300 ms: no age can both be met by that and let cold open in 950 ms.
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

TEST_CASE("confirming takes no longer than the reaction allows", "[unit][config][FS_2]") {
  accepts({{"/limits/cell_overvoltage/confirm_ms", 190}});
  refuses(
      {{"/limits/cell_overvoltage/confirm_ms", 191}}, "/limits/cell_overvoltage/confirm_ms",
      "found 191, wanted at most 190 with cell_voltage_ms 250, so that cell_overvoltage opens the pack within 450 ms");
  // A temperature that crosses its limit just behind the module's sample waits for the next one, and for the poll.
  accepts({{"/limits/cell_overtemperature/confirm_ms", 340}});
  refuses(
      {{"/limits/cell_overtemperature/confirm_ms", 341}}, "/limits/cell_overtemperature/confirm_ms",
      "at most 340 where modules sample every 500 ms and are asked every 100 ms, so that cell_overtemperature opens "
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
      "at most 190 where modules sample every 500 ms and are asked every 100 ms, so that cell_undertemperature opens "
      "the pack within 950 ms, its grace of 150 ms included");
}

TEST_CASE("what no pack needs is refused", "[unit][config]") {
  accepts({{"/contactors/precharge_current_max_mA", 5'000}, {"/contactors/precharge_overcurrent_mA", 5'001}});
  refuses({{"/contactors/precharge_current_max_mA", 100'000}}, "/contactors/precharge_current_max_mA",
          "found 100000, wanted a whole number from 1 to 5000, as more than that is a load or a short");
  accepts({{"/contactors/feedback_timeout_ms", 240}});
  refuses({{"/contactors/feedback_timeout_ms", 241}}, "/contactors/feedback_timeout_ms", "within 300 ms");
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
          "found 300, wanted more than settle_ms and feedback_timeout_ms, 300");
  accepts({{"/contactors/precharge_timeout_ms", 720}, {"/contactors/precharge_min_ms", 600}});
  refuses({{"/contactors/precharge_timeout_ms", 719}, {"/contactors/precharge_min_ms", 600}},
          "/contactors/precharge_timeout_ms", "found 719, wanted precharge_min_ms, 600, and 120 ms at least");
  accepts({{"/contactors/precharge_timeout_ms", 10'000}});
  refuses({{"/contactors/precharge_timeout_ms", 10'001}}, "/contactors/precharge_timeout_ms",
          "wanted a whole number from 100 to 10000, as a resistor that takes longer is the wrong one");
}

TEST_CASE("every pack says how soon a link cannot be charged", "[unit][config]") {
  Json pack = valid_pack();
  pack["contactors"].erase("precharge_min_ms");
  refuses_text(pack.dump(), "/contactors/precharge_min_ms", "found nothing, wanted this key, which is required");
  pack.erase("contactors");
  refuses_text(pack.dump(), "/contactors", "found nothing, wanted this key, which is required");
  accepts({{"/contactors/precharge_min_ms", 80}});
  refuses({{"/contactors/precharge_min_ms", 79}}, "/contactors/precharge_min_ms",
          "wanted a whole number from 80 to 1000, as the link voltage comes every 60 ms");
}

TEST_CASE("a precharge resistor can do what is asked of it", "[unit][config]") {
  // 48 cells of 4.23 V and 100 ohm: 203.04 V, 2.03 A, 412 W.
  accepts({{"/contactors/precharge_overcurrent_mA", 2'031}});
  refuses({{"/contactors/precharge_overcurrent_mA", 2'030}}, "/contactors/precharge_overcurrent_mA",
          "found 2030, wanted more than 2030, with which the precharge of a full pack of 203040 mV begins");
  accepts({{"/contactors/precharge_overcurrent_mA", 0}});
  // To 95 % in 100 ms or more: at least 412 W * 0.1 s * 0.9975 / (2 * ln 20) = 6.86 J.
  accepts({{"/contactors/precharge_energy_J", 7}});
  refuses({{"/contactors/precharge_energy_J", 6}}, "/contactors/precharge_energy_J",
          "found 6, wanted at least 7, what charging any link in precharge_min_ms or longer");
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
            std::string("found nothing, wanted this key, as ") + given + " is given");
  }
  accepts({{"/auxiliary/throttle_on_permille", 60}, {"/auxiliary/throttle_off_permille", 1}});
  refuses({{"/auxiliary/throttle_on_permille", 60}}, "/auxiliary/throttle_off_permille",
          "found 0, wanted more than 0, or what throttle_on_permille has switched on stays on");
}

TEST_CASE("what a pack closed for charging may lose is between the sensor's accuracy and 1 A", "[unit][config]") {
  accepts({{"/contactors/charge_only_discharge_mA", 100}});
  accepts({{"/contactors/charge_only_discharge_mA", 1'000}});
  refuses({{"/contactors/charge_only_discharge_mA", 99}}, "/contactors/charge_only_discharge_mA", "from 100 to 1000");
  refuses({{"/contactors/charge_only_discharge_mA", 1'001}}, "/contactors/charge_only_discharge_mA",
          "as sensors are no more accurate than the one");
}

TEST_CASE("two numbers that contradict each other are both named", "[unit][config]") {
  refuses({{"/current/discharge_peak_mA", 59'999}}, "/current/discharge_peak_mA",
          "found 59999, wanted at least discharge_continuous_mA, 60000");
  refuses({{"/current/discharge_peak_mA", 90'000}}, "/limits/discharge_overcurrent/open_mA",
          "found 90000, wanted more than discharge_peak_mA, 90000");
  refuses({{"/contactors/precharge_overcurrent_mA", 500}}, "/contactors/precharge_overcurrent_mA",
          "more than precharge_current_max_mA, 500");
  refuses({{"/contactors/precharge_resistance_Ohm", 0}}, "/contactors/precharge_resistance_Ohm",
          "found 0, wanted more than 0, so that precharge_energy_J can be watched");
  refuses({{"/insulation/warn_Ohm_per_V", 500}}, "/insulation/warn_Ohm_per_V", "more than open_Ohm_per_V, 500");
  refuses({{"/auxiliary/fan_on_dC", 300}, {"/auxiliary/fan_off_dC", 300}}, "/auxiliary/fan_on_dC",
          "more than fan_off_dC, 300");
  refuses({{"/auxiliary/heater_on_dC", 50}, {"/auxiliary/heater_off_dC", 50}}, "/auxiliary/heater_off_dC",
          "more than heater_on_dC, 50");
  refuses({{"/auxiliary/throttle_off_permille", 1}}, "/auxiliary/throttle_on_permille",
          "at least throttle_off_permille, 1");
  refuses({{"/limits/charge_overtemperature/open_dC", 581}}, "/limits/cell_overtemperature/open_dC",
          "found 580, wanted at least open_dC of charge_overtemperature, 581");
  refuses({{"/limits/charge_undertemperature/limit_dC", 51}}, "/limits/charge_undertemperature/limit_dC",
          "found 51, wanted from warn_dC, 50, to before open_dC, 0");
  refuses({{"/insulation/monitoring", "perhaps"}}, "/insulation/monitoring", "\"ok_line\" or \"measured\"");
}

TEST_CASE("limits that guard nothing, or cross each other, are refused with what would do", "[unit][config][F79]") {
  const auto limit = [](const char* text) { return Json::parse(text); };
  const Json deep = limit(R"({"warn_mV":2600,"open_mV":2500,"hysteresis_mV":50,"confirm_ms":100,"clear_ms":1000})");
  accepts({{"/limits/cell_deep_discharge", deep}});
  refuses({{"/limits/cell_deep_discharge", deep}, {"/limits/cell_deep_discharge/open_mV", 2'499}},
          "/limits/cell_deep_discharge/open_mV",
          "found 2499, wanted at least 2500, the cell's absolute voltage_min_mV");
  // 420 - 20 - 10 = 390: there the two meet.
  accepts({{"/limits/charge_undertemperature/limit_dC", 389}, {"/limits/charge_undertemperature/warn_dC", 389}});
  refuses({{"/limits/charge_undertemperature/limit_dC", 390}, {"/limits/charge_undertemperature/warn_dC", 390}},
          "/limits/charge_undertemperature/warn_dC",
          "found 390, wanted less than 390, which is warn_dC of charge_overtemperature less both hystereses");
  const Json board = limit(R"({"warn_dC":-309,"open_dC":-200,"hysteresis_dC":20,"confirm_ms":100,"clear_ms":1000})");
  accepts({{"/limits/board_overtemperature", board}});
  refuses({{"/limits/board_overtemperature", board}, {"/limits/board_overtemperature/warn_dC", -310}},
          "/limits/board_overtemperature/warn_dC",
          "found -310, wanted more than -310, which is warn_dC of board_undertemperature and both hystereses");
  accepts({{"/auxiliary", limit(R"({"fan_on_dC":300,"fan_off_dC":251,"heater_on_dC":200,"heater_off_dC":250})")}});
  refuses({{"/auxiliary", limit(R"({"fan_on_dC":300,"fan_off_dC":250,"heater_on_dC":200,"heater_off_dC":250})")}},
          "/auxiliary/fan_off_dC", "found 250, wanted more than heater_off_dC, 250");
}

TEST_CASE("a difference that opens is less than what it is a difference of", "[unit][config][F79]") {
  // 48 cells of 4.23 V.
  accepts({{"/limits/pack_voltage_mismatch/open_mV", 20'304}});
  refuses({{"/limits/pack_voltage_mismatch/open_mV", 20'305}}, "/limits/pack_voltage_mismatch/open_mV",
          "found 20305, wanted at most 20304, a tenth of the full pack");
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
          "found 1430, wanted at most 1429, less than the distance from cell_undervoltage to cell_overvoltage");
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
          "found a limit, wanted nothing, as sensor/has_second_current is false");
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
          "found 900, wanted more than 900");
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
  CHECK(limits.charge_undertemperature.open == 0);  // cells may be discharged below, but not charged
  CHECK(limits.cell_deep_discharge.open == pack->core.cell.voltage_min_uV);
  CHECK(limits.cell_deep_discharge.warn < limits.cell_undervoltage.open);
  CHECK(limits.cell_imbalance.open == (limits.cell_overvoltage.open - limits.cell_undervoltage.open) / 2);
  CHECK(limits.insulation_low.open == 500 * 4'230 / 1'000 * 48);
  CHECK(limits.current_sensors_disagree == never_above);
  CHECK(pack->core.current.discharge_peak_mA == limits.discharge_overcurrent.warn);
  CHECK(pack->core.current.charge_peak_mA == limits.charge_overcurrent.warn);
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
          "found 3000, wanted more than warn_mV of cell_undervoltage, 3000");
  accepts(with("voltage_min_mV", 4'199));
  refuses(with("voltage_min_mV", 4'200), "/limits/cell_overvoltage/warn_mV", "more than voltage_min_mV of balancing");
  refuses(with("method", "ocv2"), "/balancing/method", "terminal_voltage, ocv or charge");
  // A cell of 4.23 V and no more than 250 mA.
  accepts(with("bleed_resistance_Ohm", 17));
  refuses(with("bleed_resistance_Ohm", 16), "/balancing/bleed_resistance_Ohm", "at least 17");
  accepts(with("board_max_dC", 101));
  refuses(with("board_max_dC", 100), "/balancing/board_max_dC", "found 100, wanted more than board_min_dC");
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

TEST_CASE("a fast pace is not slower, a parked one not faster; left out they follow", "[unit][config]") {
  accepts({{"/poll/fast_period_ms", 100}, {"/poll/parked_period_ms", 100}});
  refuses({{"/poll/fast_period_ms", 101}}, "/poll/fast_period_ms", "found 101, wanted at most period_ms, 100");
  refuses({{"/poll/parked_period_ms", 99}}, "/poll/parked_period_ms", "found 99, wanted at least period_ms, 100");
  refuses({{"/poll/parked_period_ms", 501}}, "/poll/parked_period_ms",
          "found 501, wanted a whole number from 20 to 500");
  const auto pack = parse(valid_pack().dump());
  REQUIRE(pack);
  CHECK(pack->core.poll.fast_period == 50ms);
  CHECK(pack->core.poll.parked_period == 500ms);
  const auto large = load_pack_config(packs_directory / "traction-16x12.json");
  REQUIRE(large);
  CHECK(large->core.poll.period == 50ms);
  CHECK(large->core.poll.fast_period == 50ms);  // 16 modules need nearly all of it, should two be asked alone
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

TEST_CASE("there are at most 63 modules", "[unit][config][BMS_F.2]") {
  accepts(large(63, 1'000, 280));
  refuses({{"/modules", modules_of_12(64)}}, "/modules", "found 64 modules, wanted at most 63");
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
  refuses({{"/cell/ocv", {{0, 3'000}}}}, "/cell/ocv", "found 1 pairs, wanted a list of 2 to 64 pairs");
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
          "found 30, wanted more than rc_time_constant_s, 30");
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

// --- all at once, and nothing by halves -----------------------------------------------------------------------------

TEST_CASE("all problems are reported at once", "[unit][config]") {
  const Json pack = changed({{"/nmae", "x"},
                             {"/buses/vehicle", "can/1"},
                             {"/limits/cell_overvoltage/open_mV", 4'300},
                             {"/limits/cell_undervoltage/confirm_ms", 900},
                             {"/cell/ocv/5/1", 100},
                             {"/modules/0/nodes", {1, 1}},
                             {"/vehicle/base_id", "100"}});
  std::vector<std::string> paths;
  for (const ConfigProblem& problem : problems_of(pack.dump())) paths.push_back(problem.path);
  std::sort(paths.begin(), paths.end());
  CHECK(paths == std::vector<std::string>{"/buses/vehicle", "/cell/ocv/5/1", "/limits/cell_overvoltage/open_mV",
                                          "/limits/cell_undervoltage/confirm_ms", "/modules/0/nodes/1", "/nmae",
                                          "/vehicle/base_id"});
}

TEST_CASE("a problem reads as file, path, found and wanted", "[unit][config]") {
  CHECK(to_text({"pack.json", "/modules/2/node", "1", "a node number no other module has"}) ==
        "pack.json: /modules/2/node: found 1, wanted a node number no other module has");
  CHECK(to_text({"pack.json", "", "a directory", "a readable file"}) ==
        "pack.json: found a directory, wanted a readable file");
  CHECK(to_text({"pack.json", "", "a syntax error", "JSON", TextPosition{14, 24}}) ==
        "pack.json:14:24: found a syntax error, wanted JSON");
}

TEST_CASE("what a file holds cannot disturb the terminal that shows its problems", "[unit][config]") {
  const std::string text =
      R"({"\u001b[2J": "\u0007", "name": "\u001b[2J", "buses": ")" + std::string(100'000, 'x') + "\"}";
  const ConfigProblems problems = problems_of(text);
  REQUIRE_FALSE(problems.empty());
  for (const ConfigProblem& problem : problems) {
    const std::string line = to_text(problem);
    CHECK(line.size() < 1'000);
    CHECK(std::all_of(line.begin(), line.end(), [](char c) { return c >= ' ' && c <= '~'; }));
  }
}

// --- files ----------------------------------------------------------------------------------------------------------

TEST_CASE("a file that cannot be read is a problem that names it", "[unit][config]") {
  const TemporaryFolder directory;
  const auto refuses_file = [](const std::filesystem::path& file, const std::string& words) {
    const auto result = load_pack_config(file);
    REQUIRE_FALSE(result);
    REQUIRE(result.error().size() == 1);
    const std::string text = to_text(result.error().front());
    INFO(text);
    CHECK(text.find(file.string()) == 0);
    CHECK(text.find(words) != std::string::npos);
  };
  refuses_file(directory.path() / "missing.json", "No such file");
  refuses_file(directory.path(), "a directory");
  refuses_file("/dev/null", "no regular file");
  refuses_file(directory.file("huge.json", std::string((1U << 20U) + 1, ' ')), "more than 1 MiB");
  refuses_file(directory.file("empty.json", ""), "empty.json:1:1: ");
}

TEST_CASE("problems of a cell file name that file", "[unit][config]") {
  const TemporaryFolder directory;
  Json pack = valid_pack();
  Json cell = pack.at("cell");
  cell["capacity_Ah"] = -1;
  pack["cell"] = "cell.json";
  directory.file("cell.json", cell.dump());
  const auto result = load_pack_config(directory.file("pack.json", pack.dump()));
  REQUIRE_FALSE(result);
  REQUIRE(result.error().size() == 1);
  CHECK(result.error().front().file == (directory.path() / "cell.json").string());
  CHECK(result.error().front().path == "/capacity_Ah");
}

TEST_CASE("a missing or broken cell file is one problem", "[unit][config]") {
  const TemporaryFolder directory;
  directory.file("broken.json", "{\n\"name\": \n}");
  const std::string folder = directory.path().string();
  const auto refuses_cell = [&directory](const std::string& name, const std::string& wanted) {
    Json pack = valid_pack();
    pack["cell"] = name;
    const auto result = parse_pack_config(pack.dump(), "pack.json", directory.path());
    REQUIRE_FALSE(result);
    INFO(all_text(result.error()));
    REQUIRE(result.error().size() == 1);
    CHECK(to_text(result.error().front()).find(wanted) == 0);
  };
  refuses_cell("cells/../missing.json", "pack.json: /cell: found \"cells/../missing.json\" (\"" + folder +
                                            "/missing.json\": No such file or directory), wanted a readable file");
  refuses_cell(".", "pack.json: /cell: found \".\" (\"" + folder + "/\": a directory), wanted a readable file");
  refuses_cell("broken.json", folder + "/broken.json:3:1: found a syntax error");
  refuses({{"/cell", ""}}, "/cell", "a text");
  refuses({{"/cell", std::string("a\0b", 3)}}, "/cell", "a text");
}

TEST_CASE("the hash changes with any byte of the pack file and of the cell file", "[unit][config]") {
  const TemporaryFolder directory;
  const std::string cell = bytes_of(cells_directory / "nmc-30ah-10p.json");
  Json tree = valid_pack();
  tree["cell"] = "cell.json";
  const std::string pack = tree.dump();
  const auto hash_of = [&directory](const std::string& pack_text, const std::string& cell_text) {
    directory.file("cell.json", cell_text);
    const auto result = load_pack_config(directory.file("pack.json", pack_text));
    REQUIRE(result);
    return result->core.hash;
  };
  const std::uint64_t hash = hash_of(pack, cell);
  CHECK(hash == hash_of(pack, cell));
  // A space at each place where JSON allows one: behind each comma outside a text, and at both ends.
  CHECK(hash != hash_of(pack + " ", cell));
  CHECK(hash != hash_of(" " + pack, cell));
  CHECK(hash != hash_of(pack, cell + "\n"));
  CHECK(hash != hash_of(pack, "\n" + cell));
  std::string other_cell = cell;
  const std::size_t comment = other_cell.find("// ");
  for (std::size_t at = comment + 3; at < comment + 20; ++at) {
    other_cell = cell;
    other_cell[at] = other_cell[at] == '#' ? '+' : '#';
    CHECK(hash != hash_of(pack, other_cell));
  }
}

// --- lines of this machine ------------------------------------------------------------------------------------------

Json gpio_section() {
  return Json::parse(R"({
    "chip": "/dev/gpiochip0",
    "outputs": {"main_positive": {"line": 3, "active_low": true}, "main_negative": {"line": 4}, "precharge": {"line": 5},
                "fan": {"line": 6}, "watchdog": {"line": 2}},
    "feedback": {"main_positive": {"line": 13, "active_low": true}, "main_negative": {"line": 14, "debounce_ms": 0}},
    "inputs": [{"name": "cockpit", "kind": "estop", "line": 7, "active_low": true, "debounce_ms": 20},
               {"name": "rear", "kind": "estop", "line": 8}, {"name": "key", "kind": "vehicle_on", "line": 9}]})");
}

/// The section with these changes, paths relative to it.
Json with_gpio(const std::vector<Change>& changes) {
  Json gpio = gpio_section();
  for (const auto& [pointer, value] : changes) gpio[Json::json_pointer(pointer)] = value;
  return changed({{"/gpio", gpio}});
}

Json with_gpio_without(const std::string& parent, const std::vector<std::string>& keys) {
  Json pack = with_gpio({});
  for (const std::string& key : keys) pack[Json::json_pointer("/gpio" + parent)].erase(key);
  return pack;
}

std::size_t number_of(GpioOutput output) {
  return static_cast<std::size_t>(output);
}

TEST_CASE("a pack without lines has none", "[unit][config][gpio]") {
  const auto pack = parse(valid_pack().dump());
  REQUIRE(pack);
  CHECK_FALSE(pack->gpio);
}

TEST_CASE("lines of outputs, feedback and inputs arrive as they are written", "[unit][config][gpio]") {
  const auto pack = parse(with_gpio({}).dump());
  INFO((pack ? "" : all_text(pack.error())));
  REQUIRE(pack);
  REQUIRE(pack->gpio);
  const GpioConfig& gpio = *pack->gpio;
  CHECK(gpio.chip == "/dev/gpiochip0");
  REQUIRE(gpio.outputs.at(number_of(GpioOutput::main_positive)));
  CHECK(gpio.outputs.at(number_of(GpioOutput::main_positive))->line == 3);
  CHECK(gpio.outputs.at(number_of(GpioOutput::main_positive))->active_low);
  CHECK_FALSE(gpio.outputs.at(number_of(GpioOutput::main_negative))->active_low);
  CHECK_FALSE(gpio.outputs.at(number_of(GpioOutput::charge)));
  CHECK(gpio.outputs.at(number_of(GpioOutput::watchdog))->line == 2);
  CHECK(gpio.feedback.at(number_of(GpioOutput::main_positive))->at.line == 13);
  CHECK(gpio.feedback.at(number_of(GpioOutput::main_positive))->at.active_low);
  CHECK(gpio.feedback.at(number_of(GpioOutput::main_positive))->debounce == 5ms);
  CHECK(gpio.feedback.at(number_of(GpioOutput::main_negative))->debounce == 0ms);
  REQUIRE(gpio.inputs.size() == 3);
  CHECK(gpio.inputs[0].name == "cockpit");
  CHECK(gpio.inputs[0].kind == GpioInputKind::estop);
  CHECK(gpio.inputs[0].at.line == 7);
  CHECK(gpio.inputs[0].at.active_low);
  CHECK(gpio.inputs[0].debounce == 20ms);
  CHECK(gpio.inputs[2].kind == GpioInputKind::vehicle_on);
  CHECK_FALSE(gpio.inputs[2].at.active_low);
  CHECK(gpio.inputs[2].debounce == 5ms);
}

TEST_CASE("inputs alone, and outputs alone, are enough", "[unit][config][gpio]") {
  for (const auto& keys : std::vector<std::vector<std::string>>{{"outputs", "feedback"}, {"feedback", "inputs"}}) {
    const ConfigProblems problems = problems_of(with_gpio_without("", keys).dump());
    INFO(all_text(problems));
    CHECK(problems.empty());
  }
  refuses({{"/gpio", {{"chip", "/dev/gpiochip0"}}}}, "/gpio", "outputs or inputs");
}

TEST_CASE("each key of a line has its form and range", "[unit][config][gpio]") {
  const auto refuses_gpio = [](const std::vector<Change>& changes, const std::string& path, const std::string& words) {
    refuses_text(with_gpio(changes).dump(), "/gpio" + path, words);
  };
  refuses_gpio({{"/chip", "gpiochip0"}}, "/chip", "/dev/gpiochip0");
  refuses_gpio({{"/outputs/fan/line", 65'535}}, "/outputs/fan/line", "0 to 65534");
  refuses_gpio({{"/outputs/fan/line", -1}}, "/outputs/fan/line", "0 to 65534");
  refuses_gpio({{"/outputs/fan/active_low", 1}}, "/outputs/fan/active_low", "true or false");
  refuses_gpio({{"/outputs/fan/debounce_ms", 5}}, "/outputs/fan/debounce_ms", "unknown key");
  refuses_gpio({{"/outputs/fan", 6}}, "/outputs/fan", "an object");
  refuses_gpio({{"/outputs/horn", {{"line", 9}}}}, "/outputs/horn", "unknown key");
  refuses_gpio({{"/feedback/watchdog", {{"line", 19}}}}, "/feedback/watchdog", "unknown key");
  refuses_gpio({{"/feedback/main_positive/debounce_ms", 51}}, "/feedback/main_positive/debounce_ms", "0 to 50");
  refuses_gpio({{"/inputs/1/kind", "stop"}}, "/inputs/1/kind", "vehicle_on, charger_connected, estop");
  refuses_gpio({{"/inputs/1/name", ""}}, "/inputs/1/name", "1 to 32");
  refuses_gpio({{"/inputs", {{"line", 3}}}}, "/inputs", "a list");
  refuses_text(with_gpio_without("", {"chip"}).dump(), "/gpio/chip", "required");
  refuses_text(with_gpio_without("/outputs/fan", {"line"}).dump(), "/gpio/outputs/fan/line", "required");
  refuses_text(with_gpio_without("/inputs/0", {"kind"}).dump(), "/gpio/inputs/0/kind", "required");
}

TEST_CASE("a line and a name belong to one only, and the problem says to whom", "[unit][config][gpio]") {
  refuses_text(with_gpio({{"/outputs/precharge/line", 3}}).dump(), "/gpio/outputs/precharge/line",
               "taken by /gpio/outputs/main_positive");
  refuses_text(with_gpio({{"/feedback/main_negative/line", 4}}).dump(), "/gpio/feedback/main_negative/line",
               "taken by /gpio/outputs/main_negative");
  refuses_text(with_gpio({{"/inputs/1/line", 14}}).dump(), "/gpio/inputs/1/line",
               "taken by /gpio/feedback/main_negative");
  refuses_text(with_gpio({{"/inputs/2/name", "rear"}}).dump(), "/gpio/inputs/2/name", "taken by /gpio/inputs/1");
}

TEST_CASE("contactors on lines are complete, and have a watchdog", "[unit][config][gpio]") {
  refuses_text(with_gpio_without("/outputs", {"precharge"}).dump(), "/gpio/outputs/precharge",
               "all there, or none of them");
  refuses_text(with_gpio_without("/outputs", {"watchdog"}).dump(), "/gpio/outputs/watchdog", "as main_positive has");
  Json fan_only = with_gpio_without("", {"feedback"});
  fan_only["gpio"]["outputs"] = {{"fan", {{"line", 6}}}};
  CHECK(problems_of(fan_only.dump()).empty());
  fan_only["gpio"]["outputs"]["charge"] = {{"line", 5}};
  refuses_text(fan_only.dump(), "/gpio/outputs/watchdog", "as charge has");
}

TEST_CASE("there is no feedback of an output that has no line", "[unit][config][gpio]") {
  refuses_text(with_gpio({{"/feedback/heater", {{"line", 20}}}}).dump(), "/gpio/feedback/heater",
               "/gpio/outputs/heater");
}

TEST_CASE("sixteen inputs with nine debounce times are accepted, and no more of either", "[unit][config][gpio]") {
  Json pack = with_gpio_without("", {"outputs", "feedback"});
  Json& inputs = pack["gpio"]["inputs"] = Json::array();
  for (int i = 0; i < 16; ++i) {
    inputs.push_back(
        {{"name", "input " + std::to_string(i)}, {"kind", "interlock"}, {"line", i}, {"debounce_ms", i % 10}});
  }
  CHECK(problems_of(pack.dump()).empty());  // 0 is none
  inputs[0]["debounce_ms"] = 10;
  refuses_text(pack.dump(), "/gpio", "found 10 different debounce_ms, wanted at most 9");
  inputs.push_back({{"name", "one more"}, {"kind", "interlock"}, {"line", 16}});
  refuses_text(pack.dump(), "/gpio/inputs", "at most 16");
}

TEST_CASE("everything wrong with the lines is said in one go", "[unit][config][gpio]") {
  Json pack = with_gpio({{"/outputs/fan/line", "six"}, {"/inputs/0/kind", "button"}, {"/inputs/1/line", 9}});
  pack["gpio"]["outputs"].erase("watchdog");
  pack["gpio"]["outputs"].erase("main_negative");
  const ConfigProblems problems = problems_of(pack.dump());
  INFO(all_text(problems));
  std::vector<std::string> paths;
  for (const ConfigProblem& problem : problems) paths.push_back(problem.path);
  std::sort(paths.begin(), paths.end());
  CHECK(paths == std::vector<std::string>{"/gpio/feedback/main_negative", "/gpio/inputs/0/kind", "/gpio/inputs/2/line",
                                          "/gpio/outputs/fan/line", "/gpio/outputs/main_negative",
                                          "/gpio/outputs/watchdog"});
}

// --- damage ---------------------------------------------------------------------------------------------------------

/// SplitMix64: the same numbers with every library.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  std::uint64_t below(std::uint64_t end) { return next() % end; }

 private:
  std::uint64_t next() {
    state_ += 0x9E37'79B9'7F4A'7C15;
    std::uint64_t mixed = state_;
    mixed = (mixed ^ (mixed >> 30U)) * 0xBF58'476D'1CE4'E5B9;
    mixed = (mixed ^ (mixed >> 27U)) * 0x94D0'49BB'1331'11EB;
    return mixed ^ (mixed >> 31U);
  }
  std::uint64_t state_;
};

void damage(std::string& text, Random& random) {
  const std::size_t at = random.below(text.size());
  switch (random.below(4)) {
    case 0: text[at] = static_cast<char>(random.below(256)); break;
    case 1: text.erase(at, 1 + random.below(20)); break;
    case 2: text.insert(at, 1, "0123456789-.eE{}[],:\"/*\\ "[random.below(25)]); break;
    default: {
      const std::size_t start = random.below(text.size());
      const std::size_t length = random.below(40);
      text.insert(at, text.substr(start, length));
      break;
    }
  }
}

// BMUD_SEED=n repeats a run that failed with seed n.
TEST_CASE("a damaged file is refused or harmless, and never a crash", "[unit][config]") {
  const char* wanted_seed = std::getenv("BMUD_SEED");  // NOLINT(concurrency-mt-unsafe)
  const std::uint64_t first = wanted_seed != nullptr ? std::strtoull(wanted_seed, nullptr, 10) : 1;
  const std::uint64_t last = wanted_seed != nullptr ? first : 2'000;
  const std::string good = with_gpio({}).dump(1);
  for (std::uint64_t seed = first; seed <= last; ++seed) {
    INFO("repeat with BMUD_SEED=" << seed << " test_unit \"a damaged file*\"");
    Random random(seed);
    std::string text = good;
    for (std::uint64_t times = 1 + random.below(4); times > 0; --times) damage(text, random);
    const auto result = parse(text);
    if (result) {
      const CoreConfig& core = result->core;
      REQUIRE(core.limits.cell_overvoltage.open <= core.cell.voltage_max_uV);
      REQUIRE(core.limits.cell_undervoltage.open >= core.cell.voltage_min_uV);
      REQUIRE(core.cell.ocv.size() >= 2);
    } else {
      REQUIRE_FALSE(result.error().empty());
    }
  }
}

// --- no power distribution unit -------------------------------------------------------------------------------------

/// A pack whose three contactors and their contacts are lines, with these changes, paths from the root.
Json without_unit(const std::vector<Change>& changes) {
  Json pack = with_gpio({{"/feedback/precharge", {{"line", 15}}}});
  pack["contactors"]["pdu"] = false;
  pack["insulation"]["monitoring"] = "ok_line";
  for (const auto& [pointer, value] : changes) pack[Json::json_pointer(pointer)] = value;
  return pack;
}

TEST_CASE("what the core is told of lines is what the pack file has", "[unit][config][gpio]") {
  const auto none = parse(valid_pack().dump());
  REQUIRE(none);
  CHECK_FALSE(none->core.lines.are_used);
  const auto pack = parse(with_gpio({}).dump());
  REQUIRE(pack);
  const LinesConfig& lines = pack->core.lines;
  CHECK(lines.are_used);
  CHECK(lines.drive_contactors);
  CHECK(lines.feedback == 0b0011);  // main positive and main negative
  CHECK(lines.has_vehicle_on);
  CHECK_FALSE(lines.has_charger_connected);
  CHECK_FALSE(lines.has_resume_button);
  CHECK_FALSE(lines.has_insulation_ok);
  CHECK_FALSE(lines.has_supply_ok);
  const auto inputs = parse(with_gpio({{"/inputs/0/kind", "charger_connected"},
                                       {"/inputs/1/kind", "resume_button"},
                                       {"/inputs/2/kind", "insulation_ok"},
                                       {"/inputs/3", {{"name", "24 V"}, {"kind", "supply_ok"}, {"line", 10}}}})
                                .dump());
  REQUIRE(inputs);
  CHECK_FALSE(inputs->core.lines.has_vehicle_on);
  CHECK(inputs->core.lines.has_charger_connected);
  CHECK(inputs->core.lines.has_resume_button);
  CHECK(inputs->core.lines.has_insulation_ok);
  CHECK(inputs->core.lines.has_supply_ok);
}

TEST_CASE("without a power distribution unit everything it does is a line", "[unit][config][gpio]") {
  const auto pack = parse(without_unit({}).dump());
  INFO((pack ? "" : all_text(pack.error())));
  REQUIRE(pack);
  CHECK_FALSE(pack->core.contactors.has_pdu);
  CHECK(parse(valid_pack().dump())->core.contactors.has_pdu);

  // Nothing of it: contactors, contacts and a wish are missing, each is named.
  const std::string all = all_text(problems_of(changed({{"/contactors/pdu", false}}).dump()));
  for (const std::string path :
       {"/gpio/outputs/main_positive", "/gpio/outputs/main_negative", "/gpio/outputs/precharge",
        "/gpio/feedback/main_positive", "/gpio/feedback/main_negative", "/gpio/feedback/precharge", "/gpio/inputs"}) {
    CAPTURE(path, all);
    CHECK(all.find(path) != std::string::npos);
  }
  Json no_contact = without_unit({});
  no_contact["gpio"]["feedback"].erase("main_negative");
  refuses_text(no_contact.dump(), "/gpio/feedback/main_negative", "its auxiliary contact, as contactors/pdu is false");
  refuses_text(without_unit({{"/gpio/inputs/2/kind", "resume_button"}}).dump(), "/gpio/inputs",
               "nobody else asks for a closed pack");
  CHECK(problems_of(without_unit({{"/gpio/inputs/2/kind", "charger_connected"}}).dump()).empty());
  refuses_text(without_unit({{"/insulation/monitoring", "measured"}}).dump(), "/insulation/monitoring",
               "no unit tells a resistance");
}

TEST_CASE("a charge contactor without a unit is a line with a contact, too", "[unit][config][gpio]") {
  Json pack = without_unit({{"/contactors/has_charge_contactor", true}});
  const std::string all = all_text(problems_of(pack.dump()));
  INFO(all);
  CHECK(all.find("/gpio/outputs/charge") != std::string::npos);
  CHECK(all.find("/gpio/feedback/charge") != std::string::npos);
  pack["gpio"]["outputs"]["charge"] = {{"line", 20}};
  pack["gpio"]["feedback"]["charge"] = {{"line", 21}};
  CHECK(problems_of(pack.dump()).empty());
}

}  // namespace
}  // namespace bmu

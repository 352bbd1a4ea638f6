// Current limits in files: derating tables of the cell, components, user limits, ramps and the limp-home floor.
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "config/cell_file/cell_config.hpp"
#include "config/cell_file/cell_file_writer.hpp"
#include "config/pack_config.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/folders.hpp"

namespace bmu {
namespace {

using Json = nlohmann::json;
using Change = std::pair<std::string, Json>;  // JSON pointer, value

const std::filesystem::path config_directory = test::in_source("config");

Json json_of(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  REQUIRE(stream);
  return Json::parse(stream, nullptr, true, true);
}

std::string all_text(const ConfigProblems& problems) {
  std::string text;
  for (const ConfigProblem& problem : problems) text += to_text(problem) + "\n";
  return text;
}

Json changed(Json tree, const std::vector<Change>& changes) {
  for (const auto& [pointer, value] : changes) tree[Json::json_pointer(pointer)] = value;
  return tree;
}

// --- derating -------------------------------------------------------------------------------------------------------

Json cell_with(const Json& derating) {
  Json cell = json_of(config_directory / "cells/nmc-3000.json");
  cell["derating"] = derating;
  return cell;
}

Json four_tables() {
  return Json::parse(R"({"charge_over_temperature": [[0, 0], [100, 300], [250, 1000], [400, 1000], [500, 0]],
                         "discharge_over_temperature": [[-200, 100], [600, 900]],
                         "charge_over_soc": [[0, 1000], [800, 1000], [1000, 0]],
                         "discharge_over_soc": [[0, 0], [100, 1000], [1000, 1000]]})");
}

DeratingTables tables_of(const Json& derating) {
  const auto cell = parse_cell_file(cell_with(derating).dump(), "cell.json");
  INFO((cell ? "" : all_text(cell.error())));
  REQUIRE(cell);
  return cell->derating;
}

void refuses_cell(const std::vector<Change>& changes, const std::string& problem) {
  const auto cell = parse_cell_file(cell_with(changed(four_tables(), changes)).dump(), "cell.json");
  REQUIRE_FALSE(cell);
  CHECK(all_text(cell.error()) == "cell.json: /derating" + problem + "\n");
}

void accepts_cell(const std::vector<Change>& changes) {
  const auto cell = parse_cell_file(cell_with(changed(four_tables(), changes)).dump(), "cell.json");
  INFO((cell ? "" : all_text(cell.error())));
  CHECK(cell);
}

TEST_CASE("derating tables arrive as they are written, and none is taken for another", "[unit][config][derating]") {
  const DeratingTables tables = tables_of(four_tables());
  REQUIRE(tables.charge_over_temperature.points.size() == 5);
  CHECK(tables.charge_over_temperature.points[1] == DeratingPoint{100, 300});
  REQUIRE(tables.discharge_over_temperature.points.size() == 2);
  CHECK(tables.discharge_over_temperature.points[0] == DeratingPoint{-200, 100});
  REQUIRE(tables.charge_over_soc.points.size() == 3);
  CHECK(tables.charge_over_soc.points[2] == DeratingPoint{1'000, 0});
  REQUIRE(tables.discharge_over_soc.points.size() == 3);
  CHECK(tables.discharge_over_soc.points[0] == DeratingPoint{0, 0});
}

TEST_CASE("each derating table may be left out, and all of them", "[unit][config][derating]") {
  CHECK_FALSE(tables_of(Json::object()).charge_over_temperature.is_given());
  Json some = four_tables();
  some.erase("charge_over_soc");
  CHECK_FALSE(tables_of(some).charge_over_soc.is_given());
  CHECK(tables_of(some).discharge_over_soc.is_given());
}

TEST_CASE("a derating table has its form", "[unit][config][derating]") {
  refuses_cell({{"/charge_over_soc", 1}},
               "/charge_over_soc: found 1, expected a list of 2 to 16 pairs, [soc_permille, share_permille]");
  refuses_cell(
      {{"/charge_over_temperature", Json::parse("[[0, 0]]")}},
      "/charge_over_temperature: found 1 pairs, expected a list of 2 to 16 pairs, [temperature_dC, share_permille]");
  Json many = Json::array();
  for (int point = 0; point < 16; ++point) many.push_back({point * 10, point * 10});
  accepts_cell({{"/charge_over_temperature", many}});
  many.push_back({160, 160});
  refuses_cell(
      {{"/charge_over_temperature", many}},
      "/charge_over_temperature: found 17 pairs, expected a list of 2 to 16 pairs, [temperature_dC, share_permille]");
  refuses_cell({{"/discharge_over_soc/1", 5}},
               "/discharge_over_soc/1: found 5, expected a pair, [soc_permille, share_permille]");
  refuses_cell({{"/discharge_over_temperature/1", Json::parse("[1, 2, 3]")}},
               "/discharge_over_temperature/1: found [1,2,3], expected a pair, [temperature_dC, share_permille]");
  refuses_cell({{"/charge_over_heat", 1}},
               "/charge_over_heat: found an unknown key, expected a known key; did you mean \"charge_over_soc\"?");
}

TEST_CASE("numbers of a derating table reach their ends and do not pass them", "[unit][config][derating]") {
  accepts_cell({{"/discharge_over_temperature", Json::parse("[[-600, 0], [1500, 1000]]")}});
  refuses_cell({{"/discharge_over_temperature/0/0", -601}},
               "/discharge_over_temperature/0/0: found -601, expected a whole number from -600 to 1500");
  refuses_cell({{"/discharge_over_temperature/1/0", 1'501}},
               "/discharge_over_temperature/1/0: found 1501, expected a whole number from -600 to 1500");
  refuses_cell({{"/discharge_over_temperature/0/1", -1}},
               "/discharge_over_temperature/0/1: found -1, expected a whole number from 0 to 1000");
  refuses_cell({{"/discharge_over_temperature/1/1", 1'001}},
               "/discharge_over_temperature/1/1: found 1001, expected a whole number from 0 to 1000");
  refuses_cell({{"/charge_over_soc/2/0", 1'001}},
               "/charge_over_soc/2/0: found 1001, expected a whole number from 0 to 1000");
  refuses_cell({{"/charge_over_soc/0/0", -1}},
               "/charge_over_soc/0/0: found -1, expected a whole number from 0 to 1000");
}

TEST_CASE("places of a derating table rise, over the charge from empty to full", "[unit][config][derating]") {
  refuses_cell({{"/charge_over_temperature/2/0", 100}},
               "/charge_over_temperature/2/0: found 100, expected more than in the pair before, 100");
  accepts_cell({{"/charge_over_temperature/2/0", 101}});
  refuses_cell({{"/charge_over_soc/0/0", 1}}, "/charge_over_soc/0/0: found 1, expected 0 in the first pair");
  refuses_cell({{"/discharge_over_soc/2/0", 999}},
               "/discharge_over_soc/2/0: found 999, expected 1000 in the last pair");
}

TEST_CASE("in the cold charging ends, and nothing rises again that has fallen", "[unit][config][derating][BMU_15]") {
  refuses_cell({{"/charge_over_temperature/0/1", 1}},
               "/charge_over_temperature/0/1: found 1, expected 0 in the first pair: in the cold nothing is charged");
  accepts_cell({{"/discharge_over_temperature/0/1", 0}});
  refuses_cell({{"/charge_over_temperature/2/1", 200}, {"/charge_over_temperature/3/1", 201}},
               "/charge_over_temperature/3/1: found 201, expected at most as much as in the pair before, 200, as it "
               "has fallen already");
  accepts_cell({{"/charge_over_temperature/2/1", 200}, {"/charge_over_temperature/3/1", 200}});
  refuses_cell({{"/charge_over_soc/1/1", 500}, {"/charge_over_soc/2/1", 501}},
               "/charge_over_soc/2/1: found 501, expected at most as much as in the pair before, 500");
  refuses_cell({{"/discharge_over_soc/2/1", 999}},
               "/discharge_over_soc/2/1: found 999, expected at least as much as in the pair before, 1000");
  accepts_cell({{"/discharge_over_soc/0/1", 1'000}});
}

TEST_CASE("derating tables are written as they were read, and arrive in the core", "[unit][config][derating]") {
  const auto cell = parse_cell_file(cell_with(four_tables()).dump(), "cell.json");
  REQUIRE(cell);
  const std::string text = cell_file_text(*cell);
  CHECK(Json::parse(text).at("derating") == four_tables());
  CHECK(text.find("    \"charge_over_soc\": [[0, 1000], [800, 1000], [1000, 0]],\n") != std::string::npos);
  CHECK_FALSE(Json::parse(cell_file_text(CellFile{.model = cell->model})).contains("derating"));
  Json pack = json_of(config_directory / "packs/demo-48s.json");
  pack["cell"] = cell_with(four_tables());
  const auto read = parse_pack_config(pack.dump(), "pack.json", config_directory / "packs");
  REQUIRE(read);
  CHECK(read->core.derating.charge_over_soc.points.size() == 3);
}

TEST_CASE("no shipped cell is charged at freezing, and each is at its best from 25 to 40 C",
          "[unit][config][derating][BMU_15]") {
  for (const auto& entry : std::filesystem::directory_iterator(config_directory / "cells")) {
    CAPTURE(entry.path().string());
    const auto cell = load_cell_file(entry.path());
    REQUIRE(cell);
    const DeratingTable& charge = cell->derating.charge_over_temperature;
    REQUIRE(charge.is_given());
    CHECK(share_permille(charge, 0) == 0);
    CHECK(share_permille(charge, 50) < 500);
    CHECK(share_permille(charge, 250) == 1'000);
    CHECK(share_permille(charge, 400) == 1'000);
    REQUIRE(cell->derating.discharge_over_temperature.is_given());
    CHECK(share_permille(cell->derating.discharge_over_temperature, 250) == 1'000);
    CHECK(share_permille(cell->derating.discharge_over_temperature, 400) == 1'000);
  }
}

// --- components, user, ramps ----------------------------------------------------------------------------------------

Json pack_with(const std::vector<Change>& changes) {
  Json pack = json_of(config_directory / "packs/demo-48s.json");
  pack["cell"] = json_of(config_directory / "cells/nmc-30ah-10p.json");
  return changed(std::move(pack), changes);
}

CoreConfig core_of(const std::vector<Change>& changes) {
  const auto pack = parse_pack_config(pack_with(changes).dump(), "pack.json", config_directory / "packs");
  INFO((pack ? "" : all_text(pack.error())));
  REQUIRE(pack);
  return pack->core;
}

void refuses(const std::vector<Change>& changes, const std::string& problem) {
  const auto pack = parse_pack_config(pack_with(changes).dump(), "pack.json", config_directory / "packs");
  REQUIRE_FALSE(pack);
  CHECK(all_text(pack.error()) == "pack.json: " + problem + "\n");
}

const Json fuse{{"name", "main fuse"},
                {"discharge_continuous_mA", 55'000},
                {"charge_continuous_mA", 18'000},
                {"discharge_peak_mA", 70'000}};

TEST_CASE("parts arrive as they are written, a peak that is left out as the continuous current",
          "[unit][config][parts]") {
  CHECK(core_of({}).component_limits.empty());
  const CoreConfig core =
      core_of({{"/component_limits", Json::array({fuse, {{"name", "plug"}, {"charge_peak_mA", 9'000}}})}});
  REQUIRE(core.component_limits.size() == 2);
  const PartConfig& part = core.component_limits[0];
  CHECK(std::string(part.name.begin(), part.name.end()) == "main fuse               ");
  CHECK(part.most.discharge_continuous_mA == 55'000);
  CHECK(part.most.discharge_peak_mA == 70'000);
  CHECK(part.most.charge_continuous_mA == 18'000);
  CHECK(part.most.charge_peak_mA == 18'000);
  CHECK(core.component_limits[1].most.charge_peak_mA == 9'000);
  CHECK(core.component_limits[1].most.charge_continuous_mA == 0);
  CHECK(core.component_limits[1].most.discharge_peak_mA == 0);
}

TEST_CASE("a part has a name of its own and says what it bears", "[unit][config][parts]") {
  refuses({{"/component_limits", 1}}, "/component_limits: found 1, expected a list of at most 16 parts, [{ ... }]");
  Json many = Json::array();
  for (int part = 0; part < 16; ++part) {
    many.push_back({{"name", "part " + std::to_string(part)}, {"charge_peak_mA", 1}});
  }
  CHECK(core_of({{"/component_limits", many}}).component_limits.size() == 16);
  many.push_back(fuse);
  refuses({{"/component_limits", many}},
          "/component_limits: found 17 parts, expected a list of at most 16 parts, [{ ... }]");
  refuses({{"/component_limits", Json::array({1})}}, "/component_limits/0: found 1, expected an object, { ... }");
  refuses({{"/component_limits", Json::array({fuse, fuse})}},
          "/component_limits/1/name: found \"main fuse\", expected a name no other part has");
  refuses({{"/component_limits", Json::array({{{"name", "fuse"}}})}},
          "/component_limits/0: found {\"name\":\"fuse\"}, expected a rated current");
  refuses({{"/component_limits", Json::array({{{"charge_peak_mA", 1}}})}},
          "/component_limits/0/name: missing, expected this required key");
  refuses({{"/component_limits", Json::array({changed(fuse, {{"/discharge_peak_mA", 54'999}})})}},
          "/component_limits/0/discharge_continuous_mA: found 55000, expected at most discharge_peak_mA, 54999");
  CHECK(core_of({{"/component_limits", Json::array({changed(fuse, {{"/discharge_peak_mA", 55'000}})})}})
            .component_limits.size() == 1);
}

TEST_CASE("the user wants no more than the pack carries", "[unit][config][parts]") {
  CHECK(core_of({}).user_limits.discharge_peak_mA == 0);
  const CoreConfig core = core_of({{"/user_limits", {{"discharge_continuous_mA", 60'000}}}});
  CHECK(core.user_limits.discharge_continuous_mA == 60'000);
  CHECK(core.user_limits.discharge_peak_mA == 60'000);
  CHECK(core.user_limits.charge_peak_mA == 0);
  refuses(
      {{"/user_limits", {{"discharge_continuous_mA", 60'001}}}},
      "/user_limits/discharge_continuous_mA: found 60001, expected at most discharge_continuous_mA of current, 60000");
  refuses({{"/user_limits", {{"discharge_peak_mA", 80'001}}}},
          "/user_limits/discharge_peak_mA: found 80001, expected at most discharge_peak_mA of current, 80000");
  refuses({{"/user_limits", {{"charge_continuous_mA", 20'001}}}},
          "/user_limits/charge_continuous_mA: found 20001, expected at most charge_continuous_mA of current, 20000");
  refuses({{"/user_limits", {{"charge_peak_mA", 24'001}}}, {"/current/charge_peak_mA", 24'000}},
          "/user_limits/charge_peak_mA: found 24001, expected at most charge_peak_mA of current, 24000");
  refuses({{"/user_limits", {{"charge_peak_mA", 9'000}, {"charge_continuous_mA", 9'001}}}},
          "/user_limits/charge_continuous_mA: found 9001, expected at most charge_peak_mA, 9000");
}

TEST_CASE("a limp-home floor is asked for, and no more than the continuous current", "[unit][config][limp_home]") {
  CHECK(core_of({}).current.limp_home_discharge_mA == 0);
  CHECK(core_of({{"/current/limp_home_discharge_mA", 60'000}}).current.limp_home_discharge_mA == 60'000);
  refuses({{"/current/limp_home_discharge_mA", 60'001}},
          "/current/limp_home_discharge_mA: found 60001, expected at most discharge_continuous_mA, 60000");
}

TEST_CASE("rules of the whole pack are none unless the file has them", "[unit][config][POW_1]") {
  CHECK(core_of({}).pack_limits.power_max_W == 0);
  CHECK(core_of({}).pack_limits.voltage_max_V == 0);
  const PackLimitsConfig rules =
      core_of({{"/pack_limits", {{"power_max_W", 80'000}, {"voltage_max_V", 600}}}}).pack_limits;
  CHECK(rules.power_max_W == 80'000);
  CHECK(rules.voltage_max_V == 600);
}

TEST_CASE("a pack whose full voltage is above what rules allow is refused", "[unit][config][POW_1]") {
  // 48 cells that open at 4.23 V: 203.04 V.
  CHECK(core_of({{"/pack_limits/voltage_max_V", 204}}).pack_limits.voltage_max_V == 204);
  refuses({{"/pack_limits/voltage_max_V", 203}},
          "/pack_limits/voltage_max_V: found 203, expected at least 203.04, which 48 cells have at open_mV of "
          "cell_overvoltage");
}

TEST_CASE("the intake air is what the file says of the source that it names", "[unit][config][AIR_1]") {
  CHECK(core_of({}).intake_air.source == AirSource::none);
  const IntakeAirConfig module =
      core_of({{"/intake_air", {{"source", "module"}, {"module", 3}, {"sensor", 4}}}}).intake_air;
  CHECK(module.source == AirSource::module);
  CHECK(module.node == 3);
  CHECK(module.sensor == 4);
  const std::string file = "/sys/bus/iio/devices/iio:device0/in_temp_input";
  const IntakeAirConfig of_file =
      core_of({{"/intake_air", {{"source", "file"}, {"file", file}, {"age_max_ms", 5'000}}}}).intake_air;
  CHECK(of_file.source == AirSource::file);
  CHECK(of_file.age_max == 5s);
  refuses({{"/intake_air", {{"source", "module"}}}},
          "/intake_air/module: found 0, expected the node number of a module of this pack");
  refuses({{"/intake_air", {{"source", "module"}, {"module", 9}}}},
          "/intake_air/module: found 9, expected the node number of a module of this pack");
  refuses({{"/intake_air", {{"source", "pdu"}, {"module", 1}}}},
          "/intake_air/module: found 1, expected 0, as the source is not module");
  refuses({{"/intake_air", {{"source", "file"}}}}, "/intake_air/file: missing, expected a path, as the source is file");
  refuses({{"/intake_air", {{"source", "pdu"}, {"file", file}}}},
          "/intake_air/file: found \"" + file + "\", expected nothing, as the source is not file");
}

TEST_CASE("ramps are what the file says, or all in a quarter of a second down and in ten seconds up",
          "[unit][config][ramp]") {
  LimitRampConfig ramp = core_of({}).limit_ramp;
  CHECK(ramp.discharge_fall_mA_per_s == 320'000);
  CHECK(ramp.discharge_rise_mA_per_s == 8'000);
  CHECK(ramp.charge_fall_mA_per_s == 100'000);  // the omitted peak defaults to the warning, 25 A
  CHECK(ramp.charge_rise_mA_per_s == 2'500);
  ramp = core_of({{"/limit_ramp",
                   {{"discharge_fall_A_per_s", 12.5},
                    {"discharge_rise_A_per_s", 1},
                    {"charge_fall_A_per_s", 2.5},
                    {"charge_rise_A_per_s", 0.125}}}})
             .limit_ramp;
  CHECK(ramp.discharge_fall_mA_per_s == 12'500);
  CHECK(ramp.discharge_rise_mA_per_s == 1'000);
  CHECK(ramp.charge_fall_mA_per_s == 2'500);
  CHECK(ramp.charge_rise_mA_per_s == 125);
}

TEST_CASE("a limit that could not be gone within the foreseen time is refused", "[unit][config][ramp]") {
  const std::string gone = ", so that all that may flow is gone in the 10 s that voltages are foreseen";
  refuses({{"/limit_ramp", {{"charge_fall_A_per_s", 2.499}}}},
          "/limit_ramp/charge_fall_A_per_s: found 2.499, expected at least 2.5" + gone);
  refuses({{"/limit_ramp", {{"discharge_fall_A_per_s", 0.001}}}},
          "/limit_ramp/discharge_fall_A_per_s: found 0.001, expected at least 8" + gone);
}

TEST_CASE("a pause to measure that could never come is refused", "[unit][config][charge_pause]") {
  CHECK(core_of({{"/soc", {{"resistance_pause_permille", 0}}}}).soc.resistance_pause_permille == 0);
  CHECK(core_of({{"/soc", {{"resistance_pause_permille", 50}}}}).soc.resistance_pause_permille == 50);
  refuses({{"/soc", {{"resistance_pause_permille", 49}}}},
          "/soc/resistance_pause_permille: found 49, expected 0, or at least 50: a pause is only made after the charge "
          "has been so far below");
}

}  // namespace
}  // namespace bmu

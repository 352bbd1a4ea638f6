// Cell file: measured tables, alone and in a pack file, and the round trip of writing and reading.
#include "config/cell_file/cell_config.hpp"

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "config/cell_file/cell_file_writer.hpp"
#include "config/pack_config.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/folders.hpp"

namespace bmu {
namespace {

using Json = nlohmann::json;
using Change = std::pair<std::string, Json>;  // JSON pointer, value

const std::filesystem::path config_directory = test::in_source("config");
const std::filesystem::path cell_file = config_directory / "cells/nmc-3000.json";

Json json_of(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  REQUIRE(stream);
  return Json::parse(stream, nullptr, true, true);
}

/// Evenly spaced numbers.
std::vector<double> ramp(std::size_t count, double from, double step) {
  std::vector<double> numbers;
  for (std::size_t index = 0; index < count; ++index) numbers.push_back(from + step * static_cast<double>(index));
  return numbers;
}

Json row_at(double temperature_C) {
  return {{"temperature_C", temperature_C},
          {"exchange_current_A", 1.4},
          {"ocv_mV", ramp(51, 3'000, 24.5)},
          {"hysteresis_mV", ramp(21, 10, -0.25)},
          {"series_mOhm", ramp(21, 12, 0.5)},
          {"kinetic_mOhm", ramp(21, 20, -0.125)},
          {"pair_mOhm", {ramp(21, 3, 0.25), ramp(21, 5, 0.25), ramp(21, 7, 0.25)}},
          {"slow_error_mV", 2},
          {"slow_error_time_s", 1'500},
          {"fast_error_mV", 4},
          {"fast_error_time_s", 20}};
}

/// Shipped cell, with tables at two temperatures.
Json measured_cell() {
  Json cell = json_of(cell_file);
  cell["dynamics"] = {{"pair_time_constants_s", {6, 60, 350}},
                      {"activation_K", 4'000},
                      {"hysteresis_charge_permille", 30},
                      {"charge_efficiency", 0.998},
                      {"rows", {row_at(-10), row_at(25)}}};
  return cell;
}

Json changed(const std::vector<Change>& changes) {
  Json cell = measured_cell();
  for (const auto& [pointer, value] : changes) cell[Json::json_pointer(pointer)] = value;
  return cell;
}

Json without(const std::string& parent, const std::string& key) {
  Json cell = measured_cell();
  cell[Json::json_pointer(parent)].erase(key);
  return cell;
}

std::string all_text(const ConfigProblems& problems) {
  std::string text;
  for (const ConfigProblem& problem : problems) text += to_text(problem) + "\n";
  return text;
}

/// Parses a cell file that must be valid.
CellFile cell_of(const std::string& text) {
  const auto cell = parse_cell_file(text, "cell.json");
  INFO((cell ? "" : all_text(cell.error())));
  REQUIRE(cell);
  return *cell;
}

/// Requires exactly one error with this text.
void refuses_cell(const Json& cell, const std::string& problem) {
  const auto read = parse_cell_file(cell.dump(), "cell.json");
  REQUIRE_FALSE(read);
  CHECK(all_text(read.error()) == problem + "\n");
}

void refuses(const std::vector<Change>& changes, const std::string& problem) {
  refuses_cell(changed(changes), problem);
}

void accepts(const std::vector<Change>& changes) {
  const auto read = parse_cell_file(changed(changes).dump(), "cell.json");
  INFO((read ? "" : all_text(read.error())));
  CHECK(read);
}

// --- reading --------------------------------------------------------------------------------------------------------

TEST_CASE("every cell that is shipped loads by itself", "[unit][config]") {
  for (const auto& entry : std::filesystem::directory_iterator(config_directory / "cells")) {
    const auto cell = load_cell_file(entry.path());
    INFO((cell ? entry.path().string() : all_text(cell.error())));
    REQUIRE(cell);
    CHECK_FALSE(cell->name.empty());
    CHECK(cell->model.ocv.size() >= 2);
  }
}

TEST_CASE("a cell without measured tables has none", "[unit][config]") {
  const CellFile cell = cell_of(json_of(cell_file).dump());
  CHECK_FALSE(cell.dynamics);
  CHECK(cell.model.capacity_uAs == 3 * std::int64_t{3'600'000'000});
}

TEST_CASE("what holds for all temperatures arrives in the units of the core", "[unit][config]") {
  const CellFile cell = cell_of(measured_cell().dump());
  REQUIRE(cell.dynamics);
  const CellDynamics& dynamics = *cell.dynamics;
  CHECK(dynamics.pair_time_constant_s == std::array{6.0, 60.0, 350.0});
  CHECK(dynamics.activation_K == 4'000.0);
  CHECK(dynamics.hysteresis_charge == Approx(0.03));
  CHECK(dynamics.charge_efficiency == 0.998);
  // These values come from the cell file itself.
  CHECK(dynamics.capacity_As == Approx(3 * 3'600));
  CHECK(dynamics.self_discharge_per_month == Approx(cell.model.self_discharge_permille_per_month / 1'000));
}

TEST_CASE("the tables of each temperature arrive in the units of the core", "[unit][config]") {
  const CellFile cell = cell_of(measured_cell().dump());
  REQUIRE(cell.dynamics);
  REQUIRE(cell.dynamics->rows.size() == 2);
  CHECK(cell.dynamics->rows[0].temperature_C == -10.0);
  const CellDynamics::Row& row = cell.dynamics->rows[1];
  CHECK(row.temperature_C == 25.0);
  CHECK(row.exchange_current_A == 1.4);
  CHECK(row.ocv_V.front() == Approx(3.0));
  CHECK(row.ocv_V.back() == Approx(4.225));
  CHECK(row.hysteresis_V.back() == Approx(0.005));
  CHECK(row.series_Ohm[1] == Approx(0.0125));
  CHECK(row.kinetic_Ohm.front() == Approx(0.02));
  CHECK(row.pair_Ohm[0].front() == Approx(0.003));
  CHECK(row.pair_Ohm[2].back() == Approx(0.012));
  CHECK(row.slow_error_V == Approx(0.002));
  CHECK(row.slow_error_time_s == 1'500.0);
  CHECK(row.fast_error_V == Approx(0.004));
  CHECK(row.fast_error_time_s == 20.0);
}

TEST_CASE("one to eight temperatures are enough", "[unit][config]") {
  Json rows = Json::array();
  for (int count = 1; count <= 8; ++count) {
    rows.push_back(row_at(10.0 * count));
    CHECK(cell_of(changed({{"/dynamics/rows", rows}}).dump()).dynamics->rows.size() == rows.size());
  }
  rows.push_back(row_at(90));
  refuses({{"/dynamics/rows", rows}},
          "cell.json: /dynamics/rows: found 9 rows, expected a list of 1 to 8 rows, one for each temperature");
}

TEST_CASE("the measured curve need not end where the table of the file does", "[unit][config]") {
  accepts({{"/dynamics/rows/1/ocv_mV/0", 2'000}, {"/dynamics/rows/1/ocv_mV/50", 5'000}});
}

// --- rejected files -------------------------------------------------------------------------------------------------

TEST_CASE("every key of the measured tables is required", "[unit][config]") {
  for (const std::string parent : {"/dynamics", "/dynamics/rows/1"}) {
    const Json object = measured_cell().at(Json::json_pointer(parent));
    for (const auto& [key, value] : object.items()) {
      CAPTURE(key);
      refuses_cell(without(parent, key), "cell.json: " + parent + "/" + key + ": missing, expected this required key");
    }
  }
}

TEST_CASE("a key that measured tables do not have is refused", "[unit][config]") {
  refuses({{"/dynamics/row", 1}},
          "cell.json: /dynamics/row: found an unknown key, expected a known key; did you mean \"rows\"?");
  refuses({{"/dynamics/rows/0/series_Ohm", 1}},
          "cell.json: /dynamics/rows/0/series_Ohm: found an unknown key, expected a known key; did you mean "
          "\"series_mOhm\"?");
}

TEST_CASE("measured tables of the wrong kind are refused", "[unit][config]") {
  refuses({{"/dynamics", 1}}, "cell.json: /dynamics: found 1, expected an object, { ... }");
  refuses({{"/dynamics/rows", "none"}},
          "cell.json: /dynamics/rows: found \"none\", expected a list of 1 to 8 rows, one for each temperature");
  refuses({{"/dynamics/rows", Json::array()}},
          "cell.json: /dynamics/rows: found 0 rows, expected a list of 1 to 8 rows, one for each temperature");
  refuses({{"/dynamics/rows/0", 1}}, "cell.json: /dynamics/rows/0: found 1, expected an object, { ... }");
  refuses({{"/dynamics/rows/0/ocv_mV", 3'600}},
          "cell.json: /dynamics/rows/0/ocv_mV: found 3600, expected a list of 51 numbers, one at every 20 permille of "
          "charge, from empty to full");
  refuses({{"/dynamics/rows/0/pair_mOhm/1", 3}},
          "cell.json: /dynamics/rows/0/pair_mOhm/1: found 3, expected a list of 21 numbers");
}

TEST_CASE("a list of the wrong length is refused with what its numbers are for", "[unit][config]") {
  refuses({{"/dynamics/rows/0/ocv_mV", ramp(50, 3'000, 20)}},
          "cell.json: /dynamics/rows/0/ocv_mV: found 50 numbers, expected 51, one at every 20 permille of charge, from "
          "empty to full");
  refuses({{"/dynamics/rows/1/series_mOhm", ramp(51, 10, 0)}},
          "cell.json: /dynamics/rows/1/series_mOhm: found 51 numbers, expected 21, one at every 50 permille of charge, "
          "from empty to full");
  refuses({{"/dynamics/pair_time_constants_s", {6, 60}}},
          "cell.json: /dynamics/pair_time_constants_s: found 2 numbers, expected 3, one for each pair");
  refuses({{"/dynamics/rows/0/pair_mOhm", {ramp(21, 1, 0), ramp(21, 1, 0)}}},
          "cell.json: /dynamics/rows/0/pair_mOhm: found 2 lists, expected 3, one for each pair");
  refuses({{"/dynamics/rows/0/pair_mOhm/2", ramp(20, 1, 0)}},
          "cell.json: /dynamics/rows/0/pair_mOhm/2: found 20 numbers, expected 21");
}

TEST_CASE("what is no number in a list is refused where it stands", "[unit][config]") {
  refuses({{"/dynamics/rows/0/ocv_mV/7", "3300"}},
          "cell.json: /dynamics/rows/0/ocv_mV/7: found \"3300\", expected a number from 500 to 6000");
  refuses({{"/dynamics/rows/0/pair_mOhm/1/20", nullptr}},
          "cell.json: /dynamics/rows/0/pair_mOhm/1/20: found null, expected a number from 0 to 100000");
}

struct RangeCase {
  std::string path;
  double min;
  double max;
  std::string wanted;
};

/// Ranges of values that no other rule restricts; the lists that must rise are tested at their ends below.
const std::vector<RangeCase> ranges{{"/dynamics/activation_K", 0, 10'000, "from 0 to 10000"},
                                    {"/dynamics/hysteresis_charge_permille", 1, 1'000, "from 1 to 1000"},
                                    {"/dynamics/charge_efficiency", 0.5, 1, "from 0.5 to 1"},
                                    {"/dynamics/rows/1/temperature_C", -9, 150, ""},
                                    {"/dynamics/rows/1/exchange_current_A", 0.0001, 1e6, "from 0.0001 to 1000000"},
                                    {"/dynamics/rows/1/slow_error_mV", 0.1, 1'000, "from 0.1 to 1000"},
                                    {"/dynamics/rows/1/slow_error_time_s", 0.1, 100'000, "from 0.1 to 100000"},
                                    {"/dynamics/rows/1/fast_error_mV", 0, 1'000, "from 0 to 1000"},
                                    {"/dynamics/rows/1/fast_error_time_s", 0.1, 100'000, "from 0.1 to 100000"},
                                    {"/dynamics/rows/1/hysteresis_mV/3", 0, 200, "from 0 to 200"},
                                    {"/dynamics/rows/1/series_mOhm/3", 0.001, 100'000, "from 0.001 to 100000"},
                                    {"/dynamics/rows/1/kinetic_mOhm/3", 0, 100'000, "from 0 to 100000"},
                                    {"/dynamics/rows/1/pair_mOhm/0/3", 0, 100'000, "from 0 to 100000"}};

TEST_CASE("measured numbers reach the ends of their ranges and do not pass them", "[unit][config]") {
  for (const RangeCase& range : ranges) {
    CAPTURE(range.path);
    accepts({{range.path, range.min}});
    accepts({{range.path, range.max}});
    if (range.wanted.empty()) continue;
    for (const double beyond : {std::nextafter(range.min, -1e9), range.max + 0.5}) {
      refuses({{range.path, beyond}},
              "cell.json: " + range.path + ": found " + Json(beyond).dump() + ", expected a number " + range.wanted);
    }
  }
}

TEST_CASE("what rises keeps to its range as well", "[unit][config]") {
  accepts({{"/dynamics/rows/0/temperature_C", -60}, {"/dynamics/rows/1/temperature_C", 150}});
  refuses({{"/dynamics/rows/0/temperature_C", -60.5}},
          "cell.json: /dynamics/rows/0/temperature_C: found -60.5, expected a number from -60 to 150");
  accepts({{"/dynamics/rows/0/ocv_mV/0", 500}, {"/dynamics/rows/0/ocv_mV/50", 6'000}});
  refuses({{"/dynamics/rows/0/ocv_mV/0", 499}},
          "cell.json: /dynamics/rows/0/ocv_mV/0: found 499, expected a number from 500 to 6000");
  accepts({{"/dynamics/pair_time_constants_s", {0.1, 1, 100'000}}});
  refuses({{"/dynamics/pair_time_constants_s", {0, 1, 2}}},
          "cell.json: /dynamics/pair_time_constants_s/0: found 0, expected a number from 0.1 to 100000");
}

TEST_CASE("curve, time constants and temperatures rise", "[unit][config]") {
  refuses({{"/dynamics/rows/0/ocv_mV/7", 3'147}},
          "cell.json: /dynamics/rows/0/ocv_mV/7: found 3147, expected more than the number before, 3147");
  refuses({{"/dynamics/pair_time_constants_s", {6, 60, 59}}},
          "cell.json: /dynamics/pair_time_constants_s/2: found 59, expected more than the number before, 60");
  refuses({{"/dynamics/rows/0/temperature_C", 25}},
          "cell.json: /dynamics/rows/1/temperature_C: found 25, expected more than in the row before, 25");
}

TEST_CASE("one mistake in the measured tables is one problem, several are told at once", "[unit][config]") {
  // A curve with one invalid point is not reported as not rising, nor is the row after an invalid temperature.
  refuses({{"/dynamics/rows/0/ocv_mV/7", 10'000}},
          "cell.json: /dynamics/rows/0/ocv_mV/7: found 10000, expected a number from 500 to 6000");
  refuses({{"/dynamics/rows/0/temperature_C", 151}},
          "cell.json: /dynamics/rows/0/temperature_C: found 151, expected a number from -60 to 150");
  refuses({{"/capacity_Ah", -1}}, "cell.json: /capacity_Ah: found -1, expected a number from 0.01 to 10000");
  const auto read = parse_cell_file(changed({{"/dynamics/activation_K", -1},
                                             {"/dynamics/rows/0/series_mOhm/0", 0},
                                             {"/dynamics/rows/0/series_mOhm/1", 0},
                                             {"/voltage_min_mV", 4'250}})
                                        .dump(),
                                    "cell.json");
  REQUIRE_FALSE(read);
  CHECK(read.error().size() == 4);
}

TEST_CASE("a cell file by itself is checked as with a pack", "[unit][config]") {
  refuses({{"/voltage_min_mV", 3'100}},
          "cell.json: /ocv: found 3000 to 4180 mV, expected from voltage_min_mV, 3100, to voltage_max_mV, 4250");
  refuses_cell(Json::array(), "cell.json: found [], expected an object, { ... }");
  const auto broken = parse_cell_file("{\n\"name\": \n}", "cell.json");
  REQUIRE_FALSE(broken);
  CHECK(all_text(broken.error()).find("cell.json:3:1: found a syntax error") == 0);
  const std::string missing = (config_directory / "cells/missing.json").string();
  const auto unread = load_cell_file(missing);
  REQUIRE_FALSE(unread);
  CHECK(all_text(unread.error()) == missing + ": found no such file, expected a readable file of at most 1 MiB\n");
}

TEST_CASE("measured tables within a pack are told of with their whole path", "[unit][config]") {
  Json pack = json_of(config_directory / "packs/demo-48s.json");
  pack["cell"] = json_of(config_directory / "cells/nmc-30ah-10p.json");
  pack["cell"]["dynamics"] = measured_cell().at("dynamics");
  CHECK(parse_pack_config(pack.dump(), "pack.json", {}));
  pack["cell"]["dynamics"]["rows"][1]["kinetic_mOhm"][20] = -1;
  const auto read = parse_pack_config(pack.dump(), "pack.json", {});
  REQUIRE_FALSE(read);
  CHECK(all_text(read.error()) ==
        "pack.json: /cell/dynamics/rows/1/kinetic_mOhm/20: found -1, expected a number from 0 to 100000\n");
}

// --- writing --------------------------------------------------------------------------------------------------------

/// Compares both as trees, numbers with a tolerance.
void same(const Json& one, const Json& other, double tolerance) {
  const Json flat = one.flatten();
  const Json other_flat = other.flatten();
  REQUIRE(flat.size() == other_flat.size());
  for (const auto& [path, value] : flat.items()) {
    CAPTURE(path);
    REQUIRE(other_flat.contains(path));
    if (value.is_number()) {
      CHECK(value.get<double>() == Approx(other_flat.at(path).get<double>()).margin(tolerance));
    } else {
      CHECK(value == other_flat.at(path));
    }
  }
}

TEST_CASE("every cell that is shipped is written as it was read", "[unit][config]") {
  for (const auto& entry : std::filesystem::directory_iterator(config_directory / "cells")) {
    CAPTURE(entry.path().string());
    Json file = json_of(entry.path());
    const auto cell = load_cell_file(entry.path());
    REQUIRE(cell);
    same(Json::parse(cell_file_text(*cell)), file, 1e-9);
  }
}

TEST_CASE("measured tables are written as they were read", "[unit][config]") {
  const Json file = measured_cell();
  const std::string text = cell_file_text(cell_of(file.dump()));
  same(Json::parse(text), file, 1e-9);
  CHECK(cell_file_text(cell_of(text)) == text);
}

TEST_CASE("numbers are written with the digits that matter", "[unit][config]") {
  CellFile cell = cell_of(measured_cell().dump());
  CellDynamics::Row& row = cell.dynamics->rows[1];
  row.ocv_V[3] = 3.073'504'9;
  row.series_Ohm[3] = 0.013'499'6;
  row.pair_Ohm[1][3] = 1e-9;
  row.slow_error_V = 0.001'234'5;
  cell.dynamics->pair_time_constant_s[0] = 6.000'49;
  cell.model.ocv[1].ocv_uV = 3'299'999;
  cell.model.series_resistance_Ohm = 0.019'999'9;
  const Json file = Json::parse(cell_file_text(cell));
  CHECK(file.at("/dynamics/rows/1/ocv_mV/3"_json_pointer).dump() == "3073.5");
  CHECK(file.at("/dynamics/rows/1/series_mOhm/3"_json_pointer).dump() == "13.5");
  CHECK(file.at("/dynamics/rows/1/pair_mOhm/1/3"_json_pointer).dump() == "0");
  CHECK(file.at("/dynamics/rows/1/slow_error_mV"_json_pointer).dump() == "1.23");
  CHECK(file.at("/dynamics/pair_time_constants_s/0"_json_pointer).dump() == "6");
  CHECK(file.at("/ocv/1/1"_json_pointer).dump() == "3299.999");
  CHECK(file.at("/series_resistance_mOhm"_json_pointer).dump() == "20");
}

TEST_CASE("a curve that is level to the last digit is written as one that rises", "[unit][config]") {
  CellFile cell = cell_of(measured_cell().dump());
  auto& ocv_V = cell.dynamics->rows[0].ocv_V;
  for (std::size_t point = 10; point < 14; ++point) ocv_V[point] = 3.3 + 1e-9 * static_cast<double>(point);
  const CellFile again = cell_of(cell_file_text(cell));
  for (std::size_t point = 10; point < 14; ++point) {
    CAPTURE(point);
    CHECK(again.dynamics->rows[0].ocv_V[point] == Approx(3.3 + 1e-5 * static_cast<double>(point - 10)).margin(1e-9));
  }
}

TEST_CASE("a cell file is written for people: keys in order, a list on a line", "[unit][config]") {
  CellFile cell = cell_of(measured_cell().dump());
  cell.name = "A \"cell\"\n\xC3\xA4";
  const std::string text = cell_file_text(cell);
  CHECK(text.find("{\n  \"name\": \"A \\\"cell\\\"\\n\xC3\xA4\",\n  \"origin\": \"") == 0);
  CHECK(text.find("\n  \"capacity_Ah\": 3,\n  \"series_resistance_mOhm\": ") != std::string::npos);
  CHECK(text.find("\n  \"ocv\": [\n    [0, 3000],\n    [20, ") != std::string::npos);
  CHECK(text.find("\n  \"dynamics\": {\n    \"activation_K\": 4000,\n") != std::string::npos);
  CHECK(text.find("\n    \"pair_time_constants_s\": [6, 60, 350],\n    \"rows\": [\n      {\n        "
                  "\"temperature_C\": -10,\n") != std::string::npos);
  CHECK(text.find("\n        \"ocv_mV\": [3000, 3024.5, 3049, ") != std::string::npos);
  CHECK(text.find("\n        \"pair_mOhm\": [\n          [3, 3.25, ") != std::string::npos);
  CHECK(text.ends_with("12]\n        ]\n      }\n    ]\n  }\n}\n"));
}

}  // namespace
}  // namespace bmu

// Section `charge_plateau` of a cell file.
#include <filesystem>
#include <fstream>
#include <string>

#include <nlohmann/json.hpp>

#include "config/cell_file/cell_config.hpp"
#include "config/cell_file/cell_file_writer.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/folders.hpp"

namespace bmu {
namespace {

using Json = nlohmann::json;

Json cell_with(const Json& plateau) {
  std::ifstream stream(test::in_source("config/cells/nmc-3000.json"), std::ios::binary);
  REQUIRE(stream);
  Json cell = Json::parse(stream, nullptr, true, true);
  cell["charge_plateau"] = plateau;
  return cell;
}

Json good() {
  return {
      {"plateau_weight_permille", 2'412.5}, {"above_weight_permille", 1'093}, {"sigma_Ah", 0.03}, {"current_A", 1.5},
      {"full_voltage_mV", 4'200},           {"end_current_A", 0.02}};
}

std::string problem(const std::string& key, const Json& value) {
  Json plateau = good();
  if (value.is_null()) {
    plateau.erase(key);
  } else {
    plateau[key] = value;
  }
  const auto cell = parse_cell_file(cell_with(plateau).dump(), "cell.json");
  if (cell) return "none";
  std::string text;
  for (const ConfigProblem& one : cell.error()) text += to_text(one) + "\n";
  return text;
}

}  // namespace

TEST_CASE("what a whole charge says arrives as it is written, and is written as it was read", "[unit][config]") {
  const auto cell = parse_cell_file(cell_with(good()).dump(), "cell.json");
  REQUIRE(cell);
  REQUIRE(cell->charge_plateau);
  const ChargePlateauModel& model = *cell->charge_plateau;
  CHECK(model.plateau_weight == Approx(2.4125));
  CHECK(model.above_weight == Approx(1.093));
  CHECK(model.sigma_As == Approx(108.0));
  CHECK(model.current_A == Approx(1.5));
  CHECK(model.full_voltage_V == Approx(4.2));
  CHECK(model.end_current_A == Approx(0.02));
  CHECK(model.temperature_min_C == 15.0);
  CHECK(model.temperature_max_C == 40.0);
  const auto again = parse_cell_file(cell_file_text(*cell), "again.json");
  REQUIRE(again);
  REQUIRE(again->charge_plateau);
  CHECK(again->charge_plateau->plateau_weight == Approx(model.plateau_weight));
  CHECK(again->charge_plateau->sigma_As == Approx(model.sigma_As));
  CHECK(again->charge_plateau->full_voltage_V == Approx(model.full_voltage_V));
}

TEST_CASE("it may be left out", "[unit][config]") {
  Json plain = cell_with(good());
  plain.erase("charge_plateau");
  const auto cell = parse_cell_file(plain.dump(), "cell.json");
  REQUIRE(cell);
  CHECK_FALSE(cell->charge_plateau);
  CHECK(cell_file_text(*cell).find("charge_plateau") == std::string::npos);
}

TEST_CASE("what is wrong in it is named with its place", "[unit][config]") {
  CHECK(problem("sigma_Ah", 0.03) == "none");
  CHECK(problem("sigma_Ah", nullptr).find("/charge_plateau") != std::string::npos);
  CHECK(problem("sigma_Ah", 0).find("/charge_plateau/sigma_Ah") != std::string::npos);
  CHECK(problem("speed", 1).find("/charge_plateau") != std::string::npos);
  CHECK(problem("current_A", 0.02) ==
        "cell.json: /charge_plateau/end_current_A: found 0.02, expected less than current_A, 0.02\n");
  CHECK(problem("temperature_min_C", 40) ==
        "cell.json: /charge_plateau/temperature_min_C: found 40, expected less than temperature_max_C, 40\n");
  const auto none = parse_cell_file(cell_with(5).dump(), "cell.json");
  REQUIRE_FALSE(none);
}

}  // namespace bmu

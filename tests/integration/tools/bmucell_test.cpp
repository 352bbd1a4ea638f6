// bmucell as run by a user: cell files fitted and scored from the command line, and its error messages.
#include <algorithm>
#include <filesystem>
#include <string>

#include <nlohmann/json.hpp>

#include "config/cell_file/cell_config.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/cell_bench.hpp"
#include "tests/support/folders.hpp"
#include "tests/support/process.hpp"

namespace bmu {

namespace {

const std::string recording = test::in_source("tests/recordings/lfp_1200_T25.csv.gz");
const std::string shipped_cell = test::in_source("config/cells/lfp-1200.json");

Finished bmucell(std::vector<std::string> words) {
  words.insert(words.begin(), program("bmucell"));
  return run_program(words);
}

/// With a current sensor error of 2 % and half a percent of the 1C current, and a start 10 % low.
std::vector<std::string> scored_as_usual(const std::string& cell) {
  return {"eval",  "--cell",      cell,  "--sensor-gain", "1.02", "--sensor-offset-A",
          "0.006", "--soc-error", "-10", "--json"};
}

}  // namespace

TEST_CASE("the shipped cell file of a recorded cell estimates it as well as it is said to", "[integration][bmucell]") {
  for (const std::string estimator : {"ekf", "mixed", "coulomb"}) {
    std::vector<std::string> words = scored_as_usual(shipped_cell);
    words.insert(words.end(), {"--estimator", estimator, recording});
    const Finished finished = bmucell(words);
    INFO(finished.err);
    REQUIRE(finished.status == 0);
    const auto json = nlohmann::json::parse(finished.out);
    REQUIRE(json.at("files").size() == 1);
    const auto& file = json.at("files")[0];
    CHECK(file.at("file") == recording);
    CHECK(file.at("estimator") == estimator);
    CHECK(file.at("rows") == 17663);
    CHECK(json.at("mean").at("rmse_pct") == file.at("rmse_pct"));
    const double after_20min_pct = file.at("rmse_after_20min_pct");
    if (estimator == "ekf") {
      CHECK(after_20min_pct < 1.0);
      CHECK(file.at("max_after_20min_pct") < 2.5);
      CHECK(file.at("settle_3pct_s") < 1200);
      CHECK(file.at("inside_uncertainty_pct") > 90.0);
    } else {
      CHECK(after_20min_pct > 3.0);  // the purpose of the filter
    }
  }
}

TEST_CASE("a fit writes a cell file that can be scored at once, and a picture", "[integration][bmucell]") {
  const TemporaryFolder folder;
  const std::string cell = folder / "cell.json";
  const Finished fitted =
      bmucell({"fit", "--base", test::in_source("config/cells/lfp-100ah.json"), "--name", "a cell", "--capacity-Ah",
               "1.2", "--out", cell, "--svg", folder / "cell.svg", "--json", recording});
  INFO(fitted.err);
  REQUIRE(fitted.status == 0);
  const auto quality = nlohmann::json::parse(fitted.out);
  CHECK(quality.at("files")[0].at("rows") == 17663);
  CHECK(quality.at("files")[0].at("rmse_mV") < 3.0);
  CHECK(quality.at("temperatures_C") == std::vector<double>{25.0});
  const auto file = nlohmann::json::parse(read_file(cell));
  CHECK(file.at("name") == "a cell");
  CHECK(file.at("capacity_Ah") == 1.2);
  CHECK(file.at("origin") == "fitted to lfp_1200_T25.csv.gz");
  CHECK(read_file(folder / "cell.svg").find("Open-circuit voltage") != std::string::npos);
  std::vector<std::string> words = scored_as_usual(cell);
  words.insert(words.end(), {"--csv", folder / "trace.csv", "--svg", folder / "trace.svg", recording});
  const Finished scored = bmucell(words);
  INFO(scored.err);
  REQUIRE(scored.status == 0);
  CHECK(nlohmann::json::parse(scored.out).at("mean").at("rmse_after_20min_pct") < 1.0);
  const std::string trace = read_file(folder / "trace.csv");
  CHECK(trace.starts_with("time_s,current_A,voltage_V,temp_C,ref_soc_pct,soc_pct,sigma_pct\n"));
  CHECK(std::count(trace.begin(), trace.end(), '\n') == 17664);
  CHECK(read_file(folder / "trace.svg").find("estimate minus reference") != std::string::npos);
}

TEST_CASE("without --out the cell file goes to standard output and the summary does not", "[integration][bmucell]") {
  const Finished finished = bmucell({"fit", "--base", shipped_cell, recording});
  REQUIRE(finished.status == 0);
  CHECK(nlohmann::json::parse(finished.out).contains("dynamics"));
  CHECK(finished.err.find("what the model is off by") != std::string::npos);
}

namespace {

/// Charges with a plateau of a cell that loses a percent each time, and capacity tests with the charge that flowed.
void write_ageing_cell(const TemporaryFolder& folder) {
  std::string charges = "cycle,time_s,current_A,voltage_V,temp_C\n";
  std::string tests = "cycle,capacity_Ah,charges_before\n";
  for (int cycle = 1; cycle <= 12; ++cycle) {
    const double share = 1.0 - 0.01 * cycle;
    double voltage_V = 3.6;
    double charged_Ah = 0.0;
    int time_s = 0;
    const auto add = [&](double current_A, double rise_V) {
      time_s += 30;
      voltage_V += rise_V;
      charged_Ah += current_A * 30.0 / 3600.0;
      charges += std::to_string(cycle) + "," + std::to_string(time_s) + "," + std::to_string(-current_A) + "," +
                 std::to_string(voltage_V) + ",25\n";
    };
    for (int step = 0; step < 7; ++step) add(1.5, 0.0);
    while (voltage_V < 3.8) add(1.5, 0.01 / share);
    while (voltage_V < 3.9) add(1.5, 0.0041 / share);
    while (voltage_V < 4.19) add(1.5, 0.009 / share);
    for (const double current_A : {1.0, 0.5, 0.2, 0.05}) add(current_A, 0.0);
    tests += std::to_string(cycle) + "," + std::to_string(charged_Ah) + "," + std::to_string(cycle) + "\n";
  }
  static_cast<void>(folder.file("charges.csv", charges));
  static_cast<void>(folder.file("tests.csv", tests));
}

std::vector<std::string> health_of(const TemporaryFolder& folder, const std::vector<std::string>& more) {
  std::vector<std::string> words{"health", "--rated-Ah",      "1",  "--current-A", "1.5", "--full-voltage",
                                 "4.2",    "--end-current-A", "0.1"};
  words.insert(words.end(), more.begin(), more.end());
  words.insert(words.end(), {folder / "charges.csv", folder / "tests.csv"});
  return words;
}

}  // namespace

TEST_CASE("the capacity of an ageing cell is fitted, scored and drawn", "[integration][bmucell][FS_5]") {
  const TemporaryFolder folder;
  write_ageing_cell(folder);
  const std::vector<std::string> fitted{"--fit", folder / "charges.csv", "--fit-tests", folder / "tests.csv"};
  std::vector<std::string> more = fitted;
  more.insert(more.end(), {"--json", "--csv", folder / "trace.csv", "--svg", folder / "trace.svg"});
  const Finished finished = bmucell(health_of(folder, more));
  INFO(finished.err);
  REQUIRE(finished.status == 0);
  const auto json = nlohmann::json::parse(finished.out);
  CHECK(json.at("file") == folder / "charges.csv");
  CHECK(json.at("tests") == 12);
  CHECK(json.at("fit").at("charges") == 12);
  CHECK(json.at("single").at("tests") == 12);
  CHECK(json.at("single").at("rmse_pct") < 1.0);
  CHECK(json.at("all").at("rmse_pct") < 2.0);
  const std::string trace = read_file(folder / "trace.csv");
  CHECK(trace.starts_with("cycle,capacity_Ah,single_Ah,single_sigma_Ah,all_Ah,all_sigma_Ah\n"));
  CHECK(std::count(trace.begin(), trace.end(), '\n') == 13);
  CHECK(read_file(folder / "trace.svg").find("one charge") != std::string::npos);
  // The same weights, given on the command line, give the same result.
  const auto& model = json.at("model");
  const Finished given = bmucell(
      health_of(folder, {"--plateau-weight", model.at("plateau_weight").dump(), "--above-weight",
                         model.at("above_weight").dump(), "--sigma-Ah", model.at("sigma_Ah").dump(), "--json"}));
  INFO(given.err);
  REQUIRE(given.status == 0);
  CHECK(nlohmann::json::parse(given.out).at("single") == json.at("single"));
  CHECK(nlohmann::json::parse(given.out).at("fit").is_null());
  // The text contains the section for a cell file.
  const Finished text = bmucell(health_of(folder, fitted));
  REQUIRE(text.status == 0);
  const std::size_t at = text.out.find("\"charge_plateau\": {");
  REQUIRE(at != std::string::npos);
  nlohmann::json cell =
      nlohmann::json::parse(read_file(test::in_source("config/cells/nmc-3000.json")), nullptr, true, true);
  cell.update(nlohmann::json::parse("{" + text.out.substr(at) + "}"));
  const auto file = parse_cell_file(cell.dump(), "cell.json");
  REQUIRE(file);
  REQUIRE(file->charge_plateau);
  CHECK(file->charge_plateau->plateau_weight == Approx(model.at("plateau_weight").get<double>()).margin(1e-5));
  CHECK(file->charge_plateau->sigma_As == Approx(3'600.0 * model.at("sigma_Ah").get<double>()).margin(0.1));
  more = fitted;
  more.insert(more.end(), {"--from-voltage", "4.1"});
  const Finished late = bmucell(health_of(folder, more));
  CHECK(late.status == 0);
  CHECK(late.out.find("no charge showed all that is needed") != std::string::npos);
}

TEST_CASE("health tells what is wrong with its options and files", "[integration][bmucell]") {
  const TemporaryFolder folder;
  write_ageing_cell(folder);
  const Finished without = bmucell(health_of(folder, {}));
  CHECK(without.status == 2);
  CHECK(without.err.find("--plateau-weight") != std::string::npos);
  CHECK(bmucell(health_of(folder, {"--plateau-weight", "2", "--above-weight", "1"})).status == 2);
  CHECK(bmucell(health_of(folder, {"--fit", folder / "charges.csv"})).status == 2);
  const std::vector<std::string> fitted{"--fit", folder / "charges.csv", "--fit-tests", folder / "tests.csv"};
  std::vector<std::string> both = fitted;
  both.insert(both.end(), {"--sigma-Ah", "0.03"});
  CHECK(bmucell(health_of(folder, both)).status == 2);
  std::vector<std::string> few = fitted;
  few.insert(few.end(), {"--fit-until-cycle", "7"});
  const Finished too_few = bmucell(health_of(folder, few));
  CHECK(too_few.status == 65);
  CHECK(too_few.err.find("found 7 charges") != std::string::npos);
  const Finished missing = bmucell(health_of(folder, {"--fit", "/nonexistent.csv", "--fit-tests", "/nonexistent.csv"}));
  CHECK(missing.status == 65);
  CHECK(missing.err == "bmucell: /nonexistent.csv: cannot be opened: No such file or directory\n");
  std::vector<std::string> nowhere = fitted;
  nowhere.insert(nowhere.end(), {"--svg", folder / "nowhere/out.svg"});
  CHECK(bmucell(health_of(folder, nowhere)).status == 1);
  const Finished help = bmucell({"health", "--help"});
  CHECK(help.status == 0);
  CHECK(help.out.find("bmucell health --rated-Ah 2") != std::string::npos);
}

TEST_CASE("what is wrong has an exit code of its own, and nothing is written", "[integration][bmucell]") {
  const TemporaryFolder folder;
  const Finished no_cell = bmucell({"eval", "--cell", "/nonexistent.json", recording});
  CHECK(no_cell.status == 78);
  CHECK(no_cell.err.find("/nonexistent.json") != std::string::npos);
  const Finished no_recording = bmucell({"eval", "--cell", shipped_cell, "/nonexistent.csv"});
  CHECK(no_recording.status == 65);
  CHECK(no_recording.err == "bmucell: /nonexistent.csv: cannot be opened: No such file or directory\n");
  const Finished no_reference = bmucell({"fit", "--base", shipped_cell, "--out", folder / "out.json", shipped_cell});
  CHECK(no_reference.status == 65);
  CHECK(std::filesystem::is_empty(folder / ""));
  const Finished no_place = bmucell({"fit", "--base", shipped_cell, "--out", folder / "nowhere/out.json", recording});
  CHECK(no_place.status == 1);
  CHECK(no_place.err.find("nowhere/out.json: cannot be written: No such file or directory") != std::string::npos);
}

namespace {

using test::Bench;

const std::string sloped_base = test::in_source("config/cells/nmc-3000.json");

}  // namespace

TEST_CASE("a fit that the daemon would refuse is not written", "[integration][bmucell]") {
  const TemporaryFolder folder;
  const std::string file = folder.file("test.csv", Bench{}.csv());
  const std::string out = folder / "out.json";
  // An iron phosphate cell as the base: its limits are below the measured voltages.
  const Finished fitted = bmucell({"fit", "--base", shipped_cell, "--capacity-Ah", "1.2", "--out", out, file});
  CHECK(fitted.status == 65);
  CHECK(fitted.err.find("what was fitted: /ocv: found ") != std::string::npos);
  CHECK_FALSE(std::filesystem::exists(out));
}

TEST_CASE("eval says when a recording is none of the cell's, and doubts what nobody counted",
          "[integration][bmucell]") {
  const TemporaryFolder folder;
  const std::string cell = folder / "cell.json";
  const std::string good = folder.file("good.csv", Bench{}.csv());
  REQUIRE(bmucell({"fit", "--base", sloped_base, "--capacity-Ah", "1.2", "--out", cell, good}).status == 0);
  const auto scored = [&](const Bench& bench) {
    const std::string file = folder.file("test.csv", bench.csv());
    return bmucell({"eval", "--cell", cell, "--soc-error", "-5", "--json", file});
  };
  const Finished usual = scored({});
  INFO(usual.err);
  REQUIRE(usual.status == 0);
  CHECK(usual.err.empty());
  CHECK(nlohmann::json::parse(usual.out).at("mean").at("misfit") < 1.0);
  const Finished swapped = scored({.current_sign = -1.0});
  REQUIRE(swapped.status == 0);
  CHECK(swapped.err.find("behaves like no cell of ") != std::string::npos);
  CHECK(nlohmann::json::parse(swapped.out).at("mean").at("misfit") >= 1.0);
  const Finished gap = scored({.has_gap = true});
  REQUIRE(gap.status == 0);
  CHECK(nlohmann::json::parse(gap.out).at("mean").at("inside_uncertainty_pct") > 90.0);
  const Finished fraction = scored({.percent_in = 0.01});
  CHECK(fraction.status == 65);
  CHECK(fraction.err.find("ref_soc_pct: found nothing above 1, expected percent, from 0 to 100") != std::string::npos);
}

TEST_CASE("a mean over files of which one never settled has no time to settle", "[integration][bmucell]") {
  const TemporaryFolder folder;
  const std::string good = folder.file("good.csv", Bench{}.csv());
  const std::string short_one =
      folder.file("short.csv", "time_s,current_A,voltage_V,ref_soc_pct\n0,0,3.29,50\n1,0,3.29,50\n2,0,3.29,50\n");
  const Finished finished = bmucell(
      {"eval", "--cell", shipped_cell, "--estimator", "coulomb", "--soc-error", "-20", "--json", recording, short_one});
  INFO(finished.err);
  REQUIRE(finished.status == 0);
  CHECK(nlohmann::json::parse(finished.out).at("mean").at("settle_3pct_s").is_null());
}

}  // namespace bmu

// bmucell resistance as run by a user, on a recording of a cell that consists of 30 mOhm only.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <string>

#include <nlohmann/json.hpp>

#include "tests/support/catch.hpp"
#include "tests/support/folders.hpp"
#include "tests/support/process.hpp"

namespace bmu {

namespace {

const std::string shipped_cell = test::in_source("config/cells/panasonic-ncr18650pf.json");

Finished bmucell(std::vector<std::string> words) {
  words.insert(words.begin(), program("bmucell"));
  return run_program(words);
}

/// Five pulses of 3 A and ten seconds at 30 % and below, with rests of a minute, as exported by a bench; the last one
/// at 10 %, for which the table has a value 10 % lower.
struct Exported {
  Exported() {
    std::string series = "time_s,current_A,voltage_V,temp_C,ref_soc_pct\n";
    std::string table = "ref_soc_pct,temp_C,pulse_A,r_1s_mohm,r_10s_mohm\n";
    int time_s = 0;
    const auto rows = [&](int count, double current_A, double soc_pct) {
      std::array<char, 80> line{};
      for (int row = 0; row < count; ++row) {
        std::snprintf(line.data(), line.size(), "%d,%.4f,%.5f,25.0,%.3f\n", ++time_s, current_A, 3.6 - 0.03 * current_A,
                      soc_pct);
        series += line.data();
      }
    };
    for (int soc_pct = 30; soc_pct >= 10; soc_pct -= 5) {
      rows(60, 0.0, soc_pct);
      rows(10, 3.0, soc_pct);
      table += std::to_string(soc_pct) + ",25,3," + (soc_pct == 10 ? "27" : "30") + ",60\n";
    }
    rows(60, 0.0, 10.0);
    folder.file("series.csv", series);
    folder.file("table.csv", table);
  }
  [[nodiscard]] std::vector<std::string> words(const std::vector<std::string>& more = {}) const {
    std::vector<std::string> all{"resistance",         "--cell", shipped_cell, "--table", folder / "table.csv",
                                 folder / "series.csv"};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }

  TemporaryFolder folder;
};

}  // namespace

TEST_CASE("the resistances of a recording with pulses are scored against the bench's", "[integration][bmucell]") {
  const Exported bench;
  const Finished finished = bmucell(bench.words({"--json"}));
  INFO(finished.err);
  REQUIRE(finished.status == 0);
  const auto json = nlohmann::json::parse(finished.out);
  CHECK(json.at("column") == "r_1s_mohm");
  REQUIRE(json.at("scores").size() == 4);
  for (const auto& score : json.at("scores")) {
    const bool is_all = score.at("charge") == "all";
    CHECK(score.at("pulses") == (is_all ? 5 : 4));
    CHECK(score.at("told") == (is_all ? 4 : 3));
    CHECK(score.at("within_5_pct") == 3);
    const double max_pct = score.at("max_pct");
    if (is_all) CHECK(max_pct == Approx(11.1).epsilon(0.05));
    if (!is_all) CHECK(max_pct < 1.0);
    CHECK(score.at("inside_uncertainty_pct").is_null() == (score.at("method") == "steps"));
  }
  const Finished shown = bmucell(bench.words());
  CHECK(shown.status == 0);
  CHECK(shown.out.find("recursive  above 10 %       4       3") != std::string::npos);
  const Finished later = bmucell(bench.words({"--column", "r_10s_mohm", "--json"}));
  CHECK(nlohmann::json::parse(later.out).at("scores")[0].at("within_5_pct") == 0);
}

TEST_CASE("pulse by pulse what was told goes to a file, and a picture of it", "[integration][bmucell]") {
  const Exported bench;
  const Finished finished =
      bmucell(bench.words({"--csv", bench.folder / "pulses.csv", "--svg", bench.folder / "pulses.svg"}));
  REQUIRE(finished.status == 0);
  const std::string csv = read_file(bench.folder / "pulses.csv");
  CHECK(
      csv.starts_with("time_s,ref_soc_pct,temp_C,pulse_A,table_mOhm,recursive_mOhm,recursive_sigma_mOhm,"
                      "recursive_off_pct,steps_mOhm,steps_off_pct\n61,30.000,25.00,3.0000,30.000,,,,,\n131,25.000,"));
  CHECK(std::count(csv.begin(), csv.end(), '\n') == 6);
  CHECK(csv.ends_with(",30.000,11.11\n"));
  CHECK(read_file(bench.folder / "pulses.svg").find("state of charge, %") != std::string::npos);
}

TEST_CASE("what is wrong with pulses or their table has an exit code of its own", "[integration][bmucell]") {
  const Exported bench;
  const Finished no_column = bmucell(bench.words({"--column", "r_5s_mohm"}));
  CHECK(no_column.status == 65);
  CHECK(no_column.err.find("table.csv: no column 'r_5s_mohm' in line 1, '") != std::string::npos);
  bench.folder.file("table.csv", "ref_soc_pct,pulse_A,r_1s_mohm\n77,3,30\n");
  const Finished no_pulse = bmucell(bench.words({"--svg", bench.folder / "none.svg"}));
  CHECK(no_pulse.status == 65);
  CHECK(no_pulse.err.find("series.csv: has no pulse of 3 A at 77 % of charge") != std::string::npos);
  CHECK_FALSE(std::filesystem::exists(bench.folder / "none.svg"));
  const Finished no_table = bmucell({"resistance", "--cell", shipped_cell, bench.folder / "series.csv"});
  CHECK(no_table.status == 2);
  CHECK(no_table.err.find("--table") != std::string::npos);
  const Finished no_cell = bmucell({"resistance", "--cell", "/nonexistent.json", "--table", bench.folder / "table.csv",
                                    bench.folder / "series.csv"});
  CHECK(no_cell.status == 78);
  const Exported other;
  const Finished no_place = bmucell(other.words({"--csv", other.folder / "nowhere/pulses.csv"}));
  CHECK(no_place.status == 1);
}

}  // namespace bmu

// Pulse tables as test benches write them, and the detection of their pulses in a recording.
#include "tools/bmucell/data/pulse_table.hpp"

#include <cmath>

#include "tests/support/catch.hpp"
#include "tests/support/temporary_folder.hpp"

using namespace bmu::cell;

namespace {

bmu::Result<PulseTable, std::string> table_of(const bmu::TemporaryFolder& folder, const std::string& text) {
  return read_pulse_table(folder.file("table.csv", text), "r_mohm");
}

std::string problem_of(const std::string& text) {
  const bmu::TemporaryFolder folder;
  const auto table = table_of(folder, text);
  REQUIRE_FALSE(table);
  const std::string path = folder / "table.csv";
  REQUIRE(table.error().find(path) == 0);
  return table.error().substr(path.size());
}

/// Recording with a row per second: rest, and a pulse of four rows at each of the given currents, of half a percent of
/// charge each.
Series pulses_of(const std::vector<double>& currents_A) {
  Series series{.name = "pulses.csv", .has_temperature = true, .has_soc = true};
  double soc = 0.9;
  const auto row = [&](double current_A) {
    const double time_s = static_cast<double>(series.rows.size());
    series.rows.push_back({time_s, current_A, 3.7 - 0.01 * current_A, 21.0, soc});
  };
  for (const double current_A : currents_A) {
    for (int rest = 0; rest < 20; ++rest) row(0.0);
    row(0.3 * current_A);  // started within the second
    for (int second = 0; second < 3; ++second) row(current_A);
    soc -= 0.005;
  }
  row(0.0);
  return series;
}

PulseTable wanted(const std::vector<PulseRow>& rows) {
  return {.name = "table.csv", .column = "r_mohm", .rows = rows};
}

}  // namespace

TEST_CASE("a table is read with its columns in any order, with or without temperatures", "[unit][bmucell]") {
  const bmu::TemporaryFolder folder;
  const auto table = table_of(folder, "r_mohm,other,pulse_A,ref_soc_pct,temp_C\n40.5,1,1.45,99.5,25.6\n30,1,-3,50,\n");
  REQUIRE(table);
  CHECK(table->name == folder / "table.csv");
  CHECK(table->column == "r_mohm");
  REQUIRE(table->rows.size() == 2);
  CHECK(table->rows[0].resistance_Ohm == Approx(0.0405));
  CHECK(table->rows[0].current_A == 1.45);
  CHECK(table->rows[0].soc == Approx(0.995));
  CHECK(table->rows[0].temperature_C == 25.6);
  CHECK(table->rows[1].current_A == -3.0);
  CHECK(std::isnan(table->rows[1].temperature_C));
  const auto without = table_of(folder, "ref_soc_pct,pulse_A,r_mohm\n50,2,30\n");
  REQUIRE(without);
  CHECK(std::isnan(without->rows[0].temperature_C));
}

TEST_CASE("a table that is wrong is refused with file, line, what was found and what wanted", "[unit][bmucell]") {
  CHECK(problem_of("ref_soc_pct,pulse_A,r_10s_mohm\n50,2,30\n") ==
        ": no column 'r_mohm' in line 1, 'ref_soc_pct,pulse_A,r_10s_mohm': rename its columns; expected a first line "
        "with ref_soc_pct, pulse_A, r_mohm and, if known, temp_C");
  CHECK(problem_of("ref_soc_pct,pulse_A,r_mohm\n50,2,30\n50,,30\n") == ":3: pulse_A: found '', expected a number");
  CHECK(problem_of("ref_soc_pct,pulse_A,r_mohm\n50,2,x\n") == ":2: r_mohm: found 'x', expected a number");
  CHECK(problem_of("ref_soc_pct,pulse_A,r_mohm\n50,2,0\n").find("expected a current and a resistance above 0") !=
        std::string::npos);
  CHECK(problem_of("ref_soc_pct,pulse_A,r_mohm\n50,0,1\n").find("expected a current and a resistance above 0") !=
        std::string::npos);
  CHECK(problem_of("ref_soc_pct,pulse_A,r_mohm\n") == ": no rows after the first line");
  CHECK(problem_of("ref_soc_pct,pulse_A,r_mohm\n50,2,30\n50,2") ==
        ":3: found a last line without a line end, which may be cut off; expected one if the line is whole");
  CHECK(problem_of("ref_soc_pct,pulse_A,r_mohm\n50,2,30\n50,2,3") ==
        ":3: found a last line without a line end, which may be cut off; expected one if the line is whole");
}

TEST_CASE("each of the table's pulses is found, and what the table does not have is passed over", "[unit][bmucell]") {
  const Series series = pulses_of({5.0, 10.0, 5.0, -5.0});
  const auto found =
      find_pulses(wanted({{0.9, 5.0, 0.01, 25.0}, {0.89, 5.0, 0.01, std::nan("")}, {0.885, -5.0, 0.01, 25.0}}), series);
  REQUIRE(found);
  REQUIRE(found->size() == 3);
  CHECK(found->at(0).first == 20);
  CHECK(found->at(0).end == 24);
  CHECK(found->at(0).told.temperature_C == 25.0);
  CHECK(found->at(1).first == 68);
  CHECK(found->at(1).end == 72);
  CHECK(found->at(1).told.temperature_C == 21.0);  // from the series
  CHECK(found->at(2).first == 92);
}

TEST_CASE("a pulse is the table's by its charge and its current", "[unit][bmucell]") {
  const Series series = pulses_of({5.0});
  const auto is_found = [&](double soc, double current_A) {
    return find_pulses(wanted({{soc, current_A, 0.01, 25.0}}), series).has_value();
  };
  CHECK(is_found(0.9004, 5.0));
  CHECK(is_found(0.8996, 5.0));
  CHECK_FALSE(is_found(0.9006, 5.0));
  CHECK_FALSE(is_found(0.8994, 5.0));
  CHECK(is_found(0.9, 4.86));
  CHECK(is_found(0.9, 5.15));
  CHECK_FALSE(is_found(0.9, 4.85));
  CHECK_FALSE(is_found(0.9, 5.16));
  CHECK_FALSE(is_found(0.9, -5.0));
}

TEST_CASE("a row of the table that the recording does not have, or not in its place, is told", "[unit][bmucell]") {
  const Series series = pulses_of({5.0, 10.0});
  const auto missing = find_pulses(wanted({{0.9, 5.0, 0.01, 25.0}, {0.5, 10.0, 0.01, 25.0}}), series);
  REQUIRE_FALSE(missing);
  CHECK(missing.error() == "pulses.csv: has no pulse of 10 A at 50 % of charge, which table.csv has next");
  CHECK_FALSE(find_pulses(wanted({{0.895, 10.0, 0.01, 25.0}, {0.9, 5.0, 0.01, 25.0}}), series));
  CHECK_FALSE(find_pulses(wanted({{0.9, 5.0, 0.01, 25.0}, {0.9, 5.0, 0.01, 25.0}}), series));
}

TEST_CASE("a current that already flows as the recording begins is no pulse", "[unit][bmucell]") {
  Series series = pulses_of({5.0});
  series.rows.erase(series.rows.begin(), series.rows.begin() + 20);
  CHECK_FALSE(find_pulses(wanted({{0.9, 5.0, 0.01, 25.0}}), series));
  series = pulses_of({5.0});
  series.rows.pop_back();  // a current that still flows at the end is a pulse
  const auto found = find_pulses(wanted({{0.9, 5.0, 0.01, 25.0}}), series);
  REQUIRE(found);
  CHECK(found->at(0).end == series.rows.size());
}

TEST_CASE("without the charge no pulse is found", "[unit][bmucell]") {
  Series series = pulses_of({5.0});
  series.has_soc = false;
  const auto found = find_pulses(wanted({{0.9, 5.0, 0.01, 25.0}}), series);
  REQUIRE_FALSE(found);
  CHECK(found.error() == "pulses.csv: no column 'ref_soc_pct', which says what the charge really was");
}

// Recordings of cells: columns in any order, compressed or not, and the errors reported for invalid ones.
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>

#include <zlib.h>

#include "tests/support/catch.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tools/bmucell/data/series.hpp"

using namespace bmu::cell;

namespace {

/// Temporary file with a recording.
class Recording {
 public:
  explicit Recording(const std::string& text, const std::string& name = "recording.csv")
      : file_(folder_.file(name, text)) {}

  [[nodiscard]] std::string path() const { return file_.string(); }
  [[nodiscard]] bmu::Result<Series, std::string> read() const { return read_series(file_); }

 private:
  bmu::TemporaryFolder folder_;
  std::filesystem::path file_;
};

std::string problem_of(const Recording& recording) {
  const auto series = recording.read();
  REQUIRE_FALSE(series);
  REQUIRE(series.error().find(recording.path()) == 0);
  return series.error().substr(recording.path().size());
}

}  // namespace

TEST_CASE("a recording is read with its columns in any order, and others than its own passed over", "[unit][bmucell]") {
  const Recording recording(
      "voltage_V,cycle,time_s,ref_soc_pct,current_A,temp_C\n"
      "3.7001,7,0.5,99.5,-1.25,24.5\n"
      "3.6,7,1.5,98,2e-3,-10\r\n");
  const auto series = recording.read();
  REQUIRE(series);
  CHECK(series->name == recording.path());
  CHECK(series->has_temperature);
  CHECK(series->has_soc);
  REQUIRE(series->rows.size() == 2);
  CHECK(series->rows[0].time_s == 0.5);
  CHECK(series->rows[0].current_A == -1.25);
  CHECK(series->rows[0].voltage_V == 3.7001);
  CHECK(series->rows[0].temperature_C == 24.5);
  CHECK(series->rows[0].soc == Approx(0.995));
  CHECK(series->rows[1].current_A == 0.002);
  CHECK(series->rows[1].temperature_C == -10.0);
  CHECK(series->rows[0].line == 2);
  CHECK(series->rows[1].line == 3);
}

TEST_CASE("rows further apart than ten times the usual are not neighbours", "[unit][bmucell]") {
  Series series;
  for (const double time_s : {0.0, 1.0, 1.0, 3.0, 5.0, 60.0}) series.rows.push_back({.time_s = time_s});
  CHECK(gap_of(series) == 20.0);
  CHECK(gap_of({}) == 0.0);
}

TEST_CASE("temperature and reference may be missing, an empty field or nan was not measured", "[unit][bmucell]") {
  const auto series = Recording("time_s,current_A,voltage_V\n0,,3.7\n1,nan,\n").read();
  REQUIRE(series);
  CHECK_FALSE(series->has_temperature);
  CHECK_FALSE(series->has_soc);
  REQUIRE(series->rows.size() == 2);
  CHECK(std::isnan(series->rows[0].current_A));
  CHECK(std::isnan(series->rows[0].temperature_C));
  CHECK(std::isnan(series->rows[0].soc));
  CHECK(std::isnan(series->rows[1].current_A));
  CHECK(std::isnan(series->rows[1].voltage_V));
}

TEST_CASE("a recording packed with gzip is read as it is", "[unit][bmucell]") {
  const Recording recording("", "packed.csv.gz");
  gzFile const file = gzopen(recording.path().c_str(), "wb");
  REQUIRE(file != nullptr);
  REQUIRE(gzputs(file, "time_s,current_A,voltage_V\n0,1,3.5\n") > 0);
  REQUIRE(gzclose(file) == Z_OK);
  const auto series = recording.read();
  REQUIRE(series);
  REQUIRE(series->rows.size() == 1);
  CHECK(series->rows[0].voltage_V == 3.5);
}

TEST_CASE("a recording that is wrong is refused with file, line, what was found and what was expected",
          "[unit][bmucell]") {
  const std::string head = "time_s,current_A,voltage_V,temp_C\n";
  CHECK(problem_of(Recording("time_s,voltage_V\n0,3\n")) ==
        ": no column 'current_A' in line 1, 'time_s,voltage_V': rename its columns; expected a first line with time_s, "
        "current_A, voltage_V and, if known, temp_C, "
        "ref_soc_pct");
  CHECK(problem_of(Recording(head + "0,1,3.5,20\n1,1,3x5,20\n")) == ":3: voltage_V: found '3x5', expected a number");
  CHECK(problem_of(Recording(head + "0,1,3.5,inf\n")) == ":2: temp_C: found 'inf', expected a number");
  CHECK(problem_of(Recording(head + "0,1,1e999,20\n")) == ":2: voltage_V: found '1e999', expected a number");
  CHECK(problem_of(Recording(head + ",1,3.5,20\n")) == ":2: time_s: found '', expected a number");
  CHECK(problem_of(Recording(head)) == ": no rows after the first line");
  CHECK(problem_of(Recording(head + "0,1,3.5\n")) == ":2: found 3 fields, expected 4 as in the first line");
  CHECK(problem_of(Recording(head + "0,1,3.5,20,7\n")) ==
        ":2: found 5 fields, expected 4 as in the first line; values with a decimal comma need quotes, or another "
        "separator");
  CHECK(problem_of(Recording("")) == ": found nothing, expected a first line with the names of the columns");
  CHECK(problem_of(Recording("time_s,time_s,current_A,voltage_V\n0,0,1,3\n")) ==
        ":1: found column 'time_s' twice, expected it once");
}

TEST_CASE("a packed recording that was cut off is refused, however much of it is there", "[unit][bmucell]") {
  std::string text = "time_s,current_A,voltage_V\n";
  for (int row = 0; row < 20'000; ++row) text += std::to_string(row) + "," + std::to_string(row * 37 % 1001) + ",3.7\n";
  const Recording whole("", "whole.csv.gz");
  gzFile const file = gzopen(whole.path().c_str(), "wb");
  REQUIRE(gzwrite(file, text.data(), static_cast<unsigned>(text.size())) > 0);
  REQUIRE(gzclose(file) == Z_OK);
  REQUIRE(whole.read());
  std::filesystem::resize_file(whole.path(), std::filesystem::file_size(whole.path()) - 100);
  CHECK(problem_of(whole).find(": cannot be read: ") == 0);
}

TEST_CASE("a recording that cannot be read says why", "[unit][bmucell]") {
  const auto missing = read_series("/nonexistent/recording.csv");
  REQUIRE_FALSE(missing);
  CHECK(missing.error() == "/nonexistent/recording.csv: cannot be opened: No such file or directory");
  const auto folder = read_series(std::filesystem::temp_directory_path());
  REQUIRE_FALSE(folder);
  CHECK(folder.error().find("cannot be read") != std::string::npos);
  const Recording torn(std::string("\x1f\x8b\x08\0garbage", 11), "torn.csv.gz");
  INFO(problem_of(torn));
  CHECK(problem_of(torn).find(": cannot be read: ") == 0);
}

// What bmucell makes of recordings as testers, spreadsheets and R export them, and of recordings that no test of a cell
// can be.
#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tests/support/catch.hpp"
#include "tests/support/cell_bench.hpp"
#include "tests/support/folders.hpp"
#include "tests/support/process.hpp"

namespace bmu {

namespace {

using test::Bench;

const std::string base = test::in_source("config/cells/nmc-3000.json");

/// One fit of a cell of 1.2 Ah.
struct FitRun {
  Finished finished;
  std::string cell;  // the file that was written; empty: none

  /// The message behind the name of the recording.
  [[nodiscard]] std::string complaint() const {
    const std::size_t at = finished.err.find("test.csv");
    return at == std::string::npos ? finished.err : finished.err.substr(at + 8);
  }
};

FitRun fit_of(const TemporaryFolder& folder, const std::string& csv, const std::vector<std::string>& more = {}) {
  const std::string out = folder / "out.json";
  std::filesystem::remove(out);
  std::vector<std::string> words{program("bmucell"), "fit", "--base", base, "--out", out};
  if (std::find(more.begin(), more.end(), "--capacity-Ah") == more.end()) {
    words.insert(words.end(), {"--capacity-Ah", "1.2"});
  }
  words.push_back(folder.file("test.csv", csv));
  words.insert(words.end(), more.begin(), more.end());
  FitRun run{.finished = run_program(words)};
  if (std::filesystem::exists(out)) run.cell = read_file(out);
  return run;
}

/// The message of a fit that is refused and writes nothing.
std::string refusal(const TemporaryFolder& folder, const Bench& bench, const std::vector<std::string>& more = {}) {
  const FitRun run = fit_of(folder, bench.csv(), more);
  CHECK(run.finished.status == 65);
  CHECK(run.cell.empty());
  return run.complaint();
}

bool has(const std::string& text, const std::string& part) {
  INFO(text);
  CHECK(text.find(part) != std::string::npos);
  return text.find(part) != std::string::npos;
}

std::string replaced(std::string text, char from, char to) {
  std::replace(text.begin(), text.end(), from, to);
  return text;
}

/// Every field of the lines in quotes.
std::string in_quotes(const std::string& lines) {
  std::string text = "\"";
  for (std::size_t at = 0; at < lines.size(); ++at) {
    if (lines[at] == ',') {
      text += "\",\"";
    } else if (lines[at] == '\n') {
      text += at + 1 < lines.size() ? "\"\n\"" : "\"\n";
    } else {
      text += lines[at];
    }
  }
  return text;
}

std::string head_in_quotes(const std::string& csv) {
  const std::size_t head = csv.find('\n') + 1;
  return in_quotes(csv.substr(0, head)) + csv.substr(head);
}

std::string with_plus_signs(const std::string& csv) {
  std::string text = csv.substr(0, csv.find('\n') + 1);
  for (std::size_t at = text.size(); at < csv.size(); ++at) {
    const bool is_begin = csv[at - 1] == ',' && csv[at] >= '0' && csv[at] <= '9';
    text += is_begin ? std::string("+") + csv[at] : std::string(1, csv[at]);
  }
  return text;
}

std::string in_utf16(const std::string& csv, bool is_big) {
  std::string text = is_big ? "\xfe\xff" : "\xff\xfe";
  for (const char letter : csv) {
    if (is_big) text += '\0';
    text += letter;
    if (!is_big) text += '\0';
  }
  return text;
}

/// As R's write.csv2: quoted names of columns and rows, semicolons, decimal commas.
std::string as_write_csv2(const std::string& csv) {
  std::string text = "\"\",";
  const std::string with_head = head_in_quotes(csv);
  int row = 0;
  for (std::size_t at = 0; at < with_head.size(); ++at) {
    text += with_head[at];
    if (with_head[at] == '\n' && at + 1 < with_head.size()) text += "\"" + std::to_string(++row) + "\",";
  }
  return replaced(replaced(text, ',', ';'), '.', ',');
}

}  // namespace

TEST_CASE("a recording gives the same cell file in whatever form of CSV it was exported", "[integration][bmucell]") {
  const TemporaryFolder folder;
  const std::string plain = Bench{}.csv();
  const FitRun expected = fit_of(folder, plain);
  INFO(expected.finished.err);
  REQUIRE(expected.finished.status == 0);
  REQUIRE_FALSE(expected.cell.empty());
  struct Form {
    const char* name;
    std::string csv;
  };
  const std::vector<Form> forms{
      {"quoted head", head_in_quotes(plain)},
      {"quoted all", in_quotes(plain)},
      {"blank last line", plain + "\n"},
      {"plus signs", with_plus_signs(plain)},
      {"semicolons", replaced(plain, ',', ';')},
      {"tabs", replaced(plain, ',', '\t')},
      {"UTF-16, little endian", in_utf16(plain, false)},
      {"UTF-16, big endian", in_utf16(plain, true)},
      {"byte-order mark", "\xef\xbb\xbf" + plain},
      {"old line ends", replaced(plain, '\n', '\r')},
      {"semicolons and decimal commas", replaced(replaced(plain, ',', ';'), '.', ',')},
      {"R's write.csv2", as_write_csv2(plain)},
  };
  for (const Form& form : forms) {
    INFO(form.name);
    const FitRun run = fit_of(folder, form.csv);
    INFO(run.finished.err);
    CHECK(run.finished.status == 0);
    CHECK(run.cell == expected.cell);
  }
}

TEST_CASE("a last line without a line end, which may be cut off, is named and left out", "[integration][bmucell]") {
  const TemporaryFolder folder;
  const std::string named = "test.csv:3602: the last line has no line end and may be cut off: it is left out\n";
  const FitRun expected = fit_of(folder, Bench{}.csv());
  // Within its fields, or within the last number.
  for (const char* const cut : {"3600,1.5,3.3", "3600,1.5,3.3,25.0,7"}) {
    CAPTURE(cut);
    const FitRun run = fit_of(folder, Bench{}.csv() + cut);
    CHECK(run.finished.status == 0);
    CHECK(has(run.finished.err, named));
    CHECK(run.cell == expected.cell);
  }
}

TEST_CASE("a last line that is left out is also named where the fit is refused", "[integration][bmucell]") {
  const TemporaryFolder folder;
  const std::string named = ": the last line has no line end and may be cut off: it is left out\n";
  // By what is in the recording, and by what was fitted to it.
  const FitRun by_rows = fit_of(folder, "time_s,current_A,voltage_V,temp_C\n0,1,3.7,25\n1,1,3.7,25\n2,1,3.");
  CHECK(by_rows.finished.status == 65);
  CHECK(has(by_rows.finished.err, "found 2 rows, expected at least"));
  CHECK(has(by_rows.finished.err, "test.csv:4" + named));
  const FitRun by_fit = fit_of(folder, Bench{}.csv() + "3600,1.5", {"--rmse-max-mV", "0.1"});
  CHECK(by_fit.finished.status == 65);
  CHECK(has(by_fit.finished.err, "test.csv:3602" + named));
}

TEST_CASE("an evaluation does not take a number that is cut off for the state of charge", "[integration][bmucell]") {
  const TemporaryFolder folder;
  const auto figures_of = [&folder](const std::string& csv) {
    return run_program({program("bmucell"), "eval", "--cell", base, "--json", folder.file("test.csv", csv)});
  };
  const std::string csv = Bench{}.csv();
  const Finished whole = figures_of(csv);
  const Finished cut = figures_of(csv + "3600,1.5,3.3,25.0,7");
  REQUIRE(whole.status == 0);
  CHECK(cut.status == 0);
  CHECK(cut.out == whole.out);
  CHECK(has(cut.err, "test.csv:3602: the last line has no line end and may be cut off: it is left out\n"));
}

TEST_CASE("CSV whose first line has not the names says what that line is and what to do", "[integration][bmucell]") {
  const TemporaryFolder folder;
  const FitRun other_names = fit_of(folder, "Test Time (s),Current (A),Voltage (V)\n0,1,3.7\n");
  CHECK(other_names.finished.status == 65);
  CHECK(other_names.complaint() ==
        ": no column 'time_s' in line 1, 'Test Time (s),Current (A),Voltage (V)': rename its columns; expected a first "
        "line with time_s, current_A, voltage_V and, if known, temp_C, ref_soc_pct\n");
  const FitRun preamble = fit_of(folder, "Tester 7\nDate;30.11.\n" + Bench{}.csv());
  CHECK(preamble.finished.status == 65);
  CHECK(has(preamble.complaint(), "in line 1, 'Tester 7': line 3 has them: remove lines 1 to 2; expected "));
}

TEST_CASE("a fit refuses what no test of a cell can be with the likely cause, and writes nothing",
          "[integration][bmucell]") {
  const TemporaryFolder folder;
  const FitRun usual = fit_of(folder, Bench{}.csv());
  INFO(usual.finished.err);
  CHECK(usual.finished.status == 0);
  CHECK(has(refusal(folder, {.volts_in = 1'000.0}), "expected volts of one cell, 0.5 to 6; in mV?"));
  CHECK(refusal(folder, {.has_temperature = false}) ==
        ": temp_C: found nothing, expected temperatures; a fit is nothing without them\n");
  CHECK(has(refusal(folder, {.temperature = 298.15}),
            "temp_C: found mostly 298.1, expected degrees Celsius within "
            "-25 to 65; in K?"));
  CHECK(has(refusal(folder, {.temperature = 77.0}),
            "temp_C: found mostly 77, expected degrees Celsius within -25 to "
            "65; in degrees Fahrenheit?"));
  CHECK(has(refusal(folder, {.current_sign = -1.0}), "current_A: the voltage mostly rises with it"));
  CHECK(has(refusal(folder, {.has_charges = true, .has_current_sign = false}), "; the current without its sign?"));
  CHECK(has(refusal(folder, {.current_in = 1'000.0}), "expected currents in A of a cell of 1.2 Ah; in mA?"));
  CHECK(has(refusal(folder, {.seconds_in = 1'000.0}), "; current in mA, or time in ms?"));
  CHECK(has(refusal(folder, {.seconds_in = 1.0 / 60.0}), "; time in minutes?"));
  CHECK(has(refusal(folder, {.seconds_in = 1.0 / 3'600.0}), "; time in hours?"));
  CHECK(has(refusal(folder, {.restarts_time = true}),
            ":32: time_s: found 0 after 29, expected a time that goes forward"));
  CHECK(has(refusal(folder, {.percent_in = 0.01}), "; a fraction in place of percent?"));
  CHECK(has(refusal(folder, {.has_depth_of_discharge = true}), "the depth of discharge in place of the charge?"));
  CHECK(has(refusal(folder, {.has_still_soc = true}), "ref_soc_pct: moves by 0 % while the current moves 75 %"));
  CHECK(has(refusal(folder, {}, {"--capacity-Ah", "12"}),
            "ref_soc_pct: with the current it makes 1.2 Ah, expected about 12, the capacity"));
  CHECK(has(refusal(folder, {}, {"--capacity-Ah", "0.8"}), "it makes 1.2 Ah, expected about 0.8, the capacity"));
}

namespace {

/// 75 min at 0.3 A out of the cell and 25 min as much into it, twice, from 95 % on: a quarter of the time into the
/// cell, whose sign may be missing. Without ref_soc_pct.
std::string long_charges_csv(bool has_sign) {
  std::string text = "time_s,current_A,voltage_V,temp_C\n";
  double soc = 0.95;
  for (int second = 0; second < 2 * 6'000; second += 10) {
    const double current_A = second % 6'000 < 4'500 ? 0.3 : -0.3;
    soc -= current_A * 10.0 / 4'320.0;
    text += std::to_string(second) + "," + std::to_string(has_sign ? current_A : 0.3) + "," +
            std::to_string(3.2 + 0.9 * soc - 0.05 * current_A) + ",25\n";
  }
  return text;
}

}  // namespace

TEST_CASE("a fit refuses long charges whose current has no sign, and takes them with it", "[integration][bmucell]") {
  const TemporaryFolder folder;
  const FitRun wrong = fit_of(folder, long_charges_csv(false));
  CHECK(wrong.finished.status == 65);
  CHECK(wrong.cell.empty());
  CHECK(has(wrong.complaint(), " at a steady 0.3 A, expected it to fall; the current without its sign?"));
  const FitRun right = fit_of(folder, long_charges_csv(true));
  INFO(right.finished.err);
  CHECK(right.finished.status == 0);
}

TEST_CASE("a fit refuses small charge pulses whose current has no sign, and takes them with it",
          "[integration][bmucell]") {
  // 0.19 C into a cell of 3.2 Ah.
  const TemporaryFolder folder;
  const std::vector<std::string> options{"--capacity-Ah", "3.2", "--begin-soc", "95"};
  const Bench right{.has_soc = false, .has_charges = true, .capacity_Ah = 3.2};
  Bench wrong = right;
  wrong.has_current_sign = false;
  CHECK(refusal(folder, wrong, options) ==
        ":92: current_A: at 30 of 89 steps the voltage goes the wrong way: first it rises by 30 mV as the current goes "
        "from 0 to 0.6 A, expected it to fall; the current without its sign?\n");
  const FitRun fitted = fit_of(folder, right.csv(), options);
  INFO(fitted.finished.err);
  CHECK(fitted.finished.status == 0);
  CHECK_FALSE(fitted.cell.empty());
}

TEST_CASE("eval and resistance warn of small charge pulses whose current has no sign", "[integration][bmucell]") {
  const TemporaryFolder folder;
  const std::string cell = test::in_source("config/cells/lipo-3300.json");
  const std::string table = folder.file("table.csv", "ref_soc_pct,pulse_A,r_1s_mohm\n94.219,1.5,50\n");
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"eval"}, std::vector<std::string>{"resistance", "--table", table}}) {
    for (const bool has_sign : {true, false}) {
      const Bench bench{.has_charges = true, .has_current_sign = has_sign, .capacity_Ah = 3.2};
      std::vector<std::string> words{program("bmucell")};
      words.insert(words.end(), command.begin(), command.end());
      words.insert(words.end(), {"--cell", cell, folder.file("test.csv", bench.csv())});
      const Finished finished = run_program(words);
      CAPTURE(command.front(), has_sign, finished.err);
      const bool has_warning =
          finished.err.find("warning: " + folder / "test.csv" +
                            ":92: current_A: at 30 of 89 steps the voltage goes the wrong way") != std::string::npos;
      CHECK(has_warning == !has_sign);
      CHECK(finished.status == 0);
    }
  }
}

TEST_CASE("a fit counts without ref_soc_pct from where it is given, with a warning from an assumption",
          "[integration][bmucell]") {
  const TemporaryFolder folder;
  const FitRun assumed = fit_of(folder, Bench{.has_soc = false}.csv());
  CHECK(assumed.finished.status == 0);
  CHECK(has(assumed.complaint(),
            ": no column 'ref_soc_pct': its charge is counted from 100 %, an assumption; give "
            "--begin-soc"));
  const FitRun given = fit_of(folder, Bench{.has_soc = false}.csv(), {"--begin-soc", "95"});
  CHECK(given.finished.status == 0);
  CHECK(given.finished.err.find("assumption") == std::string::npos);
  CHECK(has(refusal(folder, {.has_soc = false}, {"--begin-soc", "30"}),
            "counted from 30 % it makes a charge of -45 % to 30 %, expected 0 to 100 %"));
  CHECK(has(refusal(folder, {.seconds_in = 1'000.0, .has_soc = false}), "; current in mA, or time in ms?"));
  // A slow curve alone has no steps that would show the sign.
  const FitRun slow = fit_of(folder, test::slow_csv(1.0), {"--begin-soc", "100"});
  INFO(slow.finished.err);
  CHECK(slow.finished.status == 0);
  const FitRun other_sign = fit_of(folder, test::slow_csv(-1.0), {"--begin-soc", "0"});
  CHECK(other_sign.finished.status == 65);
  CHECK(has(other_sign.complaint(), "current_A: the voltage mostly rises with it or as charge leaves"));
}

TEST_CASE("a fit that misses its recordings, or spans nothing of the cell's window, is not written",
          "[integration][bmucell]") {
  const TemporaryFolder folder;
  const std::string other = folder.file("other.csv", Bench{.volts_in = 0.8}.csv());
  const FitRun two_cells = fit_of(folder, Bench{}.csv(), {other});
  CHECK(two_cells.finished.status == 65);
  CHECK(two_cells.cell.empty());
  CHECK(has(two_cells.finished.err, " mV RMSE, expected at most 100; another cell than the other recordings', "));
  const FitRun lax = fit_of(folder, Bench{}.csv(), {other, "--rmse-max-mV", "1000"});
  CHECK(lax.finished.status == 0);
  // A curve that rises by 10 mV from empty to full.
  std::string flat = "time_s,current_A,voltage_V,temp_C,ref_soc_pct\n";
  for (int second = 0; second < 3'600; ++second) {
    const double current_A = second / 30 % 2 == 0 ? 1.5 : 0.3;
    const double soc_pct = 95.0 - 0.9 * second / 43.2;
    flat += std::to_string(second) + "," + std::to_string(current_A) + "," +
            std::to_string(3.6 + 0.0001 * soc_pct - 0.05 * current_A) + ",25," + std::to_string(soc_pct) + "\n";
  }
  const FitRun no_span = fit_of(folder, flat);
  CHECK(no_span.finished.status == 65);
  CHECK(has(no_span.finished.err, "expected a span of 0.09 V or more of the base's 2.50 to 4.25"));
}

TEST_CASE("fit and eval report rows that they leave out, and why", "[integration][bmucell]") {
  const TemporaryFolder folder;
  const FitRun fitted = fit_of(folder, Bench{.rows_without_voltage = 7}.csv());
  CHECK(fitted.finished.status == 0);
  CHECK(has(fitted.finished.err, "7 of 3600 rows left out: without current, voltage, temperature or charge\n"));
  CHECK(has(fitted.finished.err, "warning: no recording has a charge below 20 %"));
  const std::string cell = folder.file("cell.json", fitted.cell);
  std::string csv = Bench{}.csv();
  csv += "3600,1.5,3.3,25,\n";    // without a reference
  csv += "3600,1.5,3.3,25,20\n";  // at the same time
  csv += "30,1.5,3.3,25,20\n";    // from another step
  const std::string file = folder.file("test.csv", csv);
  const std::vector<std::string> words{program("bmucell"), "eval", "--cell", cell, "--json", file};
  const Finished scored = run_program(words);
  INFO(scored.err);
  CHECK(scored.status == 0);
  CHECK(
      has(scored.err, "test.csv: 3 of 3603 rows left out: 2 whose time does not go forward, 1 without ref_soc_pct\n"));
  CHECK(has(scored.err, "test.csv:3604: time_s: found 30 after 3600, expected a time that goes forward"));
  const auto mean = nlohmann::json::parse(scored.out).at("mean");
  CHECK(mean.at("rows") == 3'600);
  CHECK(mean.at("rows_left_out") ==
        nlohmann::json{{"before_start", 0}, {"time_not_forward", 2}, {"without_reference", 1}});
}

TEST_CASE("eval and resistance refuse other units than theirs", "[integration][bmucell]") {
  const TemporaryFolder folder;
  const auto refused = [&folder](const std::vector<std::string>& command, const Bench& bench) {
    std::vector<std::string> words{program("bmucell")};
    words.insert(words.end(), command.begin(), command.end());
    words.insert(words.end(), {"--cell", base, folder.file("test.csv", bench.csv())});
    const Finished finished = run_program(words);
    CHECK(finished.status == 65);
    return finished.err;
  };
  const std::string table = folder.file("table.csv", "ref_soc_pct,pulse_A,r_1s_mohm\n90,1.5,50\n");
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"eval"}, std::vector<std::string>{"resistance", "--table", table}}) {
    CHECK(has(refused(command, {.volts_in = 1'000.0}), "test.csv: voltage_V: found "));
    CHECK(has(refused(command, {.temperature = 298.15}), "; in K?"));
  }
}

}  // namespace bmu

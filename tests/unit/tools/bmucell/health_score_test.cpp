// Charges and capacity tests from files, and scores and fits with a known outcome.
#include <cmath>
#include <string>

#include "tests/support/catch.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tools/bmucell/health.hpp"

using namespace bmu;
using namespace bmu::cell;

namespace {

const std::string head = "cycle,time_s,current_A,voltage_V,temp_C\n";
const std::string tests_head = "cycle,capacity_Ah,charges_before\n";

class Files {
 public:
  [[nodiscard]] Result<AgeingData, std::string> read(const std::string& charges, const std::string& tests) {
    charges_ = folder_.file("charges.csv", charges);
    tests_ = folder_.file("tests.csv", tests);
    return read_ageing(charges_, tests_);
  }
  /// Error text without the folder.
  [[nodiscard]] std::string problem_of(const std::string& charges, const std::string& tests) {
    const auto data = read(charges, tests);
    REQUIRE_FALSE(data);
    const std::string where = charges_.parent_path().string() + "/";
    std::string text = data.error();
    for (auto at = text.find(where); at != std::string::npos; at = text.find(where)) text.erase(at, where.size());
    return text;
  }

 private:
  TemporaryFolder folder_;
  std::filesystem::path charges_;
  std::filesystem::path tests_;
};

constexpr double rated_As = 3'600.0;

/// Charge with a plateau (checked by the tests of ChargePlateau): steps of 30 s with 1.5 A; then the taper. The shares
/// scale the time on the plateau, and above it.
Charge plateau_charge(double number, double plateau_share, double above_share) {
  Charge charge{.number = number};
  double voltage_V = 3.6;
  const auto add = [&](double current_A, double rise_V) {
    voltage_V += rise_V;
    charge.samples.push_back({.passed_s = 30.0,
                              .mean_current_A = -current_A,
                              .current_A = -current_A,
                              .voltage_V = voltage_V,
                              .temperature_C = 25.0});
  };
  for (int step = 0; step < 7; ++step) add(1.5, 0.0);
  while (voltage_V < 3.8) add(1.5, 0.01 / plateau_share);
  while (voltage_V < 3.9) add(1.5, 0.0041 / plateau_share);
  while (voltage_V < 4.19) add(1.5, 0.009 / above_share);
  for (const double current_A : {1.0, 0.5, 0.2, 0.05}) add(current_A, 0.0);
  return charge;
}

constexpr ChargePlateauModel model{.plateau_weight = 2.0,
                                   .above_weight = 1.1,
                                   .sigma_As = 0.02 * rated_As,
                                   .current_A = 1.5,
                                   .full_voltage_V = 4.2,
                                   .end_current_A = 0.1};

double capacity_by_model(const Charge& charge) {
  ChargePlateau plateau;
  plateau.begin(model);
  std::optional<PlateauCharge> shown;
  for (const CellSample& sample : charge.samples) {
    const auto now = plateau.take(sample);
    if (now) shown = now;
  }
  REQUIRE(shown);
  return capacity_pair(model, *shown, {.offset_A = 0.0}).charge_As;
}

/// Cell with a plateau that loses 2 % with each charge, and half a percent above it. Its capacities are those of the
/// model, times a factor.
AgeingData ageing(int charges, double factor = 1.0) {
  AgeingData data{.name = "cell"};
  for (int k = 1; k <= charges; ++k) {
    data.charges.push_back(plateau_charge(k, 1.0 - 0.02 * k, 1.0 - 0.005 * k));
    data.tests.push_back({.cycle = 100.0 + k,
                          .capacity_As = factor * capacity_by_model(data.charges.back()),
                          .charge_number = static_cast<double>(k)});
  }
  return data;
}

}  // namespace

TEST_CASE("charges are cut apart by their numbers, and tests find theirs", "[unit][bmucell]") {
  Files files;
  const auto data =
      files.read(head + "2,60,-1.5,3.6,24\n2,120,-1.4,3.7,25\n5,30,-1.5,3.5,26\n", tests_head + "7,1.8,5\n");
  REQUIRE(data);
  REQUIRE(data->charges.size() == 2);
  CHECK(data->charges[0].number == 2.0);
  REQUIRE(data->charges[0].samples.size() == 2);
  CHECK(data->charges[0].samples[0].passed_s == 60.0);
  CHECK(data->charges[0].samples[1].passed_s == 60.0);
  CHECK(data->charges[0].samples[1].mean_current_A == -1.4);
  CHECK(data->charges[0].samples[1].voltage_V == 3.7);
  CHECK(data->charges[0].samples[1].temperature_C == 25.0);
  CHECK(data->charges[1].samples[0].passed_s == 30.0);
  REQUIRE(data->tests.size() == 1);
  CHECK(data->tests[0].cycle == 7.0);
  CHECK(data->tests[0].capacity_As == Approx(6'480.0));
  CHECK(data->tests[0].has_own_charge);
  CHECK(data->charge_before(data->tests[0]).number == 5.0);
}

TEST_CASE("a second test behind one charge has none of its own", "[unit][bmucell]") {
  Files files;
  const auto data = files.read(head + "2,60,-1.5,3.6,24\n", tests_head + "7,1.8,2\n8,1.9,2\n");
  REQUIRE(data);
  CHECK(data->tests[0].has_own_charge);
  CHECK_FALSE(data->tests[1].has_own_charge);
}

TEST_CASE("charges and tests that are wrong are refused with what was found and what wanted", "[unit][bmucell]") {
  Files files;
  const std::string charges = head + "2,60,-1.5,3.6,24\n";
  CHECK(files.problem_of("time_s,current_A,voltage_V,temp_C\n0,1,3,20\n", tests_head + "7,1.8,2\n") ==
        "charges.csv: no column 'cycle', the number of the charge");
  CHECK(files.problem_of("cycle,time_s,current_A,voltage_V\n1,0,1,3\n", tests_head + "7,1.8,2\n") ==
        "charges.csv: no column 'temp_C'");
  CHECK(files.problem_of(charges + "1,60,-1.5,3.6,24\n", tests_head + "7,1.8,2\n") ==
        "charges.csv: cycle: found '1' at 60 s, expected rising numbers, with the rows of each charge together");
  CHECK(files.problem_of(charges + ",60,-1.5,3.6,24\n", tests_head + "7,1.8,2\n") ==
        "charges.csv: cycle: found 'nan' at 60 s, expected rising numbers, with the rows of each charge together");
  CHECK(files.problem_of(charges, "cycle,charges_before\n7,2\n") ==
        "tests.csv: no column 'capacity_Ah' in line 1, 'cycle,charges_before': rename its columns; expected a first "
        "line with cycle, capacity_Ah and charges_before");
  CHECK(files.problem_of(charges, tests_head + "7,x,2\n") == "tests.csv:2: capacity_Ah: found 'x', expected a number");
  CHECK(files.problem_of(charges, tests_head + "7,,2\n") == "tests.csv:2: capacity_Ah: found '', expected a number");
  CHECK(files.problem_of(charges, tests_head + "7,0,2\n") ==
        "tests.csv:2: capacity_Ah: found '0', expected a number above 0");
  CHECK(files.problem_of(charges, tests_head + "7,1.8,2\n8,1.8,1\n") ==
        "tests.csv:3: charges_before: found '1' behind '2', expected numbers that do not fall");
  CHECK(files.problem_of(charges, tests_head + "7,1.8,3\n") ==
        "tests.csv: charges_before: found '3', expected a cycle of charges.csv");
  CHECK(files.problem_of(charges, tests_head + "7,1.8,2\n\n8,1.8,1\n") ==
        "tests.csv:4: charges_before: found '1' behind '2', expected numbers that do not fall");
}

TEST_CASE("recorded charges that no charges of a cell can be are refused with the likely cause", "[unit][bmucell]") {
  Files files;
  const std::string tests = tests_head + "7,1.8,2\n";
  CHECK(files.problem_of(head + "2,60,1.5,3.6,24\n", tests) ==
        "charges.csv: current_A: found 1.5 to 1.5, expected charging currents, which are below 0; a current that is "
        "positive into the cell?");
  CHECK(files.problem_of(head + "2,60,-1.5,3.6,24\n2,70,-1", tests) ==
        "charges.csv:3: found a last line without a line end, which may be cut off; expected one if the line is whole");
  CHECK(files.problem_of(head + "2,60,-1.5,3600,24\n", tests) ==
        "charges.csv: voltage_V: found 3600 to 3600, expected volts of one cell, 0.5 to 6; in mV?");
  CHECK(
      files.problem_of(
          head + "1,60,-1.5,3.6,24\n1,120,-1.5,3.6,24\n2,0,-1.5,3.6,24\n2,60,-1.5,3.6,24\n2,10,-1.5,3.6,24\n", tests) ==
      "charges.csv:6: time_s: found 10 after 60, expected a time that goes forward; the time of each step in place of "
      "the whole test's?");
}

TEST_CASE("plugged in later, what came before is not seen", "[unit][bmucell]") {
  Charge charge{.number = 1.0};
  for (int k = 0; k < 10; ++k) {
    charge.samples.push_back({.passed_s = 100.0, .mean_current_A = -1.0, .voltage_V = 3.5 + 0.1 * k});
  }
  // 1000 As of 2000 flow: the charge begins at a half, and each sample adds 5 %.
  const auto left = [&](const PluggedIn& when) { return plugged_in(charge, 2'000.0, when).samples.size(); };
  CHECK(left({}) == 10);
  CHECK(left({.from_soc = 0.5}) == 10);
  CHECK(left({.from_soc = 0.7}) == 7);
  CHECK(left({.from_soc = 1.01}) == 0);
  CHECK(left({.from_voltage_V = 3.95}) == 5);
  CHECK(left({.from_soc = 0.7, .from_voltage_V = 3.95}) == 5);
  CHECK(left({.from_voltage_V = 5.0}) == 0);
}

TEST_CASE("a fit finds the weights that a cell's charges were made of", "[unit][bmucell]") {
  const auto fit = fit_plateau(ageing(20), model, rated_As, 1e9);
  REQUIRE(fit);
  CHECK(fit->charges == 20);
  // Regularised towards 1, the second weight ends a little below 1.1, and the first one compensates it.
  CHECK(fit->model.above_weight == Approx(1.1).margin(0.05));
  CHECK(fit->model.plateau_weight == Approx(2.0).margin(0.2));
  CHECK(fit->rmse_As < 0.005 * rated_As);
  CHECK(fit->model.sigma_As == Approx(0.015 * rated_As));
  CHECK(fit->model.current_A == 1.5);
  const auto early = fit_plateau(ageing(20), model, rated_As, 110.0);
  REQUIRE(early);
  CHECK(early->charges == 10);
  // Fewer charges of one age separate the two weights less well: nearer to 1.
  CHECK(early->model.above_weight < fit->model.above_weight);
  CHECK(early->model.above_weight > 1.0);
}

TEST_CASE("a fit to too few charges is refused", "[unit][bmucell]") {
  CHECK(fit_plateau(ageing(8), model, rated_As, 1e9));
  const auto fit = fit_plateau(ageing(8), model, rated_As, 107.0);
  REQUIRE_FALSE(fit);
  CHECK(fit.error() ==
        "cell: found 7 charges with a test that show a plateau and are full at the end, expected 8 to fit to");
}

TEST_CASE("each test is compared with what was known before it", "[unit][bmucell]") {
  const AgeingData data = ageing(20, 1.02);  // 2 % more than by the model
  const HealthResult result = score_health({.model = model, .rated_As = rated_As}, data);
  CHECK(result.file == "cell");
  REQUIRE(result.rows.size() == 20);
  CHECK(result.rows[0].cycle == 101.0);
  CHECK(result.rows[0].true_As == data.tests[0].capacity_As);
  REQUIRE(result.rows[0].single_As);
  CHECK(*result.rows[0].single_As == Approx(data.tests[0].capacity_As / 1.02));
  CHECK(result.rows[0].single_sigma_As == model.sigma_As);
  CHECK(result.single.tests == 20);
  double squares = 0.0;
  for (const CapacityTest& test : data.tests) {
    const double off = test.capacity_As * (1.0 - 1.0 / 1.02) / rated_As * 100.0;
    squares += off * off;
  }
  CHECK(result.single.rmse_pct == Approx(std::sqrt(squares / 20.0)));
  CHECK(result.single.max_pct == Approx(data.tests[0].capacity_As * (1.0 - 1.0 / 1.02) / rated_As * 100.0));
  CHECK(result.single.inside_uncertainty_pct == 100.0);
  // Together they start with the rated capacity and follow.
  CHECK(result.told.tests == 20);
  REQUIRE(result.rows[19].told_As);
  CHECK(*result.rows[19].told_As == Approx(*result.rows[19].single_As).epsilon(0.03));
  CHECK(*result.rows[19].told_As > *result.rows[19].single_As);  // lagging
}

TEST_CASE("before the first charge that shows it nothing is scored, and then every test is", "[unit][bmucell]") {
  AgeingData data = ageing(10);
  data.charges[0].samples.resize(20);
  data.charges[4].samples.resize(20);
  const HealthResult result = score_health({.model = model, .rated_As = rated_As}, data);
  CHECK(result.rows.size() == 10);
  CHECK_FALSE(result.rows[0].single_As);
  CHECK_FALSE(result.rows[0].told_As);
  CHECK(result.rows[1].told_As);
  CHECK_FALSE(result.rows[4].single_As);
  CHECK(result.rows[4].told_As);
  CHECK(result.single.tests == 8);
  CHECK(result.told.tests == 9);
  const HealthResult nothing =
      score_health({.model = model, .rated_As = rated_As, .when = {.from_voltage_V = 4.1}}, data);
  CHECK(nothing.rows.size() == 10);
  CHECK(nothing.single.tests == 0);
  CHECK(nothing.told.tests == 0);
}

TEST_CASE("a test without a charge of its own counts only if that is wanted", "[unit][bmucell]") {
  AgeingData data = ageing(10);
  CapacityTest again = data.tests[3];
  again.has_own_charge = false;
  data.tests.insert(data.tests.begin() + 4, again);
  CHECK(score_health({.model = model, .rated_As = rated_As}, data).rows.size() == 10);
  CHECK(score_health({.model = model, .rated_As = rated_As, .scores_all_tests = true}, data).rows.size() == 11);
  const auto fit = fit_plateau(data, model, rated_As, 1e9);
  REQUIRE(fit);
  CHECK(fit->charges == 10);
}

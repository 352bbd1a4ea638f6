// Scores of estimators on recordings with a known outcome.
#include <cmath>

#include "tests/support/catch.hpp"
#include "tests/support/simulated_cell.hpp"
#include "tools/bmucell/evaluate.hpp"

using namespace bmu;
using namespace bmu::cell;

namespace {

/// Recording of 10 Ah, discharged with 5 A for `seconds`, a row a second: half a percent in 36 s.
Series discharge(double seconds) {
  Series series{.name = "discharge.csv", .has_temperature = true, .has_soc = true};
  for (double time_s = 1.0; time_s <= seconds; time_s += 1.0) {
    series.rows.push_back({time_s, 5.0, 3.6, 25.0, 1.0 - 5.0 * time_s / 36'000.0});
  }
  return series;
}

Score score_of(const EvaluationPlan& plan, const Series& series) {
  const auto evaluation = evaluate(plan, test::sloped_cell(), series);
  REQUIRE(evaluation);
  CHECK(evaluation->trace.size() == evaluation->score.rows);
  return evaluation->score;
}

}  // namespace

TEST_CASE("counting with a right sensor from the right start is right all the time", "[unit][bmucell]") {
  const Score score = score_of({.method = SocMethod::coulomb}, discharge(3600));
  CHECK(score.file == "discharge.csv");
  CHECK(score.rows == 3600);
  CHECK(score.max_pct < 1e-6);
  CHECK(score.settle_3pct_s == 0.0);
  CHECK(score.inside_uncertainty_pct == 100.0);
}

TEST_CASE("counting with 2 % too much and 0.1 A is off by what they add up to", "[unit][bmucell]") {
  const Score score =
      score_of({.method = SocMethod::coulomb, .sensor_gain = 1.02, .sensor_offset_A = 0.1}, discharge(3600));
  // 0.2 A too much: 2 % in the hour, less the share of the first row; the root mean square of a ramp is its end over
  // the root of three.
  constexpr double end_pct = 0.2 * 3599.0 / 36'000.0 * 100.0;
  CHECK(score.max_pct == Approx(end_pct).epsilon(1e-6));
  CHECK(score.rmse_pct == Approx(2.0 / std::sqrt(3.0)).epsilon(1e-3));
  // From 20 min to 60 min the ramp goes from 2/3 to 2.
  REQUIRE(score.rmse_after_20min_pct);
  CHECK(*score.rmse_after_20min_pct == Approx(std::sqrt((8.0 - 8.0 / 27.0) / 3.0 / (4.0 / 3.0))).epsilon(1e-3));
  CHECK(*score.max_after_20min_pct == Approx(end_pct).epsilon(1e-6));
}

TEST_CASE("a wrong start stays wrong for who only counts, and is inside what a tenth of uncertainty allows",
          "[unit][bmucell]") {
  const Score score = score_of({.method = SocMethod::coulomb, .soc_error = -0.1}, discharge(3600));
  CHECK(score.rmse_pct == Approx(10.0));
  CHECK_FALSE(score.settle_3pct_s);
  CHECK(score.inside_uncertainty_pct == 100.0);
}

TEST_CASE("a start above full counts as full", "[unit][bmucell]") {
  CHECK(score_of({.method = SocMethod::coulomb, .soc_error = 0.1}, discharge(60)).max_pct < 0.1);
}

TEST_CASE("what a recording is too short for is not there", "[unit][bmucell]") {
  const Score score = score_of({.method = SocMethod::coulomb}, discharge(1201));
  CHECK_FALSE(score.rmse_after_20min_pct);
  CHECK_FALSE(score.max_after_20min_pct);
  CHECK(score_of({.method = SocMethod::coulomb}, discharge(1202)).rmse_after_20min_pct);
}

TEST_CASE("it begins where the charge has come down to what was asked", "[unit][bmucell]") {
  const auto evaluation =
      evaluate({.method = SocMethod::coulomb, .from_soc = 0.75}, test::sloped_cell(), discharge(3600));
  REQUIRE(evaluation);
  CHECK(evaluation->trace.front().time_s == 1800.0);
  CHECK(evaluation->score.rows == 1801);
  CHECK(evaluation->score.left_out.before_start == 1799);
  const auto never = evaluate({.from_soc = 0.2}, test::sloped_cell(), discharge(3600));
  REQUIRE_FALSE(never);
  CHECK(never.error() == "discharge.csv: ref_soc_pct is never as low as --from-soc");
}

TEST_CASE("a recording without reference cannot be scored", "[unit][bmucell]") {
  Series series = discharge(60);
  series.has_soc = false;
  const auto evaluation = evaluate({}, test::sloped_cell(), series);
  REQUIRE_FALSE(evaluation);
  CHECK(evaluation.error() == "discharge.csv: no column 'ref_soc_pct', which says what the charge really was");
}

TEST_CASE("rows out of time and rows without a reference do not count", "[unit][bmucell]") {
  Series series = discharge(100);
  series.rows[50].time_s = series.rows[49].time_s;
  series.rows[60].soc = std::nan("");
  const Score score = score_of({.method = SocMethod::coulomb}, series);
  CHECK(score.rows == 98);
  CHECK(score.left_out.before_start == 0);
  CHECK(score.left_out.time_not_forward == 1);
  CHECK(score.left_out.without_reference == 1);
  CHECK(mean_of({score, score}).left_out.count() == 4);
}

TEST_CASE("the same seed makes the same noise, another one another", "[unit][bmucell]") {
  EvaluationPlan plan{.voltage_noise_V = 0.005, .current_noise_A = 0.1, .seed = 7};
  const double first = score_of(plan, discharge(1300)).rmse_pct;
  CHECK(score_of(plan, discharge(1300)).rmse_pct == first);
  plan.seed = 8;
  CHECK(score_of(plan, discharge(1300)).rmse_pct != first);
}

TEST_CASE("the filter finds its way back from a wrong start with a wrong sensor, counting does not",
          "[unit][bmucell]") {
  const CellDynamics cell = test::sloped_cell();
  test::SimulatedCell truth(cell, {.soc = 0.95, .hysteresis = 1.0});
  test::SimulatedDrive drive(cell, 5);
  Series series{.name = "drive", .has_temperature = true, .has_soc = true};
  for (double time_s = 1.0; time_s <= 7200.0; time_s += 1.0) {
    const CellSample sample = truth.run(1.0, drive.current_A(1.0, truth.soc()), 25.0);
    series.rows.push_back({time_s, sample.current_A, sample.voltage_V, 25.0, truth.soc()});
  }
  EvaluationPlan plan{.sensor_gain = 1.02, .sensor_offset_A = 0.05, .soc_error = -0.1};
  const Score filtered = score_of(plan, series);
  plan.method = SocMethod::coulomb;
  const Score counted = score_of(plan, series);
  CHECK(*filtered.rmse_after_20min_pct < 1.0);
  CHECK(filtered.settle_3pct_s);
  CHECK(*counted.rmse_after_20min_pct > 9.0);
}

TEST_CASE("the mean is that of the files that have the figure", "[unit][bmucell]") {
  const Score mean =
      mean_of({{.rows = 10, .rmse_pct = 1.0, .rmse_after_20min_pct = 3.0, .inside_uncertainty_pct = 90.0},
               {.rows = 20, .rmse_pct = 2.0, .inside_uncertainty_pct = 100.0}});
  CHECK(mean.rows == 30);
  CHECK(mean.rmse_pct == 1.5);
  CHECK(mean.rmse_after_20min_pct == 3.0);
  CHECK_FALSE(mean.max_after_20min_pct);
  CHECK(mean.inside_uncertainty_pct == 95.0);
}

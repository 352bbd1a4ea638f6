// Scores of resistance estimators on recordings with a known outcome.
#include "tools/bmucell/resistance_score.hpp"

#include <cmath>

#include "daemon/core/estimation/health/expected_resistance.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/simulated_cell.hpp"

using namespace bmu;
using namespace bmu::cell;

namespace {

constexpr double resistance_Ohm = 0.006;

/// Recording of pulses of 10 A and ten seconds, a row a second, with a rest before each, down from 90 %; the cell is a
/// pure resistor. And the pulse table that a test bench would write.
struct Bench {
  explicit Bench(int pulses, double soc_step = 0.1) {
    double soc = 0.9;
    for (int pulse = 0; pulse < pulses; ++pulse) {
      soc = 0.9 - soc_step * pulse;
      for (int second = 0; second < 60; ++second) row(0.0, soc);
      table.rows.push_back({soc, 10.0, resistance_Ohm, 25.0});
      for (int second = 0; second < 10; ++second) row(10.0, soc);
    }
    for (int second = 0; second < 60; ++second) row(0.0, soc);
  }
  void row(double current_A, double soc) {
    const auto time_s = static_cast<double>(series.rows.size());
    series.rows.push_back({time_s, current_A, 3.7 - resistance_Ohm * current_A, 25.0, soc});
  }
  [[nodiscard]] ResistanceEvaluation evaluate() const {
    const auto evaluation = evaluate_resistance(test::sloped_cell(), series, table);
    REQUIRE(evaluation);
    REQUIRE(evaluation->scores.size() == 4);
    return *evaluation;
  }

  Series series{.name = "pulses.csv", .has_temperature = true, .has_soc = true};
  PulseTable table{.name = "table.csv", .column = "r_1s_mohm"};
};

}  // namespace

TEST_CASE("both methods find what a resistor is", "[unit][bmucell][BMS_F.6]") {
  const ResistanceEvaluation evaluation = Bench(8).evaluate();
  REQUIRE(evaluation.pulses.size() == 8);
  CHECK(evaluation.pulses[0].time_s == 60.0);
  CHECK(evaluation.pulses[1].time_s == 130.0);
  // A pulse has two steps, and three are required.
  for (std::size_t method = 0; method < resistance_methods; ++method) {
    CHECK_FALSE(evaluation.pulses[0].told[method]);
    REQUIRE(evaluation.pulses[1].told[method]);
    CHECK(evaluation.pulses[1].told[method]->resistance_Ohm == Approx(resistance_Ohm).epsilon(0.01));
  }
  CHECK(evaluation.pulses[1].told[0]->sigma_Ohm);
  CHECK_FALSE(evaluation.pulses[1].told[1]->sigma_Ohm);
  for (const ResistanceScore& score : evaluation.scores) {
    CHECK(score.pulses == 8);
    CHECK(score.told == 7);
    CHECK(score.within_5_pct == 7);
    CHECK(*score.rms_pct < 0.5);
    CHECK(*score.max_pct < 1.0);
  }
  CHECK(evaluation.scores[0].method == ResistanceMethod::recursive);
  CHECK(evaluation.scores[0].is_all);
  CHECK_FALSE(evaluation.scores[1].is_all);
  CHECK(evaluation.scores[2].method == ResistanceMethod::steps);
  CHECK(*evaluation.scores[0].inside_uncertainty_pct == 100.0);
  CHECK_FALSE(evaluation.scores[2].inside_uncertainty_pct);
}

TEST_CASE("what is off is told in percent of the table, with its sign", "[unit][bmucell]") {
  Bench bench(4);
  // 6 mOhm are 20 % more than 5 and 4 % less than 6.25.
  bench.table.rows[1].resistance_Ohm = 0.005;
  bench.table.rows[2].resistance_Ohm = 0.00625;
  bench.table.rows[3].resistance_Ohm = 0.005;
  for (const ResistanceScore& score : bench.evaluate().scores) {
    CHECK(*score.max_pct == Approx(20.0).epsilon(0.01));
    CHECK(*score.mean_pct == Approx(12.0).epsilon(0.01));
    CHECK(*score.rms_pct == Approx(std::sqrt(816.0 / 3.0)).epsilon(0.01));
    CHECK(score.within_5_pct == 1);
  }
  CHECK(*bench.evaluate().scores[0].inside_uncertainty_pct == Approx(100.0 / 3.0));
}

TEST_CASE("the nearly empty cell is scored with the others and left out once", "[unit][bmucell]") {
  Bench bench(9);  // the last at 10 %
  const ResistanceEvaluation evaluation = bench.evaluate();
  CHECK(evaluation.scores[0].pulses == 9);
  CHECK(evaluation.scores[1].pulses == 8);
  CHECK(evaluation.scores[2].pulses == 9);
  CHECK(evaluation.scores[3].pulses == 8);
}

TEST_CASE("what a method never told has no figures", "[unit][bmucell]") {
  for (const ResistanceScore& score : Bench(1).evaluate().scores) {
    CHECK(score.pulses == 1);
    CHECK(score.told == 0);
    CHECK_FALSE(score.rms_pct);
    CHECK_FALSE(score.max_pct);
    CHECK_FALSE(score.mean_pct);
    CHECK_FALSE(score.inside_uncertainty_pct);
  }
}

TEST_CASE("both are compared at the temperature of the table", "[unit][bmucell]") {
  Bench bench(6);
  const double factor = ExpectedResistance(test::sloped_cell()).factor(0.0);
  for (PulseRow& row : bench.table.rows) row.temperature_C = 0.0;
  const ResistanceEvaluation evaluation = bench.evaluate();
  CHECK(evaluation.pulses[5].told[0]->resistance_Ohm == Approx(resistance_Ohm * factor).epsilon(0.01));
  CHECK(evaluation.pulses[5].told[1]->resistance_Ohm == Approx(resistance_Ohm).epsilon(0.01));  // not compensated
}

TEST_CASE("rows in which the current changed are no picture for the method of steps", "[unit][bmucell]") {
  Bench bench(6);
  // The pulses began in the middle of a row: half the current, and a voltage that does not belong to it.
  for (SeriesRow& row : bench.series.rows) {
    const bool is_first = row.current_A != 0.0 && std::fmod(row.time_s, 70.0) == 60.0;
    if (is_first) row = {row.time_s, 5.0, 3.69, row.temperature_C, row.soc};
  }
  const ResistanceEvaluation evaluation = bench.evaluate();
  CHECK(evaluation.pulses[5].told[1]->resistance_Ohm == Approx(resistance_Ohm).epsilon(0.01));
}

TEST_CASE("a recording without temperatures, or without the table's pulses, cannot be scored", "[unit][bmucell]") {
  Bench bench(2);
  bench.series.has_temperature = false;
  const auto cold = evaluate_resistance(test::sloped_cell(), bench.series, bench.table);
  REQUIRE_FALSE(cold);
  CHECK(cold.error() == "pulses.csv: no column 'temp_C'; resistance follows the temperature");
  bench.series.has_temperature = true;
  bench.table.rows.push_back({0.01, 10.0, 0.006, 25.0});
  CHECK_FALSE(evaluate_resistance(test::sloped_cell(), bench.series, bench.table));
}

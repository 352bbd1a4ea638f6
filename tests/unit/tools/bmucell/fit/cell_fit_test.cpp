// Fit of cells with known tables: fitted values, unchanged values, and results that must never occur.
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "tests/support/catch.hpp"
#include "tests/support/simulated_cell.hpp"
#include "tools/bmucell/fit/fit.hpp"
#include "tools/bmucell/fit/fit_data.hpp"
#include "tools/bmucell/fit/normal_equations.hpp"
#include "tools/bmucell/fit/slow_curve.hpp"

using namespace bmu;
using namespace bmu::cell;

namespace {

/// Cell with the time constants and charge transfer of the plan below, so that its tables can be found at all.
CellDynamics known_cell() {
  CellDynamics cell = test::sloped_cell();
  cell.activation_K = 4000.0;
  cell.pair_time_constant_s = {6.0, 60.0, 350.0};
  for (CellDynamics::Row& row : cell.rows) {
    const double cold = resistance_factor(4000.0, row.temperature_C);
    row.exchange_current_A = 0.5 * 10.0 / resistance_factor(5000.0, row.temperature_C);
    row.series_Ohm.fill(0.004 * cold);
    row.kinetic_Ohm.fill(0.002 * cold);
    for (auto& pair_Ohm : row.pair_Ohm) pair_Ohm.fill(0.002 * cold);
  }
  return cell;
}

FitPlan plan_of(const CellDynamics& cell) {
  FitPlan plan;
  plan.capacity_Ah = cell.capacity_As / 3600.0;
  plan.temperatures_C.clear();
  for (const CellDynamics::Row& row : cell.rows) plan.temperatures_C.push_back(row.temperature_C);
  return plan;
}

FitWishes wishes_of(const CellDynamics& cell) {
  FitWishes wishes;
  wishes.typical_Ohm = cell.rows.back().series_Ohm[10];
  return wishes;
}

Series recording(const CellDynamics& cell, double temperature_C, double hours, double noise_V, std::uint64_t seed) {
  test::SimulatedCell truth(cell, {.soc = 0.999, .hysteresis = 1.0, .voltage_noise_V = noise_V, .seed = seed});
  test::SimulatedDrive drive(cell, seed);
  Series series{.name = "simulated", .has_temperature = true, .has_soc = true};
  for (double time_s = 1.0; time_s <= hours * 3600.0; time_s += 1.0) {
    const CellSample sample = truth.run(1.0, drive.current_A(1.0, truth.soc()), temperature_C);
    series.rows.push_back({time_s, sample.current_A, sample.voltage_V, temperature_C, truth.soc()});
  }
  return series;
}

std::vector<FitSeries> recordings(const CellDynamics& cell, double noise_V) {
  return {{.series = recording(cell, -10.0, 5.0, noise_V, 1)}, {.series = recording(cell, 25.0, 5.0, noise_V, 2)}};
}

double settled_Ohm(const CellDynamics::Row& row, std::size_t point) {
  double sum = row.series_Ohm[point] + row.kinetic_Ohm[point];
  for (const auto& pair_Ohm : row.pair_Ohm) sum += pair_Ohm[point];
  return sum;
}

}  // namespace

TEST_CASE("least squares of a line through four points is the one worked out by hand", "[unit][bmucell]") {
  NormalEquations equations(2);
  // y = 1, 3, 4, 8 at x = 0 to 3: slope 2.2, at zero 0.7; squared residuals: 0.09 + 0.01 + 1.21 + 0.49.
  const std::vector<double> values{1.0, 3.0, 4.0, 8.0};
  for (std::size_t x = 0; x < values.size(); ++x)
    equations.add({{0, 1.0}, {1, static_cast<double>(x)}}, values[x], 0.5);
  const Eigen::VectorXd solution = equations.solve();
  CHECK(solution[0] == Approx(0.7));
  CHECK(solution[1] == Approx(2.2));
  CHECK(equations.misfit(solution) == Approx(1.8 / 0.25));
}

TEST_CASE("from recordings without noise the tables are found again", "[unit][bmucell]") {
  const CellDynamics truth = known_cell();
  const Fit found = fit(plan_of(truth), wishes_of(truth), recordings(truth, 0.0));
  REQUIRE(found.cell.rows.size() == 2);
  CHECK(found.cell.capacity_As == truth.capacity_As);
  for (std::size_t row = 0; row < 2; ++row) {
    const CellDynamics::Row& is = found.cell.rows[row];
    const CellDynamics::Row& shall = truth.rows[row];
    for (std::size_t point = 8; point <= 46; ++point) CHECK(std::abs(is.ocv_V[point] - shall.ocv_V[point]) < 0.004);
    for (std::size_t point = 4; point <= 18; ++point) {
      CHECK(is.series_Ohm[point] == Approx(shall.series_Ohm[point]).epsilon(0.15));
      CHECK(settled_Ohm(is, point) == Approx(settled_Ohm(shall, point)).epsilon(0.08));
    }
  }
  for (const FitQuality& one : found.quality) CHECK(one.rmse_V < 0.002);
}

TEST_CASE("noise makes the tables a little worse, and the error that is told as large as it is", "[unit][bmucell]") {
  const CellDynamics truth = known_cell();
  const Fit found = fit(plan_of(truth), wishes_of(truth), recordings(truth, 0.010));
  for (std::size_t row = 0; row < 2; ++row) {
    for (std::size_t point = 8; point <= 46; ++point) {
      CHECK(std::abs(found.cell.rows[row].ocv_V[point] - truth.rows[row].ocv_V[point]) < 0.008);
    }
    CHECK(found.cell.rows[row].fast_error_V == Approx(0.010).epsilon(0.15));
    CHECK(found.cell.rows[row].slow_error_V < 0.002);
  }
}

TEST_CASE("the same recordings give the same tables", "[unit][bmucell]") {
  const CellDynamics truth = known_cell();
  const std::vector<FitSeries> data = recordings(truth, 0.010);
  const Fit first = fit(plan_of(truth), wishes_of(truth), data);
  const Fit second = fit(plan_of(truth), wishes_of(truth), data);
  for (std::size_t row = 0; row < 2; ++row) {
    CHECK(first.cell.rows[row].ocv_V == second.cell.rows[row].ocv_V);
    CHECK(first.cell.rows[row].pair_Ohm == second.cell.rows[row].pair_Ohm);
  }
}

TEST_CASE("no resistance is below nothing and no curve falls, whatever the recording says", "[unit][bmucell]") {
  Series nonsense = recording(known_cell(), 25.0, 1.0, 0.0, 3);
  for (SeriesRow& row : nonsense.rows) row.voltage_V = 7.4 - row.voltage_V;  // rises while the cell is discharged
  const CellDynamics truth = known_cell();
  const Fit found = fit(plan_of(truth), wishes_of(truth), {{.series = nonsense}});
  for (const CellDynamics::Row& row : found.cell.rows) {
    for (std::size_t point = 1; point < row.ocv_V.size(); ++point) CHECK(row.ocv_V[point] > row.ocv_V[point - 1]);
    for (std::size_t point = 0; point < row.series_Ohm.size(); ++point) {
      CHECK(row.series_Ohm[point] >= 0.0);
      CHECK(row.kinetic_Ohm[point] >= 0.0);
      CHECK(row.hysteresis_V[point] >= 0.0);
      for (const auto& pair_Ohm : row.pair_Ohm) CHECK(pair_Ohm[point] >= 0.0);
    }
  }
  CHECK(found.quality.front().rmse_V > 0.05);
}

TEST_CASE("rows in which something was not measured do not count", "[unit][bmucell]") {
  const CellDynamics truth = known_cell();
  std::vector<FitSeries> data{{.series = recording(truth, 25.0, 1.0, 0.0, 4)}};
  data[0].series.rows[100].voltage_V = not_measured;
  data[0].series.rows[200].current_A = not_measured;
  data[0].series.rows[300].temperature_C = not_measured;
  const Fit found = fit(plan_of(truth), wishes_of(truth), data);
  CHECK(found.quality.front().rows == 3597);
  CHECK(found.quality.front().rmse_V < 0.002);
}

TEST_CASE("a slow curve with a counter of its own is laid onto the curve by its shape", "[unit][bmucell]") {
  CellDynamics cell = known_cell();
  // A curvature, because any shift would fit otherwise.
  for (CellDynamics::Row& row : cell.rows) {
    for (std::size_t point = 0; point < row.ocv_V.size(); ++point) {
      const double soc = static_cast<double>(point) / 50.0;
      row.ocv_V[point] = 3.2 + 0.9 * soc + 0.1 * std::sin(6.0 * soc);
    }
  }
  Series slow{.name = "slow", .has_temperature = true, .has_soc = true};
  const CellPoint half = at(cell, 0.5, 25.0);
  const double settled = half.series_Ohm + half.kinetic_Ohm + half.pair_Ohm[0] + half.pair_Ohm[1] + half.pair_Ohm[2];
  for (int minute = 0; minute <= 1200; ++minute) {
    const double soc = 1.0 - minute / 1200.0;
    // The counter shows 4 % more than the charge removed since full; and the voltage is 12 mV too low throughout.
    const double counted = 1.0 - 1.04 * (1.0 - soc);
    slow.rows.push_back({minute * 60.0, 0.5, at(cell, soc, 25.0).ocv_V - 0.5 * settled - 0.012, 25.0, counted});
  }
  const ChargeAxes axes = lay_onto(cell, slow);
  CHECK(axes[0].at_full == Approx(0.0).margin(0.005));
  CHECK(axes[0].of(1.0 - 1.04 * 0.5) == Approx(0.5).margin(0.01));
  CHECK(axes[1].at_full == 0.0);  // no charge was recorded
  CHECK(axes[1].at_empty == 0.0);
}

TEST_CASE("the halves of a slow curve part at the first charging current", "[unit][bmucell]") {
  Series series{.name = "slow"};
  for (const double current_A : {0.5, 0.5, 0.0, -0.05, -0.5, 0.0}) series.rows.push_back({.current_A = current_A});
  CHECK(halves_of(series, 10.0) == std::vector<std::size_t>{0, 0, 0, 0, 1, 1});
}

TEST_CASE("temperatures of the tables are where the recordings are, each once", "[unit][bmucell]") {
  const auto at_C = [](double temperature_C, bool is_slow_curve) {
    FitSeries one{.is_slow_curve = is_slow_curve};
    for (int row = 0; row < 20; ++row)
      one.series.rows.push_back({.temperature_C = temperature_C + (row < 5 ? 9.0 : 0.0)});
    return one;
  };
  CHECK(temperatures_of({at_C(24.6, false), at_C(-10.2, false), at_C(27.0, false), at_C(40.0, true)}) ==
        std::vector<double>{-10.0, 25.0});
  CHECK(temperatures_of({at_C(40.0, true)}) == std::vector<double>{40.0});
}

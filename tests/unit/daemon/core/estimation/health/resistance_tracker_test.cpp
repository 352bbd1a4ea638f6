// Resistance of a cell from arbitrary changes of its current.
#include "daemon/core/estimation/health/resistance_tracker.hpp"

#include <algorithm>
#include <cmath>

#include "tests/support/catch.hpp"
#include "tests/support/simulated_cell.hpp"

using namespace bmu;

namespace {

constexpr double warm_C = 25.0;

/// Cell of 10 Ah: about 5 mOhm, its 1C current is 10 A.
const CellDynamics& cell_of_10_Ah() {
  static const CellDynamics cell = test::sloped_cell();
  return cell;
}

const ExpectedResistance& expected() {
  static const ExpectedResistance told(cell_of_10_Ah());
  return told;
}

/// Cell modelled as a pure resistor, and steps of its current.
struct Resistor {
  explicit Resistor(double with_Ohm, double every_s = 1.0) : resistance_Ohm(with_Ohm), sample_s(every_s) {
    tracker.begin(expected());
    feed();
  }

  [[nodiscard]] CellSample sample() const {
    return {.passed_s = sample_s,
            .current_A = current_A,
            .voltage_V = ocv_V - resistance_Ohm * current_A,
            .temperature_C = temperature_C};
  }
  void feed() { tracker.update(sample()); }
  void run(double seconds) {
    for (double time_s = 0.0; time_s < seconds - 0.5 * sample_s; time_s += sample_s) feed();
  }
  /// Steps up and down in turn, far enough apart to be independent.
  void steps(int count, double size_A = 10.0, double apart_s = 15.0) {
    for (int step = 0; step < count; ++step) {
      current_A = current_A == 0.0 ? size_A : 0.0;
      run(apart_s);
    }
  }
  [[nodiscard]] ResistanceEstimate told() const { return tracker.estimate(warm_C); }
  [[nodiscard]] double told_Ohm() const { return told().resistance_Ohm; }

  double resistance_Ohm;
  double sample_s;
  double ocv_V = 3.7;
  double current_A = 0.0;
  double temperature_C = warm_C;
  ResistanceTracker tracker;
};

/// Cell with a settled estimate.
Resistor settled(double resistance_Ohm = 0.005) {
  Resistor cell(resistance_Ohm);
  cell.steps(40);
  REQUIRE(cell.told().is_known);
  REQUIRE(cell.told_Ohm() == Approx(resistance_Ohm).epsilon(1e-3));
  return cell;
}

}  // namespace

TEST_CASE("steps of the current tell the resistance, however often the cell is sampled",
          "[unit][estimators][BMS_F.6]") {
  for (const double sample_s : {0.05, 0.1, 0.5, 1.0, 2.0}) {
    for (const double resistance_Ohm : {0.002, 0.005, 0.02}) {
      CAPTURE(sample_s, resistance_Ohm);
      Resistor cell(resistance_Ohm, sample_s);
      cell.steps(12);
      CHECK(cell.told().is_known);
      CHECK(cell.told_Ohm() == Approx(resistance_Ohm).epsilon(0.01));
    }
  }
}

TEST_CASE("two steps are no measurement, three are, however large and however often sampled",
          "[unit][estimators][BMS_F.6]") {
  for (const double sample_s : {0.1, 1.0}) {
    for (const double size_A : {20.0, 200.0}) {
      CAPTURE(sample_s, size_A);
      Resistor cell(0.005, sample_s);
      cell.steps(2, size_A);
      CHECK_FALSE(cell.told().is_known);
      CHECK(cell.told().resistance_Ohm == 0.0);
      cell.steps(1, size_A);
      CHECK(cell.told().is_known);
      CHECK(cell.told().sigma_Ohm < 0.0003);
      CHECK(cell.told().sigma_Ohm > 0.0002);  // the error of the method remains
    }
  }
}

TEST_CASE("in the cold it takes three steps, too", "[unit][estimators][BMS_F.6]") {
  Resistor cell(0.005 * expected().factor(-10.0));
  cell.temperature_C = -10.0;
  cell.steps(2, 50.0);
  CHECK_FALSE(cell.told().is_known);
  cell.steps(1, 50.0);
  CHECK(cell.told().is_known);
}

TEST_CASE("told is what a step shows through high-passes of two seconds", "[unit][estimators][BMS_F.6]") {
  constexpr double pair_Ohm = 0.020;
  for (const double pair_s : {1.0, 5.0}) {
    CAPTURE(pair_s);
    Resistor cell(0.003, 0.05);
    double pair_V = 0.0;
    for (int sample = 0; sample < 40'000; ++sample) {
      cell.current_A = sample / 1000 % 2 == 0 ? 10.0 : 0.0;
      pair_V += (pair_Ohm * cell.current_A - pair_V) * (1.0 - std::exp(-0.05 / pair_s));
      cell.ocv_V = 3.7 - pair_V;
      cell.feed();
    }
    CHECK(cell.told_Ohm() == Approx(0.003 + pair_Ohm * 2.0 / (2.0 + pair_s)).epsilon(0.03));
  }
}

TEST_CASE("steps that are lost in the noise count for less", "[unit][estimators][BMS_F.6]") {
  Resistor cell(0.005);
  cell.steps(10, 1.0);  // 5 mV against 2 mV of noise
  CHECK_FALSE(cell.told().is_known);
  cell.steps(200, 1.0);
  CHECK(cell.told().is_known);
}

TEST_CASE("less than a twentieth of the one-hour current is no step", "[unit][estimators][BMS_F.6]") {
  Resistor small(0.005);
  small.steps(5000, 0.499);
  CHECK_FALSE(small.told().is_known);
  for (const double size_A : {0.5, 0.501}) {
    Resistor enough(0.005);
    enough.steps(3000, size_A, 120.0);  // until the previous step has decayed
    CHECK(enough.told().is_known);
    CHECK(enough.told_Ohm() == Approx(0.005).epsilon(0.01));
  }
}

TEST_CASE("a ramp is as good as a step", "[unit][estimators][BMS_F.6]") {
  for (const double sample_s : {0.1, 1.0}) {
    CAPTURE(sample_s);
    Resistor cell(0.007, sample_s);
    for (double time_s = 0.0; time_s < 600.0; time_s += sample_s) {
      const double phase = std::fmod(time_s, 20.0);
      cell.current_A = phase < 10.0 ? 3.0 * phase : 3.0 * (20.0 - phase);
      cell.feed();
    }
    CHECK(cell.told_Ohm() == Approx(0.007).epsilon(0.005));
  }
}

namespace {

/// Resistance shown by a step of the simulated cell after a second.
double shown_Ohm(const test::SimulatedCellOptions& options, double temperature_C) {
  constexpr double step_A = 10.0;
  test::SimulatedCell cell(cell_of_10_Ah(), options);
  const double before_V = cell.voltage_V(0.0, temperature_C);
  cell.run(1.0, step_A, temperature_C);
  return (before_V - cell.voltage_V(step_A, temperature_C)) / step_A;
}

struct Driven {
  ResistanceEstimate told;
  double true_Ohm = 0.0;
};

Driven driven(const test::SimulatedCellOptions& options, double hours, double sample_s = 1.0,
              double temperature_C = warm_C) {
  test::SimulatedCell cell(cell_of_10_Ah(), options);
  test::SimulatedDrive drive(cell_of_10_Ah(), options.seed);
  ResistanceTracker tracker;
  tracker.begin(expected());
  for (double time_s = 0.0; time_s < hours * 3600.0; time_s += sample_s) {
    tracker.update(cell.run(sample_s, drive.current_A(sample_s, cell.soc()), temperature_C));
  }
  return {tracker.estimate(temperature_C),
          shown_Ohm({.soc = 0.5, .resistance_share = options.resistance_share}, temperature_C)};
}

}  // namespace

TEST_CASE("a cell that is better or worse than its model shows it while it is driven, through the noise",
          "[unit][estimators][BMS_F.6]") {
  for (const double share : {-0.3, 0.0, 0.4, 2.0}) {
    for (const double sample_s : {0.1, 1.0}) {
      CAPTURE(share, sample_s);
      const Driven found =
          driven({.soc = 0.9, .resistance_share = share, .voltage_noise_V = 0.002, .seed = 3}, 0.5, sample_s);
      REQUIRE(found.told.is_known);
      CHECK(found.told.resistance_Ohm == Approx(found.true_Ohm).epsilon(0.05));
      CHECK(std::abs(found.told.resistance_Ohm - found.true_Ohm) < 2.0 * found.told.sigma_Ohm);
      CHECK(found.told.sigma_Ohm < 0.08 * found.told.resistance_Ohm);
    }
  }
}

TEST_CASE("a sensor that tells 2 % too much makes the resistance 2 % less, one with an offset nothing",
          "[unit][estimators][BMS_F.6]") {
  const double right_Ohm = driven({.soc = 0.9}, 0.5).told.resistance_Ohm;
  CHECK(driven({.soc = 0.9, .sensor_gain = 0.02}, 0.5).told.resistance_Ohm == Approx(right_Ohm / 1.02).epsilon(1e-3));
  CHECK(driven({.soc = 0.9, .sensor_offset_A = 0.5}, 0.5).told.resistance_Ohm == Approx(right_Ohm).epsilon(1e-3));
}

TEST_CASE("the truth lies within two of the told standard deviations", "[unit][estimators][BMS_F.6]") {
  test::Chance chance(11);
  int inside = 0;
  constexpr int cells = 60;
  for (int cell = 0; cell < cells; ++cell) {
    const double share = chance.between(-0.4, 1.5);
    const double temperature_C = chance.between(-10.0, 35.0);
    const Driven found = driven({.soc = chance.between(0.3, 0.9),
                                 .resistance_share = share,
                                 .voltage_noise_V = 0.003,
                                 .slow_error_share = 1.0,
                                 .seed = static_cast<std::uint64_t>(cell)},
                                0.2, 1.0, temperature_C);
    REQUIRE(found.told.is_known);
    if (std::abs(found.told.resistance_Ohm - found.true_Ohm) < 2.0 * found.told.sigma_Ohm) ++inside;
  }
  CHECK(inside >= cells * 95 / 100);
}

TEST_CASE("a voltage that drifts under a steady load says nothing of the resistance", "[unit][estimators][BMS_F.6]") {
  Resistor cell = settled();
  const double before_Ohm = cell.told_Ohm();
  cell.current_A = 5.0;
  cell.run(30.0);
  const double loaded_Ohm = cell.told_Ohm();
  CHECK(loaded_Ohm == Approx(before_Ohm).epsilon(1e-3));
  for (int second = 0; second < 1800; ++second) {
    cell.ocv_V -= 0.0005;
    cell.feed();
  }
  CHECK(cell.told_Ohm() == loaded_Ohm);
  // Little effect beside steps, too: half a millivolt a second is 1 mV in the high-pass, of 50.
  for (int second = 0; second < 600; ++second) {
    cell.ocv_V -= 0.0005;
    cell.current_A = second / 15 % 2 == 0 ? 15.0 : 5.0;
    cell.feed();
  }
  CHECK(cell.told_Ohm() == Approx(0.005).epsilon(0.02));
}

TEST_CASE("a current that is said to stand still teaches nothing, whatever the voltage does",
          "[unit][estimators][BMS_F.6]") {
  Resistor cell = settled();
  const double before_Ohm = cell.told_Ohm();
  test::Chance chance(5);
  for (int second = 0; second < 3600; ++second) {
    cell.current_A = chance.between(-0.1, 0.1);
    cell.ocv_V = 3.7 + chance.between(-0.04, 0.04);
    cell.feed();
  }
  CHECK(cell.told_Ohm() == before_Ohm);
}

TEST_CASE("what was not measured is passed over, and the next sample is compared with the last that was",
          "[unit][estimators][BMS_F.6]") {
  Resistor with = settled();
  Resistor without = settled();
  for (Resistor* cell : {&with, &without}) {
    cell->resistance_Ohm = 0.006;
    cell->current_A = 20.0;
  }
  with.sample_s = 0.5;
  CellSample torn = with.sample();
  torn.voltage_V = not_measured;
  with.tracker.update(torn);
  torn = with.sample();
  torn.current_A = 1e9;  // far out of range
  with.tracker.update(torn);
  with.feed();
  without.sample_s = 1.5;
  without.feed();
  CHECK(with.told_Ohm() == Approx(without.told_Ohm()).epsilon(1e-12));
  CHECK(with.told_Ohm() > 0.00502);
}

TEST_CASE("across a gap nothing is learned", "[unit][estimators][BMS_F.6]") {
  for (const double gap_s : {2.5, 2.51}) {
    CAPTURE(gap_s);
    Resistor cell = settled();
    const double before_Ohm = cell.told_Ohm();
    cell.resistance_Ohm = 0.006;
    cell.current_A = 20.0;
    cell.sample_s = gap_s;
    cell.feed();
    CHECK((cell.told_Ohm() > 1.001 * before_Ohm) == (gap_s <= 2.5));
    cell.sample_s = 1.0;
    const double after_Ohm = cell.told_Ohm();
    cell.run(10.0);
    if (gap_s > 2.5) CHECK(cell.told_Ohm() == after_Ohm);
  }
}

TEST_CASE("time that stands still, runs backwards or beyond all measure is a gap", "[unit][estimators][BMS_F.6]") {
  for (const double passed_s : {0.0, -1.0, 1e11, not_measured}) {
    CAPTURE(passed_s);
    Resistor cell = settled();
    const double before_Ohm = cell.told_Ohm();
    cell.resistance_Ohm = 0.006;
    cell.current_A = 20.0;
    cell.sample_s = passed_s;
    cell.feed();
    cell.sample_s = 1.0;
    cell.feed();
    cell.feed();
    CHECK(cell.told_Ohm() == before_Ohm);
    CHECK(std::isfinite(cell.told().sigma_Ohm));
  }
}

TEST_CASE("a jump of the voltage that no current explains is not held against the next step",
          "[unit][estimators][BMS_F.6]") {
  for (const double jump_V : {0.09, 0.11, 2.0, 1e5}) {
    for (const double sign : {-1.0, 1.0}) {
      CAPTURE(jump_V, sign);
      Resistor cell = settled();
      cell.ocv_V += sign * jump_V;
      cell.feed();
      cell.current_A = 20.0;
      cell.feed();
      const bool is_passed_on = std::abs(cell.told_Ohm() / 0.005 - 1.0) > 0.005;
      CHECK(is_passed_on == (jump_V < 0.1));
    }
  }
}

TEST_CASE("what a slow answer does just after a step is no jump", "[unit][estimators][BMS_F.6]") {
  Resistor cell = settled();
  cell.resistance_Ohm = 0.006;
  cell.current_A = 100.0;
  cell.feed();
  cell.ocv_V -= 0.15;
  cell.feed();
  const double soon_Ohm = cell.told_Ohm();
  cell.feed();
  CHECK(cell.told_Ohm() > soon_Ohm);  // the 0.15 V are still in the high-pass
}

TEST_CASE("a jump is seen without a temperature as well", "[unit][estimators][BMS_F.6]") {
  Resistor cell = settled();
  cell.temperature_C = not_measured;
  cell.ocv_V += 0.5;
  cell.feed();
  cell.temperature_C = warm_C;
  cell.current_A = 20.0;
  cell.feed();
  CHECK(cell.told_Ohm() == Approx(0.005).epsilon(1e-3));
}

TEST_CASE("behind a large step small ones count for little, for half a minute", "[unit][estimators][BMS_F.6]") {
  const auto moved_by = [](double after_s, double large_A) {
    Resistor cell = settled();
    cell.run(60.0);
    cell.current_A = large_A;
    cell.run(after_s);
    const double before_Ohm = cell.told_Ohm();
    cell.resistance_Ohm = 0.0055;
    cell.ocv_V += 0.0005 * cell.current_A;  // only further changes see the new resistance
    cell.current_A += 8.0;
    cell.run(15.0);
    return cell.told_Ohm() / before_Ohm - 1.0;
  };
  const double alone = moved_by(60.0, 0.0);
  CHECK(alone > 0.001);
  CHECK(moved_by(20.0, 100.0) < 0.15 * alone);
  CHECK(moved_by(60.0, 100.0) > 0.05 * alone);
  CHECK(moved_by(60.0, 100.0) < 0.30 * alone);
  CHECK(moved_by(180.0, 100.0) > 0.95 * alone);
}

TEST_CASE("one wrong answer moves the resistance by little", "[unit][estimators][BMS_F.6]") {
  for (const double wrong_V : {-0.09, 0.09}) {
    CAPTURE(wrong_V);
    Resistor cell = settled();
    cell.current_A = 10.0;
    cell.ocv_V += wrong_V;  // instead of 0.05 V
    cell.run(15.0);
    CHECK(std::abs(cell.told_Ohm() / 0.005 - 1.0) == Approx(0.0365).margin(0.005));
  }
}

TEST_CASE("a cell that really becomes twice as bad is known to be so within ten minutes of driving",
          "[unit][estimators][BMS_F.6][BMS_F.7]") {
  Resistor cell = settled();
  cell.resistance_Ohm = 0.010;
  cell.steps(5, 10.0, 12.0);
  CHECK(cell.told_Ohm() < 0.008);  // not confirmed within a minute
  cell.steps(45, 10.0, 12.0);
  CHECK(cell.told_Ohm() > 0.0095);
  CHECK(cell.told_Ohm() < 0.0101);
}

TEST_CASE("more than twenty times the model is a loose bolt, not a cell", "[unit][estimators][BMS_F.6]") {
  const double model_Ohm = expected().at_reference_Ohm();
  Resistor poor(15.0 * model_Ohm);
  poor.steps(20, 20.0);
  CHECK(poor.told_Ohm() == Approx(15.0 * model_Ohm).epsilon(0.01));
  Resistor loose(25.0 * model_Ohm);
  loose.steps(200, 20.0);
  CHECK_FALSE(loose.told().is_known);
}

TEST_CASE("a sensor the wrong way round makes no resistance, and none below zero", "[unit][estimators][BMS_F.6]") {
  Resistor fresh(-0.005);
  fresh.steps(200);
  CHECK_FALSE(fresh.told().is_known);
  Resistor turned = settled();
  turned.resistance_Ohm = -0.005;
  turned.steps(1000);
  CHECK(turned.told_Ohm() == Approx(expected().at_reference_Ohm() / 20.0));
}

TEST_CASE("the resistance is that at 25 C and does not follow the weather", "[unit][estimators][BMS_F.6]") {
  Resistor cell = settled();
  for (const double temperature_C : {10.0, -5.0, 40.0}) {
    CAPTURE(temperature_C);
    cell.temperature_C = temperature_C;
    const double factor = expected().factor(temperature_C);
    cell.resistance_Ohm = 0.005 * factor;
    cell.steps(60);
    CHECK(cell.told_Ohm() == Approx(0.005).epsilon(1e-3));
    CHECK(cell.tracker.estimate(temperature_C).resistance_Ohm == Approx(0.005 * factor).epsilon(1e-3));
    CHECK(cell.tracker.estimate(temperature_C).sigma_Ohm < 0.06 * std::max(factor, 1.0) * 0.005 * factor);
  }
}

TEST_CASE("at another temperature than it was learned at it is less sure", "[unit][estimators][BMS_F.6]") {
  const Resistor cell = settled();
  const ResistanceEstimate warm = cell.tracker.estimate(25.0);
  const ResistanceEstimate cold = cell.tracker.estimate(-10.0);
  const double factor = expected().factor(-10.0);
  CHECK(cold.resistance_Ohm == Approx(warm.resistance_Ohm * factor));
  // 4 %, increased by the factor, and a fifth of the temperature effect.
  const double share = std::hypot(0.04 * factor, 0.2 * (factor - 1.0));
  CHECK(cold.sigma_Ohm / cold.resistance_Ohm == Approx(share).epsilon(0.03));
  CHECK(warm.sigma_Ohm / warm.resistance_Ohm == Approx(0.04).epsilon(0.15));
  const double hot_factor = expected().factor(45.0);
  const ResistanceEstimate hot = cell.tracker.estimate(45.0);
  CHECK(hot.sigma_Ohm / hot.resistance_Ohm == Approx(std::hypot(0.04, 0.2 * (1.0 / hot_factor - 1.0))).epsilon(0.1));
}

TEST_CASE("where it was learned only the method is in doubt, in the cold more, in the warm not less",
          "[unit][estimators][BMS_F.6]") {
  for (const double temperature_C : {-10.0, 25.0, 45.0}) {
    CAPTURE(temperature_C);
    const double factor = expected().factor(temperature_C);
    Resistor cell(0.005 * factor);
    cell.temperature_C = temperature_C;
    cell.steps(300);
    const ResistanceEstimate told = cell.tracker.estimate(temperature_C);
    constexpr double after_many_steps = 0.022;
    const double share = std::hypot(0.04 * std::max(factor, 1.0), after_many_steps);
    CHECK(told.sigma_Ohm / told.resistance_Ohm == Approx(share).epsilon(0.06));
  }
}

TEST_CASE("without a temperature nothing is learned and nothing told", "[unit][estimators][BMS_F.6]") {
  Resistor cell = settled();
  CHECK_FALSE(cell.tracker.estimate(not_measured).is_known);
  const double before_Ohm = cell.told_Ohm();
  cell.temperature_C = not_measured;
  cell.resistance_Ohm = 0.006;
  cell.steps(20);
  CHECK(cell.told_Ohm() == before_Ohm);
  cell.temperature_C = warm_C;
  cell.steps(1);
  CHECK(cell.told_Ohm() > 1.01 * before_Ohm);
}

TEST_CASE("a model with one resistance for all temperatures needs none", "[unit][estimators][BMS_F.6]") {
  CellDynamics cell = cell_of_10_Ah();
  cell.activation_K = 0.0;
  cell.rows[0] = cell.rows[1];
  cell.rows[0].temperature_C = -10.0;
  const ExpectedResistance same(cell);
  ResistanceTracker tracker;
  tracker.begin(same);
  for (int second = 0; second < 200; ++second) {
    const double current_A = second / 15 % 2 == 0 ? 0.0 : 10.0;
    tracker.update({.passed_s = 1.0, .current_A = current_A, .voltage_V = 3.7 - 0.008 * current_A});
  }
  CHECK(tracker.estimate(not_measured).is_known);
  CHECK(tracker.estimate(not_measured).resistance_Ohm == Approx(0.008).epsilon(0.01));
}

TEST_CASE("with time it is less sure, but never forgets", "[unit][estimators][BMS_F.6]") {
  Resistor cell = settled();
  const double before_Ohm = cell.told_Ohm();
  const double before_sigma_Ohm = cell.told().sigma_Ohm;
  cell.run(3600.0);
  const double share = std::hypot(before_sigma_Ohm / before_Ohm, 0.10);
  CHECK(cell.told().sigma_Ohm == Approx(share * before_Ohm).epsilon(1e-3));
  for (int week = 0; week < 3; ++week) {
    cell.tracker.update({.passed_s = 7.0 * 86'400.0});
    CHECK(cell.told().sigma_Ohm == Approx(std::hypot(0.04, 0.15) * before_Ohm).epsilon(1e-3));
  }
  CHECK(cell.told().is_known);
  CHECK(cell.told_Ohm() == before_Ohm);
}

TEST_CASE("who switches a cell's bleeding begins anew and loses nothing", "[unit][estimators][balancing][BMS_F.6]") {
  for (const bool restarts : {true, false}) {
    CAPTURE(restarts);
    Resistor cell = settled();
    const double before_Ohm = cell.told_Ohm();
    if (restarts) cell.tracker.restart();
    cell.ocv_V -= 0.03;
    cell.current_A = 10.0;
    cell.run(15.0);
    CHECK(cell.told().is_known);
    CHECK((cell.told_Ohm() == before_Ohm) == restarts);
  }
}

TEST_CASE("what a step left behind is gone with a new beginning", "[unit][estimators][BMS_F.6]") {
  Resistor cell = settled();
  cell.current_A = 60.0;
  cell.feed();
  const double before_Ohm = cell.told_Ohm();
  cell.tracker.restart();
  cell.ocv_V -= 0.05;
  cell.feed();
  cell.feed();
  CHECK(cell.told_Ohm() == before_Ohm);
  // The following step counts in full, like one after a long rest.
  Resistor rested = settled();
  rested.current_A = 60.0;
  rested.feed();
  rested.run(300.0);
  for (Resistor* one : {&cell, &rested}) {
    one->resistance_Ohm = 0.0055;
    one->ocv_V += 0.0005 * one->current_A;
    one->current_A += 8.0;
    one->run(15.0);
  }
  CHECK(cell.told_Ohm() - 0.005 > 0.25 * (rested.told_Ohm() - 0.005));
  CHECK(cell.told_Ohm() < rested.told_Ohm());
}

TEST_CASE("before it is told of its cell, and after another one, nothing is known", "[unit][estimators][BMS_F.6]") {
  ResistanceTracker fresh;
  for (int step = 0; step < 100; ++step) {
    fresh.update({.passed_s = 1.0, .current_A = step % 2 * 10.0, .voltage_V = 3.7, .temperature_C = 25.0});
  }
  CHECK_FALSE(fresh.estimate(25.0).is_known);
  Resistor cell = settled();
  cell.tracker.begin(expected());
  CHECK_FALSE(cell.told().is_known);
}

TEST_CASE("756 of them fit where they must", "[unit][estimators]") {
  CHECK(sizeof(ResistanceTracker) <= 96);
}

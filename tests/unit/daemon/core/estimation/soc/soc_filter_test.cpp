// SOC filter against independently simulated cells: its accuracy, the consistency of its sigma, and its behaviour with
// invalid samples. The limits are measured values, with a margin for another drive.
#include "daemon/core/estimation/soc/soc_filter.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "tests/support/catch.hpp"
#include "tests/support/simulated_cell.hpp"

using namespace bmu;
using test::SimulatedCell;
using test::SimulatedCellOptions;
using test::SimulatedDrive;

namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();
constexpr CurrentSensorError sensor{.gain = 0.01, .offset_A = 0.01, .unknown_current_A = 1.0};

struct Trial {
  double temperature_C = 25.0;
  double step_s = 1.0;
  std::uint64_t drive = 1;
};

/// Filter beside the simulated cell, which is unknown to it, with statistics of its error.
class Race {
 public:
  Race(const CellDynamics& cell, const SimulatedCellOptions& truth, const SocBegin& begin, const Trial& trial = {})
      : truth_(cell, truth), drive_(cell, trial.drive), trial_(trial) {
    filter.begin(cell, sensor, begin, trial.temperature_C);
  }

  void run(double seconds) {
    const auto steps = static_cast<int>(std::lround(seconds / trial_.step_s));
    for (int step = 0; step < steps; ++step) take(next());
  }
  CellSample next() {
    return truth_.run(trial_.step_s, drive_.current_A(trial_.step_s, truth_.soc()), trial_.temperature_C);
  }
  void take(const CellSample& sample) {
    filter.update(sample);
    const double off = error();
    const double sigma = filter.estimate().sigma;
    samples_ += 1.0;
    within_two_ += off <= 2.0 * sigma ? 1.0 : 0.0;
    worst = std::max(worst, off);
    beyond_three_s_ = off > 3.0 * sigma ? beyond_three_s_ + trial_.step_s : 0.0;
    longest_beyond_three_s = std::max(longest_beyond_three_s, beyond_three_s_);
  }
  [[nodiscard]] double error() const { return std::abs(filter.estimate().soc - std::clamp(truth_.soc(), 0.0, 1.0)); }
  [[nodiscard]] double honest_share() const { return within_two_ / samples_; }
  [[nodiscard]] const SimulatedCell& truth() const { return truth_; }

  SocFilter filter;
  double worst = 0.0;
  double longest_beyond_three_s = 0.0;

 private:
  SimulatedCell truth_;
  SimulatedDrive drive_;
  Trial trial_;
  double samples_ = 0.0;
  double within_two_ = 0.0;
  double beyond_three_s_ = 0.0;
};

bool is_sound(const SocEstimate& estimate) {
  return estimate.is_known && estimate.soc >= 0.0 && estimate.soc <= 1.0 && estimate.sigma > 0.0 &&
         estimate.sigma <= 1.0;
}

CellSample nothing(double passed_s) {
  return {.passed_s = passed_s};
}

}  // namespace

TEST_CASE("a filter that is right stays right, hour after hour, at any temperature", "[unit][estimators]") {
  const CellDynamics cell = test::sloped_cell();
  for (const double temperature_C : {25.0, 0.0, -10.0, -25.0}) {
    CAPTURE(temperature_C);
    Race race(cell, {.soc = 0.8}, {.soc = 0.8, .sigma = 0.05}, {.temperature_C = temperature_C});
    race.run(4.0 * 3600.0);
    CHECK(race.worst < 0.001);
    CHECK(race.filter.resistance_share() == Approx(0.0).margin(0.01));
    CHECK(race.filter.counting_share() == Approx(0.0).margin(0.002));
    CHECK(race.filter.offset_A() == Approx(0.0).margin(0.002));
  }
}

TEST_CASE("a filter finds a charge that it took for 20 % more or less", "[unit][estimators]") {
  const CellDynamics cell = test::sloped_cell();
  for (const double temperature_C : {25.0, -10.0, -25.0}) {
    for (const double begin : {0.4, 0.8}) {
      CAPTURE(temperature_C, begin);
      Race race(cell, {.soc = 0.6}, {.soc = begin, .sigma = 0.2}, {.temperature_C = temperature_C});
      CHECK(race.error() == Approx(0.2));
      race.run(600.0);
      race.worst = 0.0;
      race.run(3600.0);
      CHECK(race.worst < 0.01);
      CHECK(race.honest_share() > 0.99);
      CHECK(race.filter.estimate().sigma < 0.03);
    }
  }
}

TEST_CASE("what flowed before and the hysteresis need not be known", "[unit][estimators]") {
  const CellDynamics cell = test::sloped_cell();
  Race race(cell, {.soc = 0.6, .hysteresis = -1.0}, {.soc = 0.7, .sigma = 0.2, .is_rested = false});
  race.run(2.0 * 3600.0);
  CHECK(race.error() < 0.01);
  CHECK(race.honest_share() > 0.95);
  CHECK(race.filter.hysteresis() == Approx(race.truth().hysteresis()).margin(0.01));
}

TEST_CASE("the truth is where the filter says, with a sensor that errs as it may", "[unit][estimators]") {
  const CellDynamics cell = test::sloped_cell();
  for (const double temperature_C : {25.0, -25.0}) {
    for (const double gain : {-0.01, 0.01}) {
      for (const double offset_A : {-0.01, 0.01}) {
        CAPTURE(temperature_C, gain, offset_A);
        Race race(cell,
                  {.soc = 0.8,
                   .sensor_gain = gain,
                   .sensor_offset_A = offset_A,
                   .voltage_noise_V = 0.003,
                   .slow_error_share = 1.0,
                   .seed = 11},
                  {.soc = 0.8, .sigma = 0.05}, {.temperature_C = temperature_C, .drive = 3});
        race.run(6.0 * 3600.0);
        CHECK(race.honest_share() >= 0.9);
        CHECK(race.longest_beyond_three_s < 60.0);
        CHECK(race.worst < 0.05);
      }
    }
  }
}

TEST_CASE("the truth is where the filter says on a curve with a plateau and a knee", "[unit][estimators]") {
  const CellDynamics cell = test::flat_cell();
  for (const double model : {0.0, 1.0}) {
    for (const double gain : {-0.01, 0.01}) {
      for (const double offset_A : {-0.01, 0.01}) {
        CAPTURE(model, gain, offset_A);
        Race race(cell,
                  {.soc = 0.8,
                   .sensor_gain = gain,
                   .sensor_offset_A = offset_A,
                   .voltage_noise_V = 0.003,
                   .slow_error_share = model,
                   .seed = 11},
                  {.soc = 0.8, .sigma = 0.05}, {.drive = 3});
        race.run(6.0 * 3600.0);
        CHECK(race.honest_share() >= 0.9);
        CHECK(race.longest_beyond_three_s < 600.0);
      }
    }
  }
}

TEST_CASE("a cell that aged beyond its model is followed within 5 %", "[unit][estimators]") {
  const CellDynamics cell = test::sloped_cell();
  for (const double temperature_C : {25.0, -10.0}) {
    CAPTURE(temperature_C);
    Race race(cell, {.soc = 0.8, .capacity_share = -0.15, .resistance_share = 0.4, .voltage_noise_V = 0.003},
              {.soc = 0.8, .sigma = 0.05}, {.temperature_C = temperature_C, .drive = 5});
    race.run(2.0 * 3600.0);
    CHECK(race.worst < 0.05);
    race.worst = 0.0;
    race.run(6.0 * 3600.0);
    CHECK(race.worst < 0.03);
    CHECK(race.longest_beyond_three_s < 300.0);
    // 1 / 0.85 of the counted charge is missing, and a part of the 40 % is found.
    CHECK(race.filter.counting_share() == Approx(1.0 - 1.0 / 0.85).margin(0.06));
    CHECK(race.filter.resistance_share() > 0.2);
    CHECK(race.filter.resistance_share() < 0.5);
  }
}

TEST_CASE("on a plateau the voltage says little, and the doubt grows", "[unit][estimators]") {
  const CellDynamics cell = test::flat_cell();
  SimulatedCell truth(cell, {.soc = 0.85});
  SocFilter filter;
  filter.begin(cell, sensor, {.soc = 0.85, .sigma = 0.003}, 25.0);
  double before = filter.estimate().sigma;
  for (int hour = 0; hour < 5; ++hour) {
    for (int second = 0; second < 3600; ++second) filter.update(truth.run(1.0, 1.0, 25.0));
    CAPTURE(hour);
    CHECK(filter.estimate().sigma > before);
    before = filter.estimate().sigma;
  }
  // 50 % flowed with an unknown 1 % of gain and 2 % of capacity, and 10 mA for 5 hours.
  const double counted = std::hypot(0.003, 0.5 * std::hypot(0.01, 0.02), 0.01 * 5.0 / 10.0);
  CHECK(before > 0.8 * counted);
  CHECK(before < 1.5 * counted + 1e-6);
  CHECK(std::abs(filter.estimate().soc - truth.soc()) < 0.005);
}

TEST_CASE("kinetics in the cold are no lack of charge", "[unit][estimators]") {
  CellDynamics cell = test::sloped_cell();
  for (CellDynamics::Row& row : cell.rows) {
    for (double& kinetic_Ohm : row.kinetic_Ohm) kinetic_Ohm *= 5.0;
    row.exchange_current_A *= 0.2;
  }
  // At -10 C 30 A take 0.14 V by the charge transfer; linearly it would be 1.1 V.
  const CellPoint point = at(cell, 0.5, -10.0);
  CHECK(kinetic_V(point, 30.0) < 0.3 * point.kinetic_Ohm * 30.0);
  Race race(cell, {.soc = 0.7, .voltage_noise_V = 0.003}, {.soc = 0.6, .sigma = 0.1}, {.temperature_C = -10.0});
  race.run(3.0 * 3600.0);
  CHECK(race.error() < 0.01);
  CHECK(race.honest_share() > 0.95);
}

TEST_CASE("ten samples a second for hours leave the filter sound", "[unit][estimators]") {
  const CellDynamics cell = test::sloped_cell();
  Race race(cell, {.soc = 0.8, .voltage_noise_V = 0.003}, {.soc = 0.75, .sigma = 0.05}, {.step_s = 0.1});
  for (int turn = 0; turn < 20; ++turn) {
    race.run(600.0);
    REQUIRE(is_sound(race.filter.estimate()));
  }
  CHECK(race.error() < 0.005);
  CHECK(race.filter.estimate().sigma < 0.02);
}

TEST_CASE("the same samples give the same estimates", "[unit][estimators]") {
  const CellDynamics cell = test::flat_cell();
  const SimulatedCellOptions options{.soc = 0.7, .voltage_noise_V = 0.005, .slow_error_share = 1.0, .seed = 3};
  Race first(cell, options, {.soc = 0.6});
  Race second(cell, options, {.soc = 0.6});
  second.filter.update(nothing(1e5));  // state from before its start
  second.filter.begin(cell, sensor, {.soc = 0.6}, 25.0);
  for (int turn = 0; turn < 2000; ++turn) {
    first.run(1.0);
    second.run(1.0);
    REQUIRE(first.filter.estimate().soc == second.filter.estimate().soc);
    REQUIRE(first.filter.estimate().sigma == second.filter.estimate().sigma);
  }
}

TEST_CASE("before its begin a filter knows nothing and learns nothing", "[unit][estimators]") {
  SocFilter filter;
  filter.update({.passed_s = 1.0, .mean_current_A = 5.0, .current_A = 5.0, .voltage_V = 3.7, .temperature_C = 25.0});
  CHECK_FALSE(filter.estimate().is_known);
  CHECK(filter.estimate().sigma == 1.0);
  const CellDynamics cell = test::sloped_cell();
  filter.begin(cell, sensor, {.soc = 0.4, .sigma = 0.1}, not_measured);
  CHECK(filter.estimate().soc == 0.4);
  CHECK(filter.estimate().sigma == Approx(0.15));
}

TEST_CASE("with nothing measured the doubt grows until all is possible, and no further", "[unit][estimators]") {
  const CellDynamics cell = test::sloped_cell();
  SocFilter filter;
  filter.begin(cell, sensor, {.soc = 0.7, .sigma = 0.02}, 25.0);
  double before = filter.estimate().sigma;
  for (int minute = 0; minute < 120; ++minute) {
    filter.update(nothing(60.0));
    REQUIRE(filter.estimate().sigma > before);
    before = filter.estimate().sigma;
  }
  // 1 A may have flowed for two hours.
  CHECK(before == Approx(1.5 * (0.02 + 0.2)).epsilon(0.01));
  CHECK(filter.estimate().soc == Approx(0.7));
  filter.update(nothing(1e9));
  CHECK(filter.estimate().sigma == 1.0);
  SimulatedCell truth(cell, {.soc = 0.3});
  filter.update(truth.run(1.0, 5.0, 25.0));
  CHECK(filter.innovation_variance_V2() < 1.0);  // of 0.9 V from empty to full
  for (int second = 0; second < 599; ++second) filter.update(truth.run(1.0, 5.0, 25.0));
  CHECK(filter.estimate().soc == Approx(truth.soc()).margin(0.02));
}

TEST_CASE("a sensor that says nothing adds nothing to the current", "[unit][estimators]") {
  const CellDynamics cell = test::sloped_cell();
  SocFilter filter;
  filter.begin(cell, {.gain = 0.01, .offset_A = 0.5, .unknown_current_A = 0.1}, {.soc = 0.7, .sigma = 0.01}, 25.0);
  SimulatedCell truth(cell, {.soc = 0.7, .sensor_offset_A = 0.5});
  for (int second = 0; second < 4 * 3600; ++second) filter.update(truth.run(1.0, 0.0, 25.0));
  REQUIRE(filter.offset_A() > 0.2);
  const double before = filter.estimate().soc;
  for (int minute = 0; minute < 60; ++minute) filter.update(nothing(60.0));
  CHECK(filter.estimate().soc == Approx(before).margin(1e-9));
}

TEST_CASE("without a temperature the last one holds, without a voltage it is counting", "[unit][estimators]") {
  const CellDynamics cell = test::sloped_cell();
  SocFilter filter;
  filter.begin(cell, sensor, {.soc = 0.7, .sigma = 0.02}, 25.0);
  for (int second = 0; second < 3600; ++second) {
    filter.update({.passed_s = 1.0, .mean_current_A = 2.0, .current_A = 2.0, .temperature_C = 25.0});
  }
  CHECK(filter.estimate().soc == Approx(0.5));
  CHECK(filter.estimate().sigma == Approx(1.5 * std::hypot(0.02, 0.2 * std::hypot(0.01, 0.02), 0.001)).epsilon(0.02));

  SimulatedCell truth(cell, {.soc = 0.7});
  filter.begin(cell, sensor, {.soc = 0.6, .sigma = 0.1}, -20.0);
  for (int second = 0; second < 1800; ++second) {
    CellSample sample = truth.run(1.0, 2.0, -20.0);
    sample.temperature_C = not_measured;
    filter.update(sample);
  }
  CHECK(filter.estimate().soc == Approx(truth.soc()).margin(0.03));
}

TEST_CASE("without a voltage a filter counts with the losses, and its doubt is that of the sensor",
          "[unit][estimators]") {
  CellDynamics cell = test::sloped_cell();
  cell.charge_efficiency = 0.95;
  SocFilter filter;
  filter.begin(cell, sensor, {.soc = 0.3, .sigma = 0.02}, 25.0);
  for (int second = 0; second < 360; ++second) {
    filter.update({.passed_s = 1.0, .mean_current_A = -20.0, .temperature_C = 25.0});
  }
  CHECK(filter.estimate().soc == Approx(0.3 + 0.95 * 0.2));
  for (int second = 0; second < 360; ++second) {
    filter.update({.passed_s = 1.0, .mean_current_A = 20.0, .temperature_C = 25.0});
  }
  CHECK(filter.estimate().soc == Approx(0.3 - 0.05 * 0.2));

  cell.self_discharge_per_month = 0.04;
  filter.begin(cell, sensor, {.soc = 0.3, .sigma = 0.02}, 35.0);
  for (int hour = 0; hour < 240; ++hour) filter.update({.passed_s = 3600.0, .mean_current_A = 0.0});
  CHECK(filter.estimate().soc == Approx(0.3 - 0.08 / 3.0));
}

TEST_CASE("an offset comes and goes: its doubt grows with the root of a long time", "[unit][estimators]") {
  const CellDynamics cell = test::sloped_cell();
  SocFilter filter;
  filter.begin(cell, {.gain = 0.01, .offset_A = 0.1, .unknown_current_A = 1.0}, {.soc = 0.5, .sigma = 0.001}, 25.0);
  for (int minute = 0; minute < 50 * 60; ++minute) {
    filter.update({.passed_s = 60.0, .mean_current_A = 0.0, .temperature_C = 25.0});
  }
  // The integral of an Ornstein-Uhlenbeck process of ten hours over fifty; a constant offset would be 0.75.
  const double counted_Ah = 0.1 * std::sqrt(2.0 * 10.0 * (50.0 - 10.0 * (1.0 - std::exp(-5.0))));
  CHECK(filter.estimate().sigma == Approx(1.5 * counted_Ah / 10.0).epsilon(0.01));
}

TEST_CASE("a resistance that was learned is forgotten again when no voltage confirms it", "[unit][estimators]") {
  const CellDynamics cell = test::sloped_cell();
  Race race(cell, {.soc = 0.8, .resistance_share = 0.3}, {.soc = 0.8, .sigma = 0.02});
  race.run(3600.0);
  const double learned = race.filter.resistance_share();
  REQUIRE(learned > 0.15);
  double before = learned;
  for (int hour = 0; hour < 5; ++hour) {
    for (int second = 0; second < 3600; ++second) {
      CellSample sample = race.next();
      sample.voltage_V = not_measured;
      race.take(sample);
    }
    CHECK(race.filter.resistance_share() < before);
    before = race.filter.resistance_share();
  }
  CHECK(before < 0.1 * learned);
}

TEST_CASE("a filter that begins in the middle of a drive takes less of the drop for a lack of charge",
          "[unit][estimators]") {
  CellDynamics cell = test::sloped_cell();
  for (CellDynamics::Row& row : cell.rows) {
    for (auto& pair_Ohm : row.pair_Ohm) pair_Ohm.fill(0.005);
  }
  const auto error_when = [&](bool is_rested) {
    SimulatedCell truth(cell, {.soc = 0.9});
    for (int second = 0; second < 1200; ++second) truth.run(1.0, 6.0, 25.0);
    SocFilter filter;
    filter.begin(cell, sensor, {.soc = truth.soc(), .sigma = 0.05, .is_rested = is_rested, .hysteresis = -1.0}, 25.0);
    double worst = 0.0;
    for (int second = 0; second < 600; ++second) {
      filter.update(truth.run(1.0, 0.0, 25.0));
      worst = std::max(worst, std::abs(filter.estimate().soc - truth.soc()));
    }
    return worst;
  };
  CHECK(error_when(true) > 0.05);
  CHECK(error_when(false) < 0.05);
}

TEST_CASE("a hysteresis is begun with, and no more than all of it", "[unit][estimators]") {
  const CellDynamics cell = test::sloped_cell();
  SocFilter filter;
  for (const double told : {-1.0, -0.3, 0.0, 1.0}) {
    filter.begin(cell, sensor, {.hysteresis = told}, 25.0);
    CHECK(filter.hysteresis() == told);
  }
  filter.begin(cell, sensor, {.hysteresis = 1.7}, 25.0);
  CHECK(filter.hysteresis() == 1.0);
  // Two thirds of the way after 3 % of the capacity.
  filter.begin(cell, sensor, {.hysteresis = 1.0}, 25.0);
  for (int second = 0; second < 108; ++second) filter.update({.passed_s = 1.0, .mean_current_A = 10.0});
  CHECK(filter.hysteresis() == Approx(-1.0 + 2.0 * std::exp(-1.0)));
}

TEST_CASE("what is not seen makes a voltage count for less", "[unit][estimators]") {
  const CellDynamics cell = test::sloped_cell();
  const auto expected_V2 = [&](double unknown_A, const CellSample& last) {
    SocFilter filter;
    filter.begin(cell, {.gain = 0.0, .offset_A = 0.0, .unknown_current_A = unknown_A}, {.soc = 0.5, .sigma = 0.001},
                 25.0);
    filter.update(last);
    return filter.innovation_variance_V2();
  };
  const CellSample seen{
      .passed_s = 10.0, .mean_current_A = 0.0, .current_A = 0.0, .voltage_V = 3.65, .temperature_C = 25.0};
  CellSample warmth_unknown = seen;
  warmth_unknown.temperature_C = not_measured;
  // Three times 4 mV instead of once.
  CHECK(expected_V2(100.0, warmth_unknown) - expected_V2(100.0, seen) == Approx(8.0 * 0.004 * 0.004).epsilon(1e-3));
  CellSample current_unknown = seen;
  current_unknown.mean_current_A = not_measured;
  CHECK(expected_V2(0.0, current_unknown) == Approx(expected_V2(0.0, seen)));
  // 100 A for 10 s: 0.9 V times the charge, and 1 mOhm of each RC element as far as it settles.
  const auto follows = [](double time_s) { return 0.01 * (1.0 - std::exp(-20.0 / time_s)); };
  const double charge_V = 0.9 * (0.001 + 1000.0 / 36'000.0);
  CHECK(expected_V2(100.0, current_unknown) - expected_V2(100.0, seen) ==
        Approx(charge_V * charge_V - 0.0009 * 0.0009 + follows(10.0) + follows(100.0) + follows(1000.0)).epsilon(0.01));
}

TEST_CASE("time that does not pass, or all of it, is no sample for a filter", "[unit][estimators]") {
  const CellDynamics cell = test::sloped_cell();
  for (const double passed_s : {0.0, -1.0, -1e9, -infinite, infinite, not_measured}) {
    CAPTURE(passed_s);
    SocFilter filter;
    filter.begin(cell, sensor, {.soc = 0.7, .sigma = 0.1}, 25.0);
    const SocEstimate before = filter.estimate();
    filter.update({passed_s, 5.0, 5.0, 3.5, 25.0});
    filter.update(nothing(passed_s));
    CHECK(filter.estimate().soc == before.soc);
    CHECK(filter.estimate().sigma == before.sigma);
  }
}

TEST_CASE("no value makes a filter forget itself, once or for an hour", "[unit][estimators]") {
  const CellDynamics cell = test::sloped_cell();
  for (const double bad : {not_measured, infinite, -infinite, 1e308, -1e308, 1e200, -1e12}) {
    for (int which = 0; which < 6; ++which) {
      for (const int samples : {1, 3600}) {
        CAPTURE(bad, which, samples);
        Race race(cell, {.soc = 0.7}, {.soc = 0.7, .sigma = 0.05});
        race.run(60.0);
        for (int count = 0; count < samples; ++count) {
          CellSample sample = race.next();
          if (which == 0 || which == 4) sample.mean_current_A = bad;
          if (which == 1 || which == 4) sample.current_A = bad;
          if (which == 2 || which == 4) sample.voltage_V = bad;
          if (which == 3 || which == 4) sample.temperature_C = bad;
          if (which == 5) sample.passed_s = bad;
          race.take(sample);
          if (count % 100 == 0) REQUIRE(is_sound(race.filter.estimate()));
        }
        REQUIRE(is_sound(race.filter.estimate()));
        race.run(600.0);
        REQUIRE(is_sound(race.filter.estimate()));
        // The charge of an hour without valid times is lost.
        if (which != 5 || samples == 1) CHECK(race.error() < 0.03);
      }
    }
  }
}

TEST_CASE("a year in one sample is no end", "[unit][estimators]") {
  const CellDynamics cell = test::sloped_cell();
  for (const double current_A : {-500.0, 0.0, 500.0, 1e5}) {
    CAPTURE(current_A);
    Race race(cell, {.soc = 0.5}, {.soc = 0.7, .sigma = 0.05});
    race.filter.update({.passed_s = 1e9, .mean_current_A = current_A, .temperature_C = 25.0});
    CHECK(race.filter.estimate().sigma == 1.0);
    race.filter.update({1e9, current_A, current_A, 3.7, 25.0});
    REQUIRE(is_sound(race.filter.estimate()));
    race.run(600.0);
    REQUIRE(is_sound(race.filter.estimate()));
  }
}

TEST_CASE("the most that may flow and the longest that may pass leave a filter sound", "[unit][estimators]") {
  const CellDynamics cell = test::sloped_cell();
  for (const double current_A : {-9e5, 9e5}) {
    CAPTURE(current_A);
    Race race(cell, {.soc = 0.5}, {.soc = 0.7, .sigma = 0.05});
    race.filter.update({9e9, current_A, 0.0, 3.7, 25.0});
    for (int second = 0; second < 3600; ++second) {
      race.run(1.0);
      REQUIRE(is_sound(race.filter.estimate()));
    }
    CHECK(std::abs(race.filter.counting_share()) <= 0.5);
  }
}

TEST_CASE("one impossible voltage, or a minute of them, is hardly believed", "[unit][estimators]") {
  for (const bool is_flat : {false, true}) {
    const CellDynamics cell = is_flat ? test::flat_cell() : test::sloped_cell();
    for (const double voltage_V : {0.0, 2.0, 5.0, 60.0, -60.0}) {
      CAPTURE(is_flat, voltage_V);
      Race race(cell, {.soc = 0.7, .voltage_noise_V = 0.003}, {.soc = 0.7, .sigma = 0.05}, {.drive = 3});
      race.run(1800.0);
      const auto take_bad = [&](int samples) {
        for (int count = 0; count < samples; ++count) {
          CellSample sample = race.next();
          sample.voltage_V = voltage_V;
          race.take(sample);
        }
      };
      race.worst = 0.0;
      take_bad(1);
      CHECK(race.worst < 0.001);
      take_bad(60);
      CHECK(race.worst < 0.006);
      race.run(1800.0);
      CHECK(race.error() < 0.006);
    }
  }
}

TEST_CASE("after an hour of impossible voltages a filter is sound and no cell is turned round", "[unit][estimators]") {
  const CellDynamics cell = test::sloped_cell();
  for (const double voltage_V : {0.0, 2.0, 5.0, 60.0}) {
    CAPTURE(voltage_V);
    Race race(cell, {.soc = 0.7, .voltage_noise_V = 0.003}, {.soc = 0.7, .sigma = 0.05}, {.drive = 3});
    race.run(1800.0);
    for (int second = 0; second < 3600; ++second) {
      CellSample sample = race.next();
      sample.voltage_V = voltage_V;
      race.take(sample);
      REQUIRE(race.filter.resistance_share() > -0.9);
      REQUIRE(race.filter.resistance_share() < 5.0);
      REQUIRE(std::abs(race.filter.counting_share()) <= 0.5);
    }
    REQUIRE(is_sound(race.filter.estimate()));
    race.run(2.0 * 3600.0);
    REQUIRE(is_sound(race.filter.estimate()));
    // A voltage above the curve is the hardest case: a full cell does not contradict it.
    if (voltage_V != 5.0) CHECK(race.error() < 0.06);
  }
}

TEST_CASE("whatever comes, a filter knows a charge and how sure it is", "[unit][estimators]") {
  constexpr std::array bad{not_measured, infinite, -infinite, 1e308, -1e308, 1e12,   -1e5, 1e5,
                           1e-300,       0.0,      60.0,      -60.0, 500.0,  -500.0, 9e5};
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    CAPTURE(seed);
    const CellDynamics cell = seed % 2 == 0 ? test::flat_cell() : test::sloped_cell();
    test::Chance chance(seed);
    Race race(cell, {.soc = 0.6, .voltage_noise_V = 0.01, .seed = seed}, {.soc = 0.5, .sigma = 0.2},
              {.step_s = seed > 2 ? 0.1 : 1.0, .drive = seed});
    const auto any = [&] { return bad[static_cast<std::size_t>(chance.between(0.0, 15.0))]; };
    for (int turn = 0; turn < 60'000; ++turn) {
      CellSample sample = race.next();
      if (chance.one_in(20.0)) sample.mean_current_A = any();
      if (chance.one_in(20.0)) sample.current_A = any();
      if (chance.one_in(20.0)) sample.voltage_V = any();
      if (chance.one_in(20.0)) sample.temperature_C = any();
      if (chance.one_in(200.0)) sample.passed_s = chance.one_in(4.0) ? 1e9 : any();
      race.take(sample);
      CAPTURE(turn);
      REQUIRE(is_sound(race.filter.estimate()));
      REQUIRE(std::isfinite(race.filter.resistance_share()));
      REQUIRE(std::isfinite(race.filter.offset_A()));
      REQUIRE(std::abs(race.filter.hysteresis()) <= 1.0);
    }
    // The filter still works.
    race.run(10.0 * 3600.0 * (seed > 2 ? 0.1 : 1.0));
    CHECK(is_sound(race.filter.estimate()));
  }
}

TEST_CASE("an anchor is believed as far as it is sure, and what is no anchor not at all", "[unit][estimators]") {
  const CellDynamics cell = test::sloped_cell();
  SocFilter filter;
  filter.anchor(0.9, 0.01);
  CHECK_FALSE(filter.estimate().is_known);
  filter.begin(cell, sensor, {.soc = 0.5, .sigma = 0.1}, 25.0);
  const double told_factor = filter.estimate().sigma / 0.1;
  filter.anchor(0.6, 0.1);
  // Two equally certain values meet in the middle.
  CHECK(filter.estimate().soc == Approx(0.55));
  CHECK(filter.estimate().sigma == Approx(0.1 / std::sqrt(2.0) * told_factor));
  filter.anchor(0.56, 1e-6);
  CHECK(filter.estimate().soc == Approx(0.56));
  CHECK(filter.estimate().sigma < 1e-5);
  const SocEstimate before = filter.estimate();
  for (const double soc : {-0.01, 1.01, not_measured, infinite}) filter.anchor(soc, 0.01);
  for (const double sigma : {0.0, -0.1, not_measured, infinite}) filter.anchor(0.2, sigma);
  CHECK(filter.estimate().soc == before.soc);
  CHECK(filter.estimate().sigma == before.sigma);
}

TEST_CASE("a cell that is its model's fits it, one that differs fits it the less", "[unit][estimators]") {
  const CellDynamics cell = test::sloped_cell();
  Race right(cell, {.soc = 0.7, .voltage_noise_V = 0.003}, {.soc = 0.7, .sigma = 0.05}, {.drive = 3});
  right.run(3600.0);
  CHECK(right.filter.misfit() < 0.4);
  Race worn(cell, {.soc = 0.7, .resistance_share = 1.0}, {.soc = 0.7, .sigma = 0.05}, {.drive = 3});
  worn.run(3600.0);
  CHECK(worn.filter.misfit() >= worn.filter.resistance_share() / 4.0);
  CHECK(worn.filter.misfit() < 1.0);
}

TEST_CASE("a sensor the wrong way round makes a cell that is none of its model's", "[unit][estimators]") {
  const CellDynamics cell = test::sloped_cell();
  Race race(cell, {.soc = 0.7, .sensor_gain = -2.0}, {.soc = 0.7, .sigma = 0.05}, {.drive = 3});
  race.run(3600.0);
  CHECK(race.filter.misfit() >= 1.0);
}

TEST_CASE("voltages that are no cell's make a misfit within minutes, a single one none", "[unit][estimators]") {
  const CellDynamics cell = test::sloped_cell();
  Race race(cell, {.soc = 0.7}, {.soc = 0.7, .sigma = 0.05}, {.drive = 3});
  race.run(600.0);
  CellSample sample = race.next();
  sample.voltage_V = 60.0;
  race.take(sample);
  CHECK(race.filter.misfit() < 0.5);
  for (int second = 0; second < 120; ++second) {
    sample.voltage_V = 5.0;
    race.take(sample);
  }
  CHECK(race.filter.misfit() >= 1.0);
}

TEST_CASE("what may have flowed unseen is the sample's word, or the sensor's", "[unit][estimators]") {
  const CellDynamics cell = test::sloped_cell();
  const auto doubt_after = [&cell](double unseen_A) {
    SocFilter filter;
    filter.begin(cell, sensor, {.soc = 0.5, .sigma = 0.01}, 25.0);
    CellSample sample = nothing(3600.0);
    sample.unseen_current_A = unseen_A;
    filter.update(sample);
    return filter.estimate().sigma;
  };
  // 1 A of the sensor's error for an hour is a tenth of 10 Ah.
  const double by_sensor = doubt_after(not_measured);
  CHECK(doubt_after(1.0) == by_sensor);
  CHECK(doubt_after(-1.0) == by_sensor);
  CHECK(by_sensor - doubt_after(0.0) == Approx(0.1 * 1.5).epsilon(0.02));
}

TEST_CASE("who goes on where a filter ended learns nothing from the voltage that it had seen", "[unit][estimators]") {
  const CellDynamics cell = test::sloped_cell();
  const double slope_V = 0.9;
  const double model_error_V = cell.rows[0].slow_error_V;
  // As certain as a voltage makes it, with an error of the same size: 8 mV on 0.9 V.
  const double sigma = model_error_V / slope_V;
  const auto soc_after = [&](bool has_followed, double age_s) {
    SocFilter filter;
    filter.begin(cell, {}, {.soc = 0.5, .sigma = sigma, .has_followed = has_followed, .age_s = age_s}, 25.0);
    for (int second = 0; second < 5; ++second) {
      filter.update({.passed_s = 1.0,
                     .mean_current_A = 0.0,
                     .current_A = 0.0,
                     .voltage_V = 3.2 + slope_V * 0.5 + model_error_V,
                     .temperature_C = 25.0});
    }
    return filter.estimate().soc;
  };
  CHECK(soc_after(false, not_measured) > 0.502);
  CHECK(soc_after(true, not_measured) == Approx(0.5).margin(0.001));
  CHECK(soc_after(true, 10.0) == Approx(0.5).margin(0.001));
  CHECK(soc_after(true, 1e5) == Approx(soc_after(false, not_measured)).margin(0.0003));
}

TEST_CASE("a pair that nobody has seen begins with what the first current would have left in it",
          "[unit][estimators]") {
  const CellDynamics cell = test::sloped_cell();
  SocFilter filter;
  filter.begin(cell, {}, {.soc = 0.5, .sigma = 0.001, .is_rested = false}, 25.0);
  const double expected_V = 3.2 + 0.45;
  filter.update({.passed_s = 1e-3,
                 .mean_current_A = 10.0,
                 .current_A = 10.0,
                 .voltage_V = expected_V - 0.06,
                 .temperature_C = 25.0});
  CHECK(filter.pair_V()[0] > filter.pair_V()[1]);
  CHECK(filter.pair_V()[1] > filter.pair_V()[2]);
  CHECK(filter.pair_V()[0] > 0.002);
  SocFilter rested;
  rested.begin(cell, {}, {.soc = 0.5, .sigma = 0.001}, 25.0);
  rested.update({.passed_s = 1e-3,
                 .mean_current_A = 10.0,
                 .current_A = 10.0,
                 .voltage_V = expected_V - 0.06,
                 .temperature_C = 25.0});
  CHECK(std::abs(rested.pair_V()[0]) < 0.001);
}

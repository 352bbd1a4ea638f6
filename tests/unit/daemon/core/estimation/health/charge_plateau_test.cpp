// Capacity from the plateau of a charge. Scripted charges with countable rungs show what is measured and when nothing
// is; a cell with a plateau, of any size and resistance, shows the accuracy.
#include "daemon/core/estimation/health/charge_plateau.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "tests/support/catch.hpp"
#include "tests/support/simulated_cell.hpp"

using namespace bmu;
using test::Chance;

namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();
constexpr double step_s = 30.0;  // duration of a block

constexpr ChargePlateauModel model{.plateau_weight = 2.92,
                                   .above_weight = 1.0,
                                   .sigma_As = 100.0,
                                   .current_A = 1.5,
                                   .full_voltage_V = 4.2,
                                   .end_current_A = 0.1};

CellSample charging(double current_A, double voltage_V) {
  return {.passed_s = step_s,
          .mean_current_A = -current_A,
          .current_A = -current_A,
          .voltage_V = voltage_V,
          .temperature_C = 25.0};
}

/// Charge in steps of 30 s, 45 As each at 1.5 A; the voltage is given in rungs of 5 mV above 3.4025 V, so that every
/// rung is passed in the middle of its step.
class Script {
 public:
  /// Appends this number of steps, each of which rises by this number of rungs.
  Script& rise(int steps, double rungs, double current_A = 1.5) {
    for (int step = 0; step < steps; ++step) {
      rung_ += rungs;
      samples.push_back(charging(current_A, 3.4025 + 0.005 * rung_));
    }
    return *this;
  }
  Script& hold(double current_A, double voltage_V = 4.2) {
    samples.push_back(charging(current_A, voltage_V));
    return *this;
  }

  std::vector<CellSample> samples;

 private:
  double rung_ = 0.0;
};

std::optional<PlateauCharge> shown_by(const std::vector<CellSample>& samples, const ChargePlateauModel& by = model) {
  ChargePlateau plateau;
  plateau.begin(by);
  std::optional<PlateauCharge> shown;
  for (const CellSample& sample : samples) {
    const auto now = plateau.take(sample);
    if (now) {
      CHECK_FALSE(shown);
      shown = now;
    }
  }
  return shown;
}

/// Settles for 6 steps; the curve starts with the seventh: `before` steps of two rungs, a plateau of 20 steps of one
/// rung, two rungs a step until almost 4.2 V, and the taper.
Script usual(int before = 10) {
  Script script;
  script.rise(7, 0.0).rise(before, 2.0).rise(20, 1.0);
  const int left = (158 - 2 * before - 20) / 2;
  script.rise(left, 2.0).hold(1.0).hold(0.5).hold(0.2).hold(0.05);
  return script;
}

/// Result of the usual script with one sample changed.
template <class Change>
std::optional<PlateauCharge> shown_with(std::size_t which, Change change) {
  std::vector<CellSample> samples = usual().samples;
  change(samples.at(which));
  return shown_by(samples);
}

}  // namespace

TEST_CASE("the flattest 50 mV and what flows from the end of the plateau until full are measured",
          "[unit][estimators][BMS_F.6]") {
  const auto shown = shown_by(usual().samples);
  REQUIRE(shown);
  CHECK(shown->plateau_As == Approx(450.0));  // ten rungs of a step each
  CHECK(shown->lasted_s == Approx(100.0 * step_s));
  // In steps: the rungs of the plateau are passed at 17, 18, ... 36, those above it at 36.75, 37.25 and so on. Ten of
  // them end at 36.75 and took 9.75, the next 9.25; 95 % of ten lies in the middle. The middles of these stretches are
  // at 31.875 and 32.625.
  constexpr double end_As = 32.25 * 45.0;
  // 96 steps and those of 1, 0.5 and 0.2 A; the middles of the last two are at 0.2 and 0.05 A.
  constexpr double at_02_As = 96.0 * 45.0 + 30.0 + 15.0 + 3.0;
  constexpr double at_005_As = 96.0 * 45.0 + 30.0 + 15.0 + 6.0 + 0.75;
  constexpr double full_As = at_02_As + (0.2 - 0.1) / (0.2 - 0.05) * (at_005_As - at_02_As);
  CHECK(shown->above_As == Approx(full_As - end_As));
}

TEST_CASE("the capacity is what both weights make of it, as sure as the model and the sensor's offset allow",
          "[unit][estimators][BMS_F.6]") {
  ChargePlateauModel by = model;
  by.above_weight = 1.1;
  const CapacityPair pair = capacity_pair(by, {.plateau_As = 500.0, .above_As = 4'000.0, .lasted_s = 7'500.0},
                                          {.gain = 0.5, .offset_A = 0.01, .unknown_current_A = 1.0});
  CHECK(pair.charge_As == Approx(1.1 * 4'000.0 + 2.92 * 500.0));
  CHECK(pair.charge_sigma_As == Approx(std::hypot(100.0, 75.0)));
  CHECK(pair.soc_change == 1.0);
  CHECK(pair.soc_change_sigma == 0.0);
}

TEST_CASE("where a higher plateau comes later, that one counts", "[unit][estimators][BMS_F.6]") {
  Script script;
  script.rise(17, 1.0).rise(4, 3.0).rise(30, 0.75).rise(40, 2.5).hold(1.0).hold(0.05);
  const auto shown = shown_by(script.samples);
  REQUIRE(shown);
  CHECK(shown->plateau_As == Approx(10.0 * 45.0 / 0.75));
}

namespace {

/// Result for a plateau with its flattest 50 mV at a single position, after this number of rungs, one per step, and
/// this number of flat steps before those.
std::optional<PlateauCharge> shown_behind(int rungs, int flat_steps = 7) {
  Script script;
  script.rise(flat_steps, 0.0).rise(rungs, 1.0).rise(24, 0.45).rise(30, 1.0).rise(56, 2.0).hold(1.0).hold(0.05);
  return shown_by(script.samples);
}

}  // namespace

TEST_CASE("the plateau must have been seen to begin: two rungs below its flattest 50 mV",
          "[unit][estimators][BMS_F.6]") {
  CHECK_FALSE(shown_behind(0));
  CHECK_FALSE(shown_behind(1));
  const auto shown = shown_behind(2);
  REQUIRE(shown);
  CHECK(shown->plateau_As == Approx(10.0 * 45.0 / 0.45));
  CHECK(shown_behind(3));
}

TEST_CASE("a voltage counts after three minutes of a steady current", "[unit][estimators][BMS_F.6]") {
  // Six steps settle, whatever the voltage; the curve starts with the seventh. Of two rungs after six flat steps the
  // first is that start.
  CHECK(shown_behind(2, 7));
  CHECK_FALSE(shown_behind(2, 6));
  CHECK(shown_behind(3, 6));
  CHECK_FALSE(shown_behind(3, 5));
}

TEST_CASE("the current must be near that of the model, and steady", "[unit][estimators][BMS_F.6]") {
  const auto shown_at = [](double current_A) {
    Script script;
    script.rise(7, 0.0, current_A).rise(10, 2.0, current_A).rise(20, 1.0, current_A).rise(59, 2.0, current_A);
    return shown_by(script.hold(1.0).hold(0.05).samples).has_value();
  };
  CHECK(shown_at(1.201));
  CHECK_FALSE(shown_at(1.199));
  CHECK(shown_at(1.799));
  CHECK_FALSE(shown_at(1.801));
  const auto shown_if_once = [](double current_A) {
    return shown_with(20, [=](CellSample& sample) { sample.mean_current_A = -current_A; }).has_value();
  };
  CHECK(shown_if_once(1.426));
  CHECK_FALSE(shown_if_once(1.424));
  CHECK(shown_if_once(1.574));
  CHECK_FALSE(shown_if_once(1.576));
}

TEST_CASE("a charge with a hole in it is given up", "[unit][estimators][BMS_F.6]") {
  for (const std::size_t which : {std::size_t{20}, std::size_t{60}, std::size_t{97}}) {
    CAPTURE(which);
    CHECK_FALSE(shown_with(which, [](CellSample& sample) { sample.mean_current_A = not_measured; }));
    CHECK_FALSE(shown_with(which, [](CellSample& sample) { sample.mean_current_A = -infinite; }));
    CHECK_FALSE(shown_with(which, [](CellSample& sample) { sample.mean_current_A = 0.0; }));
    CHECK_FALSE(shown_with(which, [](CellSample& sample) { sample.mean_current_A = 1.5; }));
    CHECK_FALSE(shown_with(which, [](CellSample& sample) { sample.temperature_C = not_measured; }));
    CHECK_FALSE(shown_with(which, [](CellSample& sample) { sample.temperature_C = 14.9; }));
    CHECK(shown_with(which, [](CellSample& sample) { sample.temperature_C = 15.0; }));
    CHECK(shown_with(which, [](CellSample& sample) { sample.temperature_C = 40.0; }));
    CHECK_FALSE(shown_with(which, [](CellSample& sample) { sample.temperature_C = 40.1; }));
    CHECK_FALSE(shown_with(which, [](CellSample& sample) { sample.passed_s = 120.1; }));
    CHECK(shown_with(which, [](CellSample& sample) { sample.passed_s = 120.0; }));
  }
}

TEST_CASE("a sample without a time is none, and one without a voltage only counts", "[unit][estimators][BMS_F.6]") {
  const auto whole = shown_by(usual().samples);
  REQUIRE(whole);
  for (const double wrong : {0.0, -30.0, not_measured, infinite}) {
    CAPTURE(wrong);
    std::vector<CellSample> samples = usual().samples;
    CellSample strange = charging(9.0, 1.0);
    strange.passed_s = wrong;
    samples.insert(samples.begin() + 60, strange);
    const auto shown = shown_by(samples);
    REQUIRE(shown);
    CHECK(shown->above_As == whole->above_As);
    CHECK(shown->plateau_As == whole->plateau_As);
  }
  // Far above the plateau, so that nothing else depends on it: its charge goes into the next block.
  for (const double wrong : {not_measured, infinite}) {
    const auto shown = shown_with(70, [=](CellSample& sample) { sample.voltage_V = wrong; });
    REQUIRE(shown);
    CHECK(shown->above_As == Approx(whole->above_As));
    CHECK(shown->lasted_s == whole->lasted_s);
  }
}

TEST_CASE("samples are looked at in blocks of half a minute", "[unit][estimators][BMS_F.6]") {
  const auto whole = shown_by(usual().samples);
  REQUIRE(whole);
  std::vector<CellSample> seconds;
  for (const CellSample& sample : usual().samples) {
    for (int second = 0; second < 30; ++second) {
      CellSample one = sample;
      one.passed_s = 1.0;
      one.voltage_V += second % 2 == 0 ? 0.02 : -0.02;
      if (second == 7 || second == 8) one.voltage_V = not_measured;
      seconds.push_back(one);
    }
  }
  const auto shown = shown_by(seconds);
  REQUIRE(shown);
  CHECK(shown->plateau_As == Approx(whole->plateau_As));
  CHECK(shown->above_As == Approx(whole->above_As));
  CHECK(shown->lasted_s == Approx(whole->lasted_s));
}

TEST_CASE("a voltage that steps by more than a curve does is no curve", "[unit][estimators][BMS_F.6]") {
  const auto shown_with_step = [](double rungs) {
    Script script;
    script.rise(7, 0.0).rise(10, 2.0).rise(20, 1.0).rise(1, rungs);
    return shown_by(script.rise(static_cast<int>((118.0 - rungs) / 2.0), 2.0).hold(1.0).hold(0.05).samples);
  };
  CHECK(shown_with_step(39.8));
  CHECK_FALSE(shown_with_step(40.2));
}

TEST_CASE("a charge that is throttled below the charge voltage is given up", "[unit][estimators][BMS_F.6]") {
  const auto shown_if_held_at = [](double voltage_V) {
    Script script;
    script.rise(7, 0.0).rise(10, 2.0).rise(20, 1.0).rise(52, 2.0);  // up to 4.1225 V
    return shown_by(script.hold(1.0, voltage_V).hold(0.5, voltage_V).hold(0.05, voltage_V).samples);
  };
  CHECK(shown_if_held_at(4.151));
  CHECK_FALSE(shown_if_held_at(4.149));
  CHECK_FALSE(shown_if_held_at(not_measured));
  // The same during the taper.
  CHECK(shown_with(98, [](CellSample& sample) { sample.voltage_V = 4.151; }));
  CHECK_FALSE(shown_with(98, [](CellSample& sample) { sample.voltage_V = 4.149; }));
  // More current at the charge voltage is not a taper.
  CHECK_FALSE(shown_with(96, [](CellSample& sample) { sample.mean_current_A = -1.7; }));
}

TEST_CASE("a charge that ends too early says nothing", "[unit][estimators][BMS_F.6]") {
  std::vector<CellSample> samples = usual().samples;
  samples.back().mean_current_A = -0.1;
  CHECK_FALSE(shown_by(samples));
  samples.back().mean_current_A = -0.0999;
  CHECK(shown_by(samples));
  samples.pop_back();
  CHECK_FALSE(shown_by(samples));
  // Constant voltage before the end of the plateau was detected.
  CHECK_FALSE(shown_by(Script().rise(7, 0.0).rise(60, 2.0).rise(30, 1.0).hold(1.0).hold(0.05).samples));
}

TEST_CASE("after one charge comes another, whatever became of the first", "[unit][estimators][BMS_F.6]") {
  ChargePlateau plateau;
  plateau.begin(model);
  const auto count = [&plateau](const std::vector<CellSample>& samples) {
    return std::count_if(samples.begin(), samples.end(),
                         [&](const CellSample& sample) { return plateau.take(sample).has_value(); });
  };
  std::vector<CellSample> broken = usual().samples;
  broken.resize(50);
  CHECK(count(usual().samples) == 1);
  CHECK(count({charging(0.05, 4.2), charging(0.04, 4.2)}) == 0);  // the end of that charge
  CHECK(count(broken) == 0);
  CHECK(count({charging(-3.0, 3.9)}) == 0);
  CHECK(count(usual().samples) == 1);
}

TEST_CASE("without a model nothing is said", "[unit][estimators][BMS_F.6]") {
  ChargePlateau plateau;
  for (const CellSample& sample : usual().samples) CHECK_FALSE(plateau.take(sample));
}

// --- a cell ---------------------------------------------------------------------------------------------------------

namespace {

struct PlateauCell {
  double capacity_As = 7'200.0;
  double resistance_Ohm = 0.1;
  double soc = 0.05;
  double noise_V = 0.0;
  double late_Ohm = 0.0;  // of an RC element with 60 s

  [[nodiscard]] double ocv_V() const {
    if (soc < 0.15) return 3.7 - (0.15 - soc) * 3.3;
    if (soc < 0.40) return 3.7 + (soc - 0.15) * 0.4;
    return 3.8 + (soc - 0.40) * 0.4 / 0.6;
  }
};

/// Result of a charge with 1.5 A up to 4.2 V and held there, one sample per second.
std::optional<PlateauCharge> charged(PlateauCell cell) {
  constexpr std::uint64_t seed = 21;
  Chance chance(seed);
  ChargePlateau plateau;
  plateau.begin(model);
  double late_V = 0.0;
  for (int second = 0; second < 40'000; ++second) {
    const double held_A = (4.2 - cell.ocv_V() - late_V) / cell.resistance_Ohm;
    const double current_A = std::min(1.5, held_A);
    if (current_A < 0.05) break;
    cell.soc += current_A / cell.capacity_As;
    late_V += (cell.late_Ohm * current_A - late_V) / 60.0;
    const double voltage_V = cell.ocv_V() + late_V + current_A * cell.resistance_Ohm + cell.noise_V * chance.normal();
    const auto shown = plateau.take({.passed_s = 1.0,
                                     .mean_current_A = -current_A,
                                     .current_A = -current_A,
                                     .voltage_V = voltage_V,
                                     .temperature_C = 25.0});
    if (shown) return shown;
  }
  return std::nullopt;
}

double capacity_by(const PlateauCell& cell) {
  const auto shown = charged(cell);
  REQUIRE(shown);
  return capacity_pair(model, *shown, {.offset_A = 0.0}).charge_As;
}

}  // namespace

TEST_CASE("a cell's capacity is found whatever its size, its resistance and its noise", "[unit][estimators][BMS_F.6]") {
  // Weights for this curve: 12.5 % in the flattest 50 mV, its end at 35 %, 1.5 % missing when full.
  CHECK(capacity_by({}) == Approx(7'200.0).epsilon(0.01));
  for (const double size : {1.0, 0.85, 0.7}) {
    for (const double resistance : {1.0, 1.4}) {
      for (const double noise_V : {0.0, 0.001}) {
        CAPTURE(size, resistance, noise_V);
        const PlateauCell cell{.capacity_As = size * 7'200.0,
                               .resistance_Ohm = 0.08 * resistance,
                               .noise_V = noise_V,
                               .late_Ohm = 0.03 * resistance};
        const double found_As = capacity_by(cell);
        CHECK(std::abs(found_As - cell.capacity_As) < 0.02 * cell.capacity_As);
        CHECK(std::abs(found_As - cell.capacity_As) < 2.0 * model.sigma_As);
      }
    }
  }
}

TEST_CASE("plugged in on the plateau a cell says what is right, or nothing", "[unit][estimators][BMS_F.6]") {
  for (double soc = 0.0; soc < 0.99; soc += 0.01) {
    CAPTURE(soc);
    const auto shown = charged({.soc = soc, .late_Ohm = 0.03});
    if (soc < 0.08) CHECK(shown);
    if (soc > 0.30) CHECK_FALSE(shown);  // less than 50 mV of the plateau remain
    if (!shown) continue;
    CHECK(capacity_pair(model, *shown, {.offset_A = 0.0}).charge_As == Approx(7'200.0).epsilon(0.02));
  }
}

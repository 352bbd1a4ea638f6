// Pulses of the current, and voltages that answer them as a cell's do, the other way, or not at all.
#include "tools/bmucell/current_steps.hpp"

#include <array>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "tests/support/catch.hpp"
#include "tools/bmucell/plausible_recording.hpp"
#include "tools/bmucell/steady_current.hpp"

using namespace bmu;
using namespace bmu::cell;

namespace {

constexpr double capacity_Ah = 10.0;

/// How a logger shows a cell.
struct Logger {
  double row_s = 1.0;
  double noise_V = 0.0;
  double resolution_V = 0.0;
  unsigned seed = 1;
};

/// These currents in turns of 30 s, for an hour, of a cell of 10 Ah from 90 %: a slope of 0.9 V, 15 mOhm at once, and
/// 5 mOhm each that settle with 20 s and with 300 s.
Series pulses(const std::vector<double>& turns_A, const Logger& logger = {}) {
  Series series{.name = "pulses", .has_temperature = true};
  std::mt19937 numbers(logger.seed);
  std::normal_distribution<double> noise_V(0.0, 1.0);
  constexpr std::array settles_s{20.0, 300.0};
  std::array<double, settles_s.size()> settled_V{};
  double soc = 0.9;
  for (double time_s = 0.0; time_s < 3'600.0; time_s += logger.row_s) {
    const double current_A = turns_A.at(static_cast<std::size_t>(time_s / 30.0) % turns_A.size());
    soc -= current_A * logger.row_s / (capacity_Ah * 3'600.0);
    double voltage_V = 3.2 + 0.9 * soc - 0.015 * current_A;
    for (std::size_t k = 0; k < settles_s.size(); ++k) {
      settled_V[k] += (0.005 * current_A - settled_V[k]) * (1.0 - std::exp(-logger.row_s / settles_s[k]));
      voltage_V -= settled_V[k];
    }
    voltage_V += logger.noise_V * noise_V(numbers);
    if (logger.resolution_V > 0.0) voltage_V = logger.resolution_V * std::round(voltage_V / logger.resolution_V);
    const std::size_t row = series.rows.size();
    series.rows.push_back({time_s, current_A, voltage_V, 25.0});
    series.rows.back().line = row + 2;
  }
  return series;
}

Series without_sign(Series series) {
  for (SeriesRow& row : series.rows) row.current_A = std::abs(row.current_A);
  return series;
}

bool is_plausible(const Series& series) {
  return implausible_current_steps(series, capacity_Ah).empty();
}

/// 2 A in each second of twelve turns of `turn_rows` rows, one a second, none in the others; the voltage moves by this
/// at each of its steps, and then by that much in a second.
Series answering(double step_V, double drift_V_per_s, std::size_t turn_rows = 10) {
  Series series{.name = "answering", .has_temperature = true};
  double voltage_V = 3.6;
  for (std::size_t row = 0; row < 12 * turn_rows; ++row) {
    const bool is_on = row / turn_rows % 2 == 1;
    const bool is_step = row > 0 && row % turn_rows == 0;
    voltage_V += (is_step ? (is_on ? step_V : -step_V) : 0.0) + drift_V_per_s;
    series.rows.push_back({static_cast<double>(row), is_on ? 2.0 : 0.0, voltage_V, 25.0});
    series.rows.back().line = row + 2;
  }
  return series;
}

}  // namespace

TEST_CASE("small charge pulses of a current without sign are found by the voltage's answer, and by nothing else",
          "[unit][bmucell]") {
  for (const double pulse_A : {0.5, 1.0, 1.9}) {
    CAPTURE(pulse_A);
    const Series right = pulses({5.0, 5.0, 0.0, -pulse_A});
    CHECK(implausible_answers(right, capacity_Ah) == "");
    const Series wrong = without_sign(right);
    CHECK(implausible_current(wrong, capacity_Ah) == "");
    CHECK(implausible_steady_current(wrong, capacity_Ah) == "");
    CHECK(implausible_charge(wrong, capacity_Ah, 0.9) == "");
    CHECK(implausible_current_steps(wrong, capacity_Ah) == implausible_answers(wrong, capacity_Ah));
    CHECK_FALSE(is_plausible(wrong));
  }
  CHECK(implausible_current_steps(without_sign(pulses({5.0, 5.0, 0.0, -1.9})), capacity_Ah) ==
        ":92: current_A: at 30 of 89 steps the voltage goes the wrong way: first it rises by 30 mV as the current goes "
        "from 0 to 1.9 A, expected it to fall; the current without its sign?");
}

TEST_CASE("charges without their sign among others that have it are found", "[unit][bmucell]") {
  Series series = pulses({5.0, 0.0, -1.0, 0.0, 2.0, 0.0, -3.0, 0.0});
  CHECK(is_plausible(series));
  for (SeriesRow& row : series.rows) {
    if (row.current_A == -1.0) row.current_A = 1.0;
  }
  const std::string problem = implausible_current_steps(series, capacity_Ah);
  INFO(problem);
  CHECK(problem.find("; the current with the other sign there?") != std::string::npos);
}

TEST_CASE("with noise, a coarse resolution and few rows no right recording is refused", "[unit][bmucell]") {
  for (const double row_s : {0.5, 1.0, 5.0, 10.0, 15.0, 30.0}) {
    for (const double noise_V : {0.0, 0.001, 0.005, 0.020}) {
      for (const double resolution_V : {0.0, 0.001, 0.010}) {
        for (const double pulse_A : {0.5, 1.0, 2.0}) {
          CAPTURE(row_s, noise_V, resolution_V, pulse_A);
          for (const unsigned seed : {1U, 2U, 3U}) {
            const Logger logger{row_s, noise_V, resolution_V, seed};
            CHECK(is_plausible(pulses({5.0, 5.0, 0.0, -pulse_A}, logger)));
            CHECK(is_plausible(pulses({10.0, 0.0, pulse_A, 0.0, pulse_A, 10.0}, logger)));
            CHECK(is_plausible(pulses({pulse_A, 0.0}, logger)));
            CHECK(is_plausible(pulses({-pulse_A, 0.0, -5.0, 0.0}, logger)));
            CHECK(is_plausible(pulses({3.0}, logger)));
          }
        }
      }
    }
  }
}

TEST_CASE("with noise and a coarse resolution charges without sign are found while they are larger",
          "[unit][bmucell]") {
  for (const unsigned seed : {1U, 2U, 3U}) {
    CHECK_FALSE(is_plausible(without_sign(pulses({5.0, 5.0, 0.0, -1.0}, {.noise_V = 0.001, .seed = seed}))));
    CHECK_FALSE(is_plausible(without_sign(pulses({5.0, 5.0, 0.0, -2.0}, {.noise_V = 0.005, .seed = seed}))));
    CHECK_FALSE(is_plausible(without_sign(pulses({5.0, 5.0, 0.0, -2.0}, {.resolution_V = 0.010, .seed = seed}))));
    CHECK_FALSE(is_plausible(without_sign(pulses({5.0, 5.0, 0.0, -1.0}, {.row_s = 5.0, .seed = seed}))));
  }
}

TEST_CASE("a voltage that moves by itself is no answer to a step", "[unit][bmucell]") {
  // As it comes back after a load, while a smaller one begins: 0.2 C after 3 C.
  CHECK(is_plausible(pulses({30.0, 0.0, 2.0})));
  CHECK(is_plausible(pulses({30.0, 2.0, 1.0})));
  CHECK(is_plausible(answering(0.0, 0.010)));
  CHECK(is_plausible(answering(0.0, -0.010)));
  CHECK_FALSE(is_plausible(answering(0.005, 0.0)));
  CHECK(is_plausible(answering(-0.005, 0.0)));
}

TEST_CASE("an answer counts from 1 mV, from the noise and from the resolution on", "[unit][bmucell]") {
  CHECK_FALSE(is_plausible(answering(0.001'01, 0.0)));
  CHECK(is_plausible(answering(0.000'99, 0.0)));
  const auto noisy = [](double step_V, double by_V) {
    Series series = answering(step_V, 0.0, 20);
    for (std::size_t row = 0; row < series.rows.size(); ++row) series.rows[row].voltage_V += row % 2 == 0 ? by_V : 0.0;
    return series;
  };
  // 1 mV from row to row: 8.7 mV by the root of five rows.
  CHECK(is_plausible(noisy(0.003'5, 0.001)));
  CHECK_FALSE(is_plausible(noisy(0.004'5, 0.001)));
  // Where rows are mostly the same, one step of the resolution may be one of rounding.
  const auto coarse = [](double step_V) {
    Series series = answering(step_V, 0.0, 100);
    for (std::size_t row = 0; row < series.rows.size(); ++row)
      series.rows[row].voltage_V += row / 40 % 5 == 1 ? 0.010 : 0.0;
    return series;
  };
  CHECK(is_plausible(coarse(0.014)));
  CHECK_FALSE(is_plausible(coarse(0.016)));
}

TEST_CASE("steps are judged from their size on, between levels of some rows, and not over gaps", "[unit][bmucell]") {
  const auto changed = [](auto change, std::size_t turn_rows = 10) {
    Series series = answering(0.010, 0.0, turn_rows);
    change(series.rows);
    return is_plausible(series);
  };
  const auto scaled = [&changed](double factor, double offset_A) {
    return changed([=](auto& rows) {
      for (SeriesRow& row : rows) row.current_A = row.current_A * factor + offset_A;
    });
  };
  CHECK_FALSE(scaled(0.151, 0.0));
  CHECK(scaled(0.149, 0.0));
  CHECK_FALSE(scaled(1.0, 7.9));
  CHECK(scaled(1.0, 8.1));
  const auto nothing = [](auto&) {};
  CHECK_FALSE(changed(nothing, 2));
  CHECK(changed(nothing, 1));
  CHECK(changed([](auto& rows) {
    for (SeriesRow& row : rows) row.time_s += 60.0 * std::floor(row.time_s / 10.0);
  }));
  CHECK(changed([](auto& rows) {
    for (SeriesRow& row : rows) row.voltage_V = std::nan("");
  }));
  CHECK(changed([](auto& rows) { rows.clear(); }));
}

TEST_CASE("two steps the wrong way, and one in twenty, are needed to refuse", "[unit][bmucell]") {
  // Of 80 rows, whose current steps each tenth, the last so many steps are the wrong way.
  const auto refused = [](std::size_t steps, std::size_t wrong) {
    Series series{.name = "steps", .has_temperature = true};
    double voltage_V = 3.6;
    for (std::size_t row = 0; row < 10 * (steps + 1); ++row) {
      const bool is_on = row / 10 % 2 == 1;
      const bool is_step = row > 0 && row % 10 == 0;
      const double way = row / 10 > steps - wrong ? 1.0 : -1.0;
      if (is_step) voltage_V += way * (is_on ? 0.010 : -0.010);
      series.rows.push_back({static_cast<double>(row), is_on ? 2.0 : 0.0, voltage_V, 25.0});
    }
    return !is_plausible(series);
  };
  CHECK_FALSE(refused(4, 1));
  CHECK(refused(4, 2));
  CHECK(refused(40, 2));
  CHECK_FALSE(refused(41, 2));
}

// Each bound of what a test of a cell can be, from both sides.
#include "tools/bmucell/plausible_recording.hpp"

#include <array>
#include <cmath>
#include <random>
#include <string>

#include "tests/support/catch.hpp"

using namespace bmu;
using namespace bmu::cell;

namespace {

constexpr double capacity_Ah = 10.0;

/// A sloped cell of 10 Ah with 5 mOhm from 90 %, with 5 A and 1 A in turns of a minute, a row every 10 s, for an hour:
/// 3 Ah.
Series drive() {
  Series series{.name = "drive", .has_temperature = true, .has_soc = true};
  double soc = 0.9;
  for (int row = 0; row < 360; ++row) {
    const double current_A = row / 6 % 2 == 0 ? 5.0 : 1.0;
    if (row > 0) soc -= current_A * 10.0 / 36'000.0;
    series.rows.push_back({10.0 * row, current_A, 3.2 + 0.9 * soc - 0.005 * current_A, 25.0, soc});
    series.rows.back().line = static_cast<std::size_t>(row) + 2;
  }
  return series;
}

template <class Change>
Series changed(Change change) {
  Series series = drive();
  for (SeriesRow& row : series.rows) change(row);
  return series;
}

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

CellModel permitting(int min_dC, int max_dC) {
  CellModel cell;
  cell.temperature_min_dC = static_cast<decltype(cell.temperature_min_dC)>(min_dC);
  cell.temperature_max_dC = static_cast<decltype(cell.temperature_max_dC)>(max_dC);
  return cell;
}

}  // namespace

TEST_CASE("an ordinary drive is plausible", "[unit][bmucell]") {
  CHECK(implausible_time(drive()).empty());
  CHECK(implausible_values(drive()).empty());
  CHECK(implausible_values(drive(), permitting(-200, 600)).empty());
  CHECK(implausible_current(drive(), capacity_Ah).empty());
  CHECK(implausible_charge(drive(), capacity_Ah, 1.0).empty());
  CHECK(charge_out(drive(), capacity_Ah).back() == Approx(0.9 - drive().rows.back().soc));
}

TEST_CASE("time may stand still or be rounded, but not go back", "[unit][bmucell]") {
  Series series = drive();
  series.rows[100].time_s = series.rows[99].time_s;
  CHECK(implausible_time(series).empty());
  series.rows[100].time_s = series.rows[99].time_s - 1.0;
  CHECK(implausible_time(series).empty());
  series.rows[100].time_s = series.rows[99].time_s - 1.1;
  CHECK(has(implausible_time(series), ":102: time_s: found 988.9 after 990, expected a time that goes forward"));
  CHECK(has(implausible_time(changed([](SeriesRow& row) { row.time_s = 5.0; })), ": time_s: found 5 in every row"));
}

TEST_CASE("in cycles time begins again with each, and goes forward within it", "[unit][bmucell]") {
  Series series = changed([](SeriesRow& row) {
    row.cycle = row.line < 100 ? 1.0 : 2.0;
    if (row.line >= 100) row.time_s -= 980.0;
  });
  CHECK_FALSE(implausible_time_in_cycles(series).empty());
  series.has_cycle = true;
  CHECK(implausible_time_in_cycles(series).empty());
  CHECK_FALSE(implausible_time(series).empty());
  series.rows.back().time_s = 0.0;
  CHECK_FALSE(implausible_time_in_cycles(series).empty());
}

TEST_CASE("voltages are of one cell in volts", "[unit][bmucell]") {
  Series series = drive();
  series.rows[5].voltage_V = std::nan("");
  CHECK(implausible_values(series).empty());
  for (const double edge_V : {0.5, 6.0}) {
    series.rows[5].voltage_V = edge_V;
    CHECK(implausible_values(series).empty());
  }
  series.rows[5].voltage_V = 6.01;
  CHECK(has(implausible_values(series), "expected volts of one cell, 0.5 to 6; of more than one cell?"));
  series.rows[5].voltage_V = 0.0;
  CHECK(has(implausible_values(series), "; a field that was not measured has to be empty, not 0"));
  CHECK(has(implausible_values(changed([](SeriesRow& row) { row.voltage_V *= 1e3; })), "; in mV?"));
  CHECK(has(implausible_values(changed([](SeriesRow& row) { row.voltage_V = std::nan(""); })), "found nothing"));
}

TEST_CASE("temperatures are in degrees Celsius that the cell may have", "[unit][bmucell]") {
  const auto problem_at = [](double temperature_C) {
    return implausible_values(changed([=](SeriesRow& row) { row.temperature_C = temperature_C; }),
                              permitting(-200, 600));
  };
  CHECK(problem_at(-25.0).empty());
  CHECK(problem_at(65.0).empty());
  CHECK(problem_at(std::nan("")).empty());
  CHECK(has(problem_at(65.1), "found mostly 65.1, expected degrees Celsius within -25 to 65"));
  CHECK(has(problem_at(-25.1), "found mostly -25.1"));
  CHECK(has(problem_at(77.0), "; in degrees Fahrenheit?"));
  CHECK(has(problem_at(253.15), "; in K?"));
  CHECK(has(problem_at(298.15), "; in K?"));
  CHECK(has(problem_at(250.0), "; in "));
  CHECK(has(implausible_values(changed([](SeriesRow& row) { row.temperature_C = 298.15; })), "; in K?"));
  // A sensor that failed once is no other unit.
  Series series = drive();
  series.rows[7].temperature_C = 3'000.0;
  CHECK(implausible_values(series, permitting(-200, 600)).empty());
}

TEST_CASE("currents have a size that such a cell can carry, and are there", "[unit][bmucell]") {
  CHECK(has(implausible_current(changed([](SeriesRow& row) { row.current_A *= 1e3; }), capacity_Ah), "; in mA?"));
  CHECK(has(implausible_current(changed([](SeriesRow& row) { row.current_A = 0.0; }), capacity_Ah), "found 0 to 0"));
  CHECK(has(implausible_current(changed([](SeriesRow& row) { row.current_A = std::nan(""); }), capacity_Ah),
            "found nothing, expected currents in A"));
}

TEST_CASE("the voltage answers steps and charge as a cell's does", "[unit][bmucell]") {
  const auto reversed = [](SeriesRow& row) { row.current_A = -row.current_A; };
  CHECK(
      has(implausible_current(changed(reversed), capacity_Ah), "expected a current that is positive out of the cell"));
  // Without a step: by the charge alone.
  const auto steady = [](SeriesRow& row) {
    row.current_A = 3.0;
    row.voltage_V = 3.2 + 0.9 * (0.9 - row.time_s * 3.0 / 36'000.0);
  };
  CHECK(implausible_current(changed(steady), capacity_Ah).empty());
  const auto steady_reversed = [=](SeriesRow& row) {
    steady(row);
    row.current_A = -3.0;
  };
  CHECK(has(implausible_current(changed(steady_reversed), capacity_Ah), "positive out of the cell"));
  // A tenth of the capacity is needed for that.
  CHECK(implausible_current(changed(steady_reversed), 10.0 * capacity_Ah).empty());
}

TEST_CASE("a current without its sign is found by its steps, or by the reference", "[unit][bmucell]") {
  // 5 A out, and 2.5 A in at each fourth row after a rest.
  Series series = drive();
  double soc = 0.9;
  for (std::size_t row = 0; row < series.rows.size(); ++row) {
    constexpr std::array steps_A{5.0, 5.0, 0.0, -2.5};
    const double current_A = steps_A.at(row % 4);
    soc -= current_A * 10.0 / 36'000.0;
    series.rows[row] = {10.0 * static_cast<double>(row), current_A, 3.2 + 0.9 * soc - 0.005 * current_A, 25.0, soc};
  }
  CHECK(implausible_current(series, capacity_Ah).empty());
  for (SeriesRow& row : series.rows) row.current_A = std::abs(row.current_A);
  CHECK(has(implausible_current(series, capacity_Ah),
            "upwards and rises at so many downwards, expected nearly all; the "
            "current without its sign?"));
  // Where the current does not step: discharged by 8 %, charged by 1 %.
  Series steady = drive();
  for (std::size_t row = 0; row < steady.rows.size(); ++row) {
    SeriesRow& one = steady.rows[row];
    one.current_A = 1.0;
    one.soc = row < 320 ? 0.9 - static_cast<double>(row) / 3'600.0 : 0.9 - (640.0 - static_cast<double>(row)) / 3'600.0;
    one.voltage_V = 3.2 + 0.9 * one.soc;
  }
  CHECK(
      has(implausible_current(steady, capacity_Ah), "but ref_soc_pct moves both ways; the current without its sign?"));
}

TEST_CASE("steps whose answer is lost in noise show no sign", "[unit][bmucell]") {
  for (const unsigned seed : {1U, 2U, 3U, 4U, 5U}) {
    CAPTURE(seed);
    std::mt19937 numbers(seed);
    std::normal_distribution<double> noise_V(0.0, 0.015);
    const auto noisy = [&](SeriesRow& row) { row.voltage_V += noise_V(numbers); };
    // 20 mV, of two rows that differ by 21 mV, one standard deviation.
    CHECK(implausible_current(changed(noisy), capacity_Ah) == "");
    const auto reversed_with_more = [&](SeriesRow& row) {
      noisy(row);
      row.voltage_V += 0.025 * row.current_A;
    };
    CHECK(has(implausible_current(changed(reversed_with_more), capacity_Ah), "the voltage mostly rises with it"));
  }
  // Noise is what differs under the same current, but for 0.01 C.
  Series series{.rows = {{0.0, 1.0, 3.6}, {1.0, 1.09, 3.602}, {2.0, 1.2, 3.9}, {3.0, 1.2, 3.9}, {4.0, 1.2, 3.904}}};
  CHECK(voltage_noise(series.rows, capacity_Ah).usual_V == Approx(0.002));
  CHECK(voltage_noise(series.rows, capacity_Ah).least_V == Approx(0.002));
  series.rows.front().voltage_V = std::nan("");
  CHECK(voltage_noise(series.rows, capacity_Ah).least_V == Approx(0.004));
  series.rows.resize(1);
  CHECK(voltage_noise(series.rows, capacity_Ah).usual_V == 0.0);
}

TEST_CASE("current and reference have to agree, with the likely cause of what they differ by", "[unit][bmucell]") {
  const auto problem_with = [](double current_factor, double soc_factor) {
    return implausible_charge(changed([=](SeriesRow& row) {
                                row.current_A *= current_factor;
                                row.soc *= soc_factor;
                              }),
                              capacity_Ah, 1.0);
  };
  CHECK(problem_with(1.25, 1.0).empty());
  CHECK(has(problem_with(1.5, 1.0), "; another capacity?"));
  CHECK(has(problem_with(1e3, 1.0), "; current in mA, or time in ms?"));
  CHECK(has(problem_with(1.0 / 60.0, 1.0), "; time in minutes?"));
  CHECK(has(problem_with(1.0 / 3'600.0, 1.0), "; time in hours?"));
  CHECK(has(problem_with(-1.0, 1.0), "; a current that is positive into the cell, or the depth of discharge"));
  CHECK(has(problem_with(1.0, 0.01), "; a fraction in place of percent?"));
  const auto still = changed([](SeriesRow& row) { row.soc = 0.5; });
  CHECK(has(implausible_charge(still, capacity_Ah, 1.0), "ref_soc_pct: moves by 0 % while the current moves 30 %"));
  const auto beyond = changed([](SeriesRow& row) { row.soc += 0.3; });
  CHECK(has(implausible_charge(beyond, capacity_Ah, 1.0), "ref_soc_pct: found 90 % to 120 %, expected 0 to 100"));
  const auto absent = changed([](SeriesRow& row) { row.soc = std::nan(""); });
  CHECK(has(implausible_charge(absent, capacity_Ah, 1.0), "ref_soc_pct: found nothing"));
}

TEST_CASE("over a gap the reference is followed, as what flowed there is not recorded", "[unit][bmucell]") {
  Series series = drive();
  for (std::size_t row = 180; row < 360; ++row) {
    series.rows[row].time_s += 7'200.0;
    series.rows[row].soc -= 0.4;
  }
  CHECK(implausible_charge(series, capacity_Ah, 1.0).empty());
}

TEST_CASE("without a reference the counted charge stays within 0 to 100 %", "[unit][bmucell]") {
  const auto problem_from = [](double begin_soc, double current_factor) {
    Series series = changed([=](SeriesRow& row) { row.current_A *= current_factor; });
    series.has_soc = false;
    return implausible_charge(series, capacity_Ah, begin_soc);
  };
  CHECK(problem_from(0.9, 1.0).empty());
  CHECK(problem_from(0.16, 1.0).empty());
  CHECK(has(problem_from(0.14, 1.0),
            "current_A: counted from 14 % it makes a charge of -16 % to 14 %, expected 0 to "
            "100 %; the current without its sign, another capacity"));
  CHECK(has(problem_from(1.0, -1.0), "; a current that is positive into the cell, or a lower charge at its begin"));
  CHECK(has(problem_from(1.0, 1e3), "; current in mA, or time in ms?"));
}

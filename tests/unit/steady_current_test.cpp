// Currents that flow steadily, and voltages that go with them, against them, or by themselves.
#include "tools/bmucell/steady_current.hpp"

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "tests/support/catch.hpp"
#include "tools/bmucell/plausible_recording.hpp"

using namespace bmu;
using namespace bmu::cell;

namespace {

constexpr double capacity_Ah = 10.0;
constexpr double row_s = 10.0;

struct Part {
  double minutes = 0.0;
  double current_A = 0.0;
};

/// A cell of 10 Ah from 90 %: a slope of 0.9 V, 5 mOhm at once, and as much that settles with `settles_s`.
Series record(const std::vector<Part>& parts, double settles_s = 600.0) {
  Series series{.name = "record", .has_temperature = true};
  double soc = 0.9;
  double settled_V = 0.0;
  for (const Part& part : parts) {
    for (double passed_s = 0.0; passed_s < part.minutes * 60.0; passed_s += row_s) {
      soc -= part.current_A * row_s / (capacity_Ah * 3'600.0);
      settled_V += (0.005 * part.current_A - settled_V) * (1.0 - std::exp(-row_s / settles_s));
      const double voltage_V = 3.2 + 0.9 * soc - 0.005 * part.current_A - settled_V;
      const std::size_t row = series.rows.size();
      series.rows.push_back({row_s * static_cast<double>(row), part.current_A, voltage_V, 25.0});
      series.rows.back().line = row + 2;
    }
  }
  return series;
}

Series without_sign(Series series) {
  for (SeriesRow& row : series.rows) row.current_A = std::abs(row.current_A);
  return series;
}

/// 2 A out of the cell for 1500 s, in which the voltage rises by 540 s times this.
Series steady(double slope_V_per_s, double lasts_s = 1'500.0) {
  Series series{.name = "steady", .has_temperature = true};
  for (double time_s = 0.0; time_s <= lasts_s; time_s += row_s) {
    series.rows.push_back({time_s, 2.0, 3.6 + slope_V_per_s * time_s, 25.0});
  }
  return series;
}
constexpr double just_enough_V_per_s = 0.010'001 / 540.0;

double rise_V(const Series& series, std::size_t from, std::size_t to) {
  return series.rows.at(to).voltage_V - series.rows.at(from).voltage_V;
}

bool has(const std::string& text, const std::string& part) {
  INFO(text);
  CHECK(text.find(part) != std::string::npos);
  return text.find(part) != std::string::npos;
}

}  // namespace

TEST_CASE("a charge among discharges without a sign is found by its rising voltage, and by nothing else",
          "[unit][bmucell]") {
  // A quarter of the time into the cell, and too few steps to judge by.
  for (const std::vector<Part>& parts :
       {std::vector<Part>{{90, 2.0}, {30, -2.0}}, {{90, 2.0}, {10, 0.0}, {30, -1.0}, {10, 0.0}, {60, 2.0}}}) {
    const Series right = record(parts);
    CHECK(implausible_steady_current(right, capacity_Ah) == "");
    const Series wrong = without_sign(right);
    CHECK(implausible_current(wrong, capacity_Ah) == "");
    CHECK(implausible_charge(wrong, capacity_Ah, 1.0) == "");
    const std::string problem = implausible_steady_current(wrong, capacity_Ah);
    CHECK(has(problem, " the voltage rises by "));
    CHECK(has(problem, ", expected it to fall; the current without its sign?"));
  }
}

TEST_CASE("a current of the other sign moves the voltage the other way, also where both signs are there",
          "[unit][bmucell]") {
  Series series = record({{60, 2.0}, {60, -2.0}});
  CHECK(implausible_steady_current(series, capacity_Ah) == "");
  for (SeriesRow& row : series.rows) row.current_A = -row.current_A;
  CHECK(has(implausible_steady_current(series, capacity_Ah),
            ":2: current_A: from 900 to 1500 s the voltage falls by 28 mV at a steady -2 A, expected it to rise; the "
            "current with the other sign there?"));
}

TEST_CASE("a voltage that comes back after a load is no charge, at rest nor under a smaller load", "[unit][bmucell]") {
  const Series rest = record({{20, 20.0}, {180, 0.0}});
  CHECK(rise_V(rest, 121, 700) > 0.05);
  CHECK(implausible_steady_current(rest, capacity_Ah) == "");
  for (const double settles_s : {60.0, 350.0, 600.0}) {
    for (const double after_A : {0.2, 0.5, 1.0}) {
      CAPTURE(settles_s, after_A);
      const Series less = record({{12, 30.0}, {60, after_A}}, settles_s);
      CHECK(rise_V(less, 73, 110) > 0.02);
      CHECK(implausible_steady_current(less, capacity_Ah) == "");
      const Series both = record({{6, 30.0}, {2, 0.0}, {60, after_A}}, settles_s);
      CHECK(implausible_steady_current(both, capacity_Ah) == "");
    }
  }
  // As much after a charge, downwards.
  CHECK(implausible_steady_current(record({{60, 8.0}, {12, -30.0}, {60, -0.5}}), capacity_Ah) == "");
}

TEST_CASE("a steady current is judged from 10 mV in 10 min on, over 25 min", "[unit][bmucell]") {
  CHECK(implausible_steady_current(steady(just_enough_V_per_s), capacity_Ah) ==
        ": current_A: from 900 to 1500 s the voltage rises by 10 mV at a steady 2 A, expected it to fall; the current "
        "without its sign?");
  CHECK(implausible_steady_current(steady(0.009'999 / 540.0), capacity_Ah) == "");
  CHECK(implausible_steady_current(steady(just_enough_V_per_s, 1'490.0), capacity_Ah) == "");
  // Half as fast takes twice as long.
  CHECK(implausible_steady_current(steady(just_enough_V_per_s / 2.0, 2'690.0), capacity_Ah) == "");
  CHECK(implausible_steady_current(steady(just_enough_V_per_s / 2.0, 2'700.0), capacity_Ah) != "");
}

TEST_CASE("noise of a slow recording with few rows is no move of the voltage", "[unit][bmucell]") {
  // 20 hours at 0.03 C, a row a minute: 10 mV are two and a half standard deviations of what two means differ by.
  const auto slow = [](double slope_V_per_s, unsigned seed) {
    Series series{.name = "slow", .has_temperature = true};
    std::mt19937 numbers(seed);
    std::normal_distribution<double> noise_V(0.0, 0.005);
    for (double time_s = 0.0; time_s <= 72'000.0; time_s += 60.0) {
      series.rows.push_back({time_s, 0.3, 3.3 + slope_V_per_s * time_s + noise_V(numbers), 25.0});
    }
    return implausible_steady_current(series, capacity_Ah);
  };
  for (const unsigned seed : {1U, 2U, 3U, 4U, 5U}) {
    CAPTURE(seed);
    CHECK(slow(-0.1 / 72'000.0, seed) == "");
    CHECK(slow(0.3 / 72'000.0, seed) != "");
  }
}

TEST_CASE("a rise that slows down is one that ends, unless it goes on for half an hour", "[unit][bmucell]") {
  const auto in_two_spans = [](double first_V, double second_V, double span_s) {
    Series series = steady(0.0, 300.0 + 2.0 * span_s);
    for (SeriesRow& row : series.rows) {
      const double spans = std::max(row.time_s - 300.0, 0.0) / span_s;
      row.voltage_V = 3.6 + first_V * std::min(spans, 1.0) + second_V * std::max(spans - 1.0, 0.0);
    }
    return implausible_steady_current(series, capacity_Ah);
  };
  CHECK(in_two_spans(0.050, 0.030, 600.0) != "");
  CHECK(in_two_spans(0.050, 0.020, 600.0) == "");
  CHECK(in_two_spans(0.200, 0.020, 2'400.0) != "");
}

TEST_CASE("only what is steady, large and without a gap is judged", "[unit][bmucell]") {
  const auto changed = [](auto change) {
    Series series = steady(just_enough_V_per_s);
    change(series.rows);
    return implausible_steady_current(series, capacity_Ah);
  };
  CHECK(changed([](auto& rows) { rows[60].current_A = 2.11; }) != "");
  CHECK(changed([](auto& rows) { rows[60].current_A = 2.13; }) == "");
  CHECK(changed([](auto& rows) { rows[60].current_A = std::nan(""); }) == "");
  CHECK(changed([](auto& rows) { rows[60].voltage_V = std::nan(""); }) != "");
  CHECK(changed([](auto& rows) {
          for (SeriesRow& row : rows) row.current_A = 0.2;
        }) != "");
  CHECK(changed([](auto& rows) {
          for (SeriesRow& row : rows) row.current_A = 0.19;
        }) == "");
  CHECK(changed([](auto& rows) { rows.erase(rows.begin() + 60, rows.begin() + 70); }) == "");
  CHECK(changed([](auto& rows) { rows.clear(); }) == "");
}

TEST_CASE("a cold cell that warms itself loses resistance, and may rise under its load", "[unit][bmucell]") {
  const auto at = [](double from_C, double to_C) {
    Series series = steady(just_enough_V_per_s);
    for (SeriesRow& row : series.rows) row.temperature_C = from_C + (to_C - from_C) * row.time_s / 1'500.0;
    return implausible_steady_current(series, capacity_Ah);
  };
  CHECK(at(9.9, 12.0) == "");
  CHECK(at(9.9, 11.8) != "");
  CHECK(at(10.0, 20.0) != "");
  CHECK(at(std::nan(""), std::nan("")) != "");
}

// Recordings of a cell tester as CSV: of a cell, usually of 1.2 Ah, that is nothing but a slope of 0.9 V and 50 mOhm,
// in the units and with the columns that a test chooses.
#pragma once

#include <array>
#include <cmath>
#include <cstdio>
#include <string>

namespace bmu::test {

/// An hour from 95 %, a row a second, the current in steps of 30 s.
struct Bench {
  double volts_in = 1.0;      // 1000: millivolts
  double current_sign = 1.0;  // -1: positive into the cell
  double current_in = 1.0;    // 1000: milliamperes
  double seconds_in = 1.0;    // 1000: milliseconds; 1/60.0: minutes
  double percent_in = 1.0;    // 0.01: a fraction
  double temperature = 25.0;  // in whatever unit
  bool has_temperature = true;
  bool has_soc = true;
  bool has_gap = false;
  bool has_charges = false;             // also currents into the cell
  bool has_current_sign = true;         // false: its size alone
  bool restarts_time = false;           // at each step of the current
  bool has_depth_of_discharge = false;  // in place of the state of charge
  bool has_still_soc = false;
  int rows_without_voltage = 0;  // the first so many
  double capacity_Ah = 1.2;

  [[nodiscard]] double current_A(int second) const {
    constexpr std::array steps_A{1.5, 0.3, 1.5, 0.3};
    constexpr std::array steps_both_ways_A{1.5, 1.5, 0.0, -0.6};
    const auto step = static_cast<std::size_t>(second / 30 % 4);
    return has_charges ? steps_both_ways_A.at(step) : steps_A.at(step);
  }

  [[nodiscard]] std::string csv() const {
    std::string text =
        has_soc ? "time_s,current_A,voltage_V,temp_C,ref_soc_pct\n" : "time_s,current_A,voltage_V,temp_C\n";
    double soc = 0.95;
    for (int second = 0; second < 3'600; ++second) {
      soc -= current_A(second) / (capacity_Ah * 3'600.0);
      if (has_gap && second > 600 && second < 2'400) continue;
      add_row(text, second, soc);
    }
    return text;
  }

 private:
  void add_row(std::string& text, int second, double soc) const {
    const auto add = [&text](const char* form, double value) {
      std::array<char, 40> field{};
      std::snprintf(field.data(), field.size(), form, value);
      text += field.data();
    };
    const double true_A = current_A(second);
    const double shown_A = has_current_sign ? current_sign * true_A : std::abs(true_A);
    add("%.10g", seconds_in * (restarts_time ? second % 30 : second));
    add(",%.4f,", current_in * shown_A);
    if (second >= rows_without_voltage) add("%.5f", volts_in * (3.2 + 0.9 * soc - 0.05 * true_A));
    text += ',';
    if (has_temperature) add("%.6g", temperature);
    const double shown_soc = has_still_soc ? 0.5 : has_depth_of_discharge ? 1.0 - soc : soc;
    if (has_soc) add(",%.4f", percent_in * 100.0 * shown_soc);
    text += '\n';
  }
};

/// A discharge from full and a charge of 20 hours each, a row a minute, without ref_soc_pct.
[[nodiscard]] inline std::string slow_csv(double current_sign) {
  std::string text = "time_s,current_A,voltage_V,temp_C\n";
  double soc = 1.0;
  for (int minute = 0; minute < 2'400; ++minute) {
    const double current_A = minute < 1'200 ? 0.06 : -0.06;
    soc -= current_A / 72.0;
    std::array<char, 80> line{};
    std::snprintf(line.data(), line.size(), "%d,%.3f,%.5f,25\n", 60 * minute, current_sign * current_A,
                  3.2 + 0.9 * soc - 0.05 * current_A);
    text += line.data();
  }
  return text;
}

}  // namespace bmu::test

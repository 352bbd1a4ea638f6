// A cell to test the estimators of the state of charge: it follows the equations of CellDynamics, integrated here in
// small steps, and may differ from its model in all that an estimator has to cope with. It shares the tables and
// nothing else with them; tests of the tables work them out by hand.
//
//   SimulatedCell truth(cell, {.soc = 0.8, .capacity_share = -0.15});
//   filter.update(truth.run(1.0, 5.0, 25.0));     one second of 5 A at 25 C, and its measurements
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <random>

#include "daemon/core/cell/cell_dynamics.hpp"
#include "daemon/core/estimation/soc/soc_estimate.hpp"

namespace bmu::test {

/// The same numbers from the same seed with every compiler: the standard guarantees that of the engine, not of its
/// distributions.
class Chance {
 public:
  explicit Chance(std::uint64_t seed) : engine_(seed) {}

  /// Uniform from 0 to 1, 1 excluded.
  double even() { return static_cast<double>(engine_() >> 11U) * 0x1p-53; }
  double between(double low, double high) { return low + (high - low) * even(); }
  bool one_in(double count) { return even() * count < 1.0; }
  /// Normal, with a standard deviation of 1 (Box and Muller).
  double normal() {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - even()));
    return radius * std::cos(2.0 * std::numbers::pi * even());
  }

 private:
  std::mt19937_64 engine_;
};

struct SimulatedCellOptions {
  double soc = 0.5;
  double hysteresis = 0.0;
  double capacity_share = 0.0;    // -0.15: 15 % less than its model
  double resistance_share = 0.0;  // 0.4: 40 % more
  double sensor_gain = 0.0;       // 0.01: shows 1 % more than flows
  double sensor_offset_A = 0.0;
  double voltage_noise_V = 0.0;   // one standard deviation
  double slow_error_share = 0.0;  // 1: deviates slowly from its model by as much as the model states
  std::uint64_t seed = 1;
};

class SimulatedCell {
 public:
  /// `cell` must outlive this.
  SimulatedCell(const CellDynamics& cell, const SimulatedCellOptions& options)
      : cell_(cell), options_(options), chance_(options.seed), soc_(options.soc), hysteresis_(options.hysteresis) {
    error_V_ = options.slow_error_share * at(cell, soc_, 25.0).slow_error_V * chance_.normal();
  }

  /// Carries `current_A` for `passed_s`; returns the sensors' values at its end.
  CellSample run(double passed_s, double current_A, double temperature_C) {
    constexpr double step_max_s = 0.25;
    const auto steps = static_cast<int>(std::ceil(passed_s / step_max_s));
    for (int step = 0; step < steps; ++step) advance(passed_s / steps, current_A, temperature_C);
    const CellPoint point = at(cell_, soc_, temperature_C);
    const double keep = std::exp(-passed_s / point.slow_error_time_s);
    error_V_ = error_V_ * keep +
               options_.slow_error_share * point.slow_error_V * std::sqrt(1.0 - keep * keep) * chance_.normal();
    const double told_A = current_A * (1.0 + options_.sensor_gain) + options_.sensor_offset_A;
    return {.passed_s = passed_s,
            .mean_current_A = told_A,
            .current_A = told_A,
            .voltage_V = voltage_V(current_A, temperature_C) + options_.voltage_noise_V * chance_.normal(),
            .temperature_C = temperature_C};
  }

  [[nodiscard]] double soc() const { return soc_; }
  [[nodiscard]] double hysteresis() const { return hysteresis_; }
  [[nodiscard]] double voltage_V(double current_A, double temperature_C) const {
    const CellPoint point = at(cell_, soc_, temperature_C);
    const double transfer_V =
        point.kinetic_Ohm * point.exchange_current_A * std::asinh(current_A / point.exchange_current_A);
    const double taken_V = point.series_Ohm * current_A + transfer_V + pair_V_[0] + pair_V_[1] + pair_V_[2];
    return point.ocv_V + hysteresis_ * point.hysteresis_V - (1.0 + options_.resistance_share) * taken_V + error_V_;
  }

 private:
  void advance(double step_s, double current_A, double temperature_C) {
    const double capacity_As = cell_.capacity_As * (1.0 + options_.capacity_share);
    const double arriving_A = current_A < 0.0 ? current_A * cell_.charge_efficiency : current_A;
    const double month_s = 2'592'000.0;
    const double warmth = std::pow(2.0, (temperature_C - 25.0) / 10.0);
    const double lost_A = cell_.self_discharge_per_month * capacity_As / month_s * warmth;
    soc_ -= (arriving_A + lost_A) * step_s / capacity_As;
    const double sign = current_A > 0.0 ? 1.0 : current_A < 0.0 ? -1.0 : 0.0;
    const double charge_share = std::abs(current_A) * step_s / (cell_.hysteresis_charge * capacity_As);
    hysteresis_ += (-sign - hysteresis_) * charge_share;
    const CellPoint point = at(cell_, soc_, temperature_C);
    for (std::size_t pair = 0; pair < CellDynamics::pairs; ++pair) {
      pair_V_[pair] += (point.pair_Ohm[pair] * current_A - pair_V_[pair]) * step_s / cell_.pair_time_constant_s[pair];
    }
  }

  const CellDynamics& cell_;
  SimulatedCellOptions options_;
  Chance chance_;
  double soc_;
  double hysteresis_;
  std::array<double, CellDynamics::pairs> pair_V_{};
  double error_V_ = 0.0;
};

/// Current of a cell in a vehicle, in multiples of its capacity per hour: a new current every 20 s, down to 12 %, with
/// rests, and then a charge up to 95 %.
class SimulatedDrive {
 public:
  SimulatedDrive(const CellDynamics& cell, std::uint64_t seed)
      : hour_rate_A_(cell.capacity_As / 3600.0), chance_(seed) {}

  double current_A(double passed_s, double soc) {
    if (soc < 0.12) is_charging_ = true;
    if (soc > 0.95) is_charging_ = false;
    if (is_charging_) return -0.5 * hour_rate_A_;
    left_s_ -= passed_s;
    if (left_s_ <= 0.0) {
      left_s_ = 20.0;
      drive_A_ = chance_.one_in(4.0) ? 0.0 : hour_rate_A_ * chance_.between(-0.5, 1.7);
    }
    return drive_A_;
  }

 private:
  double hour_rate_A_;
  Chance chance_;
  bool is_charging_ = false;
  double left_s_ = 0.0;
  double drive_A_ = 0.0;
};

/// A cell of 10 Ah in two rows. Its open-circuit voltage rises evenly by 0.9 V, its resistances follow Arrhenius' law,
/// and its charge transfer is noticeable only in the cold.
inline CellDynamics sloped_cell() {
  CellDynamics cell;
  cell.activation_K = 3000.0;
  cell.capacity_As = 36'000.0;
  cell.pair_time_constant_s = {10.0, 100.0, 1000.0};
  for (const double temperature_C : {-10.0, 25.0}) {
    const double cold = std::exp(3000.0 * (1.0 / (temperature_C + 273.15) - 1.0 / 298.15));
    CellDynamics::Row row{.temperature_C = temperature_C,
                          .exchange_current_A = 20.0 / cold,
                          .slow_error_V = 0.008,
                          .fast_error_V = 0.004};
    for (std::size_t point = 0; point < CellDynamics::curve_points; ++point) {
      row.ocv_V[point] = 3.2 + 0.9 * static_cast<double>(point) / 50.0;
    }
    row.hysteresis_V.fill(0.01);
    row.series_Ohm.fill(0.003 * cold);
    row.kinetic_Ohm.fill(0.002 * cold);
    for (auto& pair_Ohm : row.pair_Ohm) pair_Ohm.fill(0.001 * cold);
    cell.rows.push_back(row);
  }
  return cell;
}

/// The same with a curve as of iron phosphate: steep below 10 % and above 95 %, and 40 mV in between.
inline CellDynamics flat_cell() {
  CellDynamics cell = sloped_cell();
  for (CellDynamics::Row& row : cell.rows) {
    for (std::size_t point = 0; point < CellDynamics::curve_points; ++point) {
      const double soc = static_cast<double>(point) / 50.0;
      const double steep_V = -0.45 * std::max(0.1 - soc, 0.0) / 0.1 + 0.10 * std::max(soc - 0.95, 0.0) / 0.05;
      row.ocv_V[point] = 3.27 + 0.04 * soc + steep_V;
    }
    row.slow_error_V = 0.005;
    row.fast_error_V = 0.003;
  }
  return cell;
}

}  // namespace bmu::test

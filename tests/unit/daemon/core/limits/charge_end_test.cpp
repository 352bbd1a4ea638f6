// End of a charge: a cell that matches the model or deviates a little, the limits computed by the core, and a charger
// that follows with a delay. The voltage must not exceed its hold voltage by more than the uncertainty, and nothing may
// oscillate.
#include <algorithm>
#include <cmath>
#include <deque>

#include "daemon/core/limits/limit_ramp.hpp"
#include "daemon/core/limits/pack_forecast.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/simulated_cell.hpp"

using namespace bmu;

namespace {

/// 10 Ah, 3.2 V empty and 4.25 V full: a rested cell reaches its limits before it is full.
CellDynamics tall_cell() {
  CellDynamics cell = test::sloped_cell();
  for (CellDynamics::Row& row : cell.rows) {
    for (std::size_t point = 0; point < CellDynamics::curve_points; ++point) {
      row.ocv_V[point] = 3.2 + 1.05 * static_cast<double>(point) / 50.0;
    }
  }
  return cell;
}

CoreConfig pack_config() {
  CoreConfig config;
  config.limits.cell_undervoltage = {.warn = 3'100'000, .open = 2'900'000, .hysteresis = 50'000};
  config.limits.cell_overvoltage = {.warn = 4'150'000, .open = 4'200'000, .hysteresis = 20'000};
  config.limits.cell_overtemperature = {.warn = 500, .open = 600, .hysteresis = 50};
  config.limits.cell_undertemperature = {.warn = -200, .open = -300, .hysteresis = 20};
  config.current = {.discharge_continuous_mA = 80'000, .charge_continuous_mA = 20'000};
  config.limit_ramp = {.charge_fall_mA_per_s = 80'000, .charge_rise_mA_per_s = 2'000};
  return config;
}

struct Charge {
  double resistance_share = 0.0;  // of the cell, above its model
  double temperature_C = 25.0;
  bool is_estimated = true;  // otherwise only measured values are known
  bool has_forecast = true;  // otherwise only the linear derating holds the voltage
  bool has_ramp = true;
  bool is_told_seldom = false;  // once a second, in whole amperes, as in 624h
};

struct Ending {
  double highest_V = 0.0;
  double last_A = 0.0;
  double soc = 0.0;
  double rises_A = 0.0;  // sum of all rises of the current since it first fell below 15 A
  int reversals = 0;     // of more than 1.5 A
};

/// Counts reversals of a value; those smaller than `least` are ignored.
class Reversals {
 public:
  void add(double value) {
    if (is_up_ ? value > extreme_ : value < extreme_) extreme_ = value;
    if (std::abs(value - extreme_) < least) return;
    ++count_;
    is_up_ = !is_up_;
    extreme_ = value;
  }
  [[nodiscard]] int count() const { return count_; }

 private:
  static constexpr double least = 1.5;
  bool is_up_ = true;
  double extreme_ = 0.0;
  int count_ = 0;
};

/// Simulation of one charge, in ticks of 10 ms. Voltages are measured every 100 ms, with half a millivolt of noise.
class Charging {
 public:
  explicit Charging(const Charge& charge)
      : charge_(charge),
        truth_(cell_, {.soc = 0.8, .resistance_share = charge.resistance_share, .voltage_noise_V = 0.0005}) {
    if (!charge.has_ramp) config_.limit_ramp = {};
  }

  Ending run(Duration duration) {
    Ending ending;
    Reversals reversals;
    for (TimePoint now{1s}; now < TimePoint{1s} + duration; now += 10ms) {
      const double before_A = charger_A_;
      tick(now);
      ending.highest_V = std::max(ending.highest_V, truth_.voltage_V(-charger_A_, charge_.temperature_C));
      has_tapered_ = has_tapered_ || (charger_A_ < 15.0 && now > TimePoint{5s});
      if (has_tapered_) ending.rises_A += std::max(charger_A_ - before_A, 0.0);
      reversals.add(charger_A_);
    }
    ending.last_A = charger_A_;
    ending.soc = truth_.soc();
    ending.reversals = reversals.count();
    return ending;
  }

 private:
  void tick(TimePoint now) {
    const CellSample sample = truth_.run(0.01, -charger_A_, charge_.temperature_C);
    if ((now - TimePoint{}) % 100ms == 0ms) take(sample);
    const CurrentLimits targets = evaluate_limits(
        pack_, config_, {.is_connected = true, .may_discharge = true, .may_charge = true, .predicted = predicted_});
    orders_.push_back(ramps_.follow(targets, now, config_.limit_ramp).charge.limit_mA / 1e3);
    constexpr std::size_t delay_ticks = 20;
    if (orders_.size() <= delay_ticks) return;
    const double order_A = orders_.front();
    orders_.pop_front();
    if (!charge_.is_told_seldom) {
      charger_A_ = order_A;
    } else if ((now - TimePoint{}) % 1s == 0ms) {
      charger_A_ = std::floor(order_A);
    }
  }

  void take(const CellSample& sample) {
    const auto voltage_uV = static_cast<std::int32_t>(std::lround(sample.voltage_V * 1e6));
    const auto temperature_dC = static_cast<std::int32_t>(std::lround(sample.temperature_C * 10.0));
    pack_.cell_voltage_uV = {.min = voltage_uV, .max = voltage_uV, .count = 1, .expected = 1};
    pack_.cell_temperature_dC = {.min = temperature_dC, .max = temperature_dC, .count = 1, .expected = 1};
    if (!charge_.has_forecast) return;
    CellForecastInput input = measured_only(cell_, sample.voltage_V, sample.current_A, sample.temperature_C);
    if (charge_.is_estimated) {
      input.soc = {.is_known = true, .soc = truth_.soc(), .sigma = 0.01};
      input.hysteresis = truth_.hysteresis();
      input.resistance_share = 0.0;
      input.resistance_sigma = 0.1;
    }
    PackForecast forecast(cell_, config_);
    forecast.add(input, {});
    predicted_ = forecast.limits();
  }

  Charge charge_;
  CellDynamics cell_ = tall_cell();
  CoreConfig config_ = pack_config();
  test::SimulatedCell truth_;
  PackState pack_;
  PredictedLimits predicted_;
  LimitRamps ramps_;
  std::deque<double> orders_;
  double charger_A_ = 0.0;
  bool has_tapered_ = false;
};

Ending end_of(const Charge& charge) {
  return Charging(charge).run(45min);
}

}  // namespace

TEST_CASE("a charge ends below the opening voltage and without a swing", "[unit][limits][ramp][prediction][BMU_13]") {
  for (const double resistance_share : {-0.3, 0.0, 0.3}) {
    for (const double temperature_C : {0.0, 25.0, 40.0}) {
      for (const bool is_estimated : {true, false}) {
        CAPTURE(resistance_share, temperature_C, is_estimated);
        const Ending ending = end_of(
            {.resistance_share = resistance_share, .temperature_C = temperature_C, .is_estimated = is_estimated});
        CAPTURE(ending.highest_V, ending.last_A, ending.soc, ending.rises_A, ending.reversals);
        CHECK(ending.highest_V < 4.1895);  // held at 4.1875, opened at 4.2
        CHECK(ending.reversals <= 3);      // its start is one of them
        CHECK(ending.rises_A < 30.0);
        CHECK(ending.last_A < 2.0);
        CHECK(ending.soc > 0.85);
      }
    }
  }
}

TEST_CASE("a charger that hears of its limit once a second in whole amperes ends its charge, too",
          "[unit][limits][ramp][prediction][BMU_13]") {
  for (const double resistance_share : {-0.3, 0.0, 0.3}) {
    CAPTURE(resistance_share);
    const Ending ending = end_of({.resistance_share = resistance_share, .is_told_seldom = true});
    CAPTURE(ending.highest_V, ending.last_A, ending.soc, ending.rises_A, ending.reversals);
    CHECK(ending.highest_V < 4.1895);
    CHECK(ending.last_A < 2.0);
    CHECK(ending.soc > 0.9);
    CHECK(ending.reversals <= 9);
    CHECK(ending.rises_A < 30.0);
  }
}

TEST_CASE("the straight lines alone come nearer to where it opens, and without a ramp they swing",
          "[unit][limits][ramp]") {
  const Charge lines{.has_forecast = false};
  const Ending ramped = end_of(lines);
  Charge jumping = lines;
  jumping.has_ramp = false;
  const Ending jumped = end_of(jumping);
  CAPTURE(ramped.highest_V, ramped.reversals, ramped.rises_A, jumped.highest_V, jumped.reversals, jumped.rises_A);
  CHECK(jumped.reversals > 100);
  CHECK(jumped.highest_V > 4.2);
  CHECK(ramped.rises_A < jumped.rises_A / 4.0);
  CHECK(ramped.highest_V < jumped.highest_V);
  CHECK(ramped.highest_V > end_of({}).highest_V);
}

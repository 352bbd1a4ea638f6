// Whether the cells' voltages answer the current the way they must, also where it never steps: a current sensor that
// is mounted the wrong way round in a pack whose load only swells and ebbs. (Steps are looked at by step_response.hpp,
// within a tenth of a second.)
//
// The mean voltage of the cells and the current both go through the same high-pass, x' = x * exp(-dt / 20 s) + change
// of x; over some five minutes the regression of the one on the other is the resistance. A cell's is above 0, and what
// its charge does to the voltage meanwhile has the same sign. Below minus a third of the expected one, with enough
// that has moved, the current is the wrong way round.
//
// Cost: two exponentials a picture.
#pragma once

#include <cmath>

#include "daemon/core/estimators/soc_estimate.hpp"

namespace bmu {

class CurrentDirection {
 public:
  CurrentDirection() = default;
  /// Of one cell, both above 0: the current of one hour, and what a step of it shows.
  CurrentDirection(double hour_current_A, double expected_Ohm)
      : enough_A2s_(least_swing_share * hour_current_A * least_swing_share * hour_current_A * enough_s),
        least_Ohm_(-against_share * expected_Ohm) {}

  /// A picture, so long after the one before: the current and the mean voltage of all cells. What was not measured, or
  /// time that did not pass, begins the swings anew.
  void update(double passed_s, double current_A, double mean_voltage_V) {
    if (!is_measured(current_A) || !is_measured(mean_voltage_V) || !(passed_s > 0.0)) return begin_anew();
    const bool goes_on = is_running_ && passed_s <= gap_most_s;
    const double kept = std::exp(-passed_s / pass_time_s);
    swing_A_ = goes_on ? swing_A_ * kept + (current_A - current_A_) : 0.0;
    swing_V_ = goes_on ? swing_V_ * kept + (mean_voltage_V - voltage_V_) : 0.0;
    is_running_ = true;
    current_A_ = current_A;
    voltage_V_ = mean_voltage_V;
    if (!goes_on) return;
    const double remembered = std::exp(-passed_s / memory_s);
    moved_A2s_ = moved_A2s_ * remembered + swing_A_ * swing_A_ * passed_s;
    answered_AVs_ = answered_AVs_ * remembered - swing_A_ * swing_V_ * passed_s;
  }
  /// A sensor may be turned round while the pack is open.
  void forget() {
    begin_anew();
    moved_A2s_ = 0.0;
    answered_AVs_ = 0.0;
  }
  /// Enough has moved to say so, one way or the other.
  [[nodiscard]] bool is_known() const { return enough_A2s_ > 0.0 && moved_A2s_ >= enough_A2s_; }
  [[nodiscard]] bool is_contradicted() const { return is_known() && answered_AVs_ < least_Ohm_ * moved_A2s_; }

 private:
  static constexpr double pass_time_s = 20.0;
  static constexpr double memory_s = 300.0;
  static constexpr double gap_most_s = 2.5;
  /// A minute of swings of a tenth of the one-hour current.
  static constexpr double least_swing_share = 0.1;
  static constexpr double enough_s = 60.0;
  static constexpr double against_share = 1.0 / 3.0;

  void begin_anew() { is_running_ = false; }

  double enough_A2s_ = 0.0;
  double least_Ohm_ = 0.0;
  bool is_running_ = false;
  double current_A_ = 0.0;
  double voltage_V_ = 0.0;
  double swing_A_ = 0.0;
  double swing_V_ = 0.0;
  double moved_A2s_ = 0.0;
  double answered_AVs_ = 0.0;
};

}  // namespace bmu

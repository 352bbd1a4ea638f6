// Resistance of one cell from any change of the current: the value that a step shows about a second after it.
//
// Voltage and current both pass the same high-pass, x' = x * exp(-dt / 2 s) + change of x, and the resistance is the
// straight line through zero between the two, found by recursive least squares with slow forgetting. The contributions
// of the open-circuit voltage, a slow RC element or the sensor's offset move slowly and do not pass; a ramp is as good
// as a step, because the time of the step is not used. The result is the value that a step shows about a second after
// it, however often the cell is sampled (every 50 ms to every 2 s): the fast drop and most of the charge transfer, but
// little diffusion; ExpectedResistance has it in numbers. Samples of instants a second apart miss the movement of an
// unsteady current in between and show a little less than means over that second. On recorded cells: docs/accuracy.md.
//
// The least squares are a Kalman filter with one state, the resistance at 25 C, that drifts by a tenth in an hour, so
// that it follows the state of charge and, even more so, age. The filter does not
//   - follow the weather: samples are converted to 25 C by the model (ExpectedResistance);
//   - count one large step as a hundred small ones: a step gives the resistance to some 6 %, however large it is (the
//     model has no kinetics, no slow RC elements), and to 2 mV, however small;
//   - follow an improbable sample: an error of more than three standard deviations counts as three (P. Huber, Robust
//     Statistics, Wiley 1981, chapter 7). A cell that really got worse is nevertheless followed, within minutes;
//   - learn from less than C/20, or from a constant current: be it the load's or the sensor's, it changes nothing.
//
// A sensor that reads 2 % too much makes all cells 2 % better; that cannot be detected here, and does not affect a
// comparison of cells with each other. (Recursive least squares with fading memory: L. Ljung, System Identification,
// 2nd ed., Prentice Hall 1999, section 11.2. The resistance of cells by it: G. L. Plett, Battery Management Systems,
// Vol. II, Artech House 2016, chapter 4.)
//
// Cost: one exponential, one root and some 40 multiplications a sample; 88 bytes a cell.
#pragma once

#include <cmath>

#include "daemon/core/estimation/health/expected_resistance.hpp"
#include "daemon/core/estimation/soc/model_pointer.hpp"
#include "daemon/core/estimation/soc/soc_estimate.hpp"
#include "protocol/fields.hpp"

namespace bmu {

struct ResistanceEstimate {
  bool is_known = false;
  double resistance_Ohm = 0.0;  // above 0 when known
  double sigma_Ohm = 0.0;       // the truth lies within two of these in most cases; the sensor's gain comes on top
};

class ResistanceTracker {
 public:
  /// Starts with a cell of which only the kind is known. `expected` must outlive the tracker.
  void begin(const ExpectedResistance& expected);
  /// Rebinds to the same expectation at its new address. Before begin(): no effect.
  void move_to(const ExpectedResistance& expected) { expected_.move_to(expected); }
  [[nodiscard]] bool is_begun() const { return expected_.is_set(); }
  /// After begin(): restores a previous session's resistance at 25 C and its learned_sigma_Ohm(). Values not above 0,
  /// or implausible ones, are ignored.
  void restore(double resistance_Ohm, double learned_sigma_Ohm);
  /// Before begin(): no effect. Uses the time, current, voltage and temperature of the sample; current and voltage must
  /// be of the same instant, or means over the same time. A sample without current or voltage is skipped (one without a
  /// temperature is not learned from), and the next one is compared with the last complete one, if that is not more
  /// than 2.5 s ago; otherwise the high-passes restart with that sample, and if no time has elapsed with the next one.
  /// A voltage jump that no step of the current explains, now or just before, restarts them, too.
  void update(const CellSample& sample);
  /// Call if the voltage moves for a reason of its own between the last sample and the next: the cell starts or stops
  /// bleeding. The estimate stays.
  void restart() { is_running_ = false; }

  /// At a temperature of the cell: the present one, or resistance_reference_C. Known after some three steps of the
  /// current, and from then on; unknown without a temperature, unless the model does not depend on it. Far from the
  /// temperatures at which it was learned it is less accurate.
  [[nodiscard]] ResistanceEstimate estimate(double temperature_C) const;
  /// At 25 C, the part that more steps average out; not valid before the resistance is known.
  [[nodiscard]] double learned_sigma_Ohm() const { return std::sqrt(variance_Ohm2_); }

 private:
  void age(double passed_s);
  void begin_with(const CellSample& sample);
  void learn(double factor, double kept_share);

  ModelPointer<ExpectedResistance> expected_;
  // At 25 C.
  double resistance_Ohm_ = 0.0;
  double variance_Ohm2_ = 0.0;
  double learned_factor_ = 1.0;  // at the temperature of learning, approximate
  bool is_known_ = false;
  // The high-passes.
  bool is_running_ = false;
  double since_s_ = 0.0;  // since the last complete sample
  double current_A_ = 0.0;
  double voltage_V_ = 0.0;
  double swing_A_ = 0.0;
  double swing_V_ = 0.0;
  double strength_A2_ = 0.0;  // largest filtered current of the last half minute or so, squared
  [[nodiscard]] bool are_fields_possible() const {
    constexpr double resistance_most_Ohm = 1e3;
    return is_within(resistance_Ohm_, 0.0, resistance_most_Ohm) &&
           is_within(variance_Ohm2_, 0.0, resistance_most_Ohm * resistance_most_Ohm) &&
           is_within(learned_factor_, 1e-6, 1e6);
  }
  BMU_FIELDS(expected_, resistance_Ohm_, variance_Ohm2_, learned_factor_, is_known_, is_running_, since_s_, current_A_,
             voltage_V_, swing_A_, swing_V_, strength_A2_)
};

}  // namespace bmu

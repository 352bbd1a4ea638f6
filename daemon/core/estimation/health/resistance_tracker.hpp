// The resistance of one cell, from whatever the current does: what a step shows about a second after it.
//
// Voltage and current both go through the same high-pass, x' = x * exp(-dt / 2 s) + change of x, and the resistance is
// the straight line through zero between the two, found by recursive least squares that forget slowly. What an
// open-circuit voltage, a slow pair or the sensor's offset add moves slowly and does not pass; a ramp is as good as a
// step, because nobody asks when the step was. What comes out is what a step shows about a second after it, however
// often the cell is sampled (every 50 ms to every 2 s): the fast drop and most of the charge transfer, but little
// diffusion; ExpectedResistance has it in numbers. Instants a second apart miss what a restless current did in between
// and show a little less than means over that second. On recorded cells: docs/accuracy.md.
//
// The least squares are a Kalman filter with one state, the resistance at 25 C, that wanders by a tenth in an hour, so
// that it follows the state of charge and, all the more, age. What it does not do:
//   - follow the weather: samples are referred to 25 C by what the model says (ExpectedResistance);
//   - take one large step for a hundred small ones: a step tells the resistance to some 6 %, however large it is (the
//     model has no kinetics, no slow pairs), and to 2 mV, however small;
//   - believe what is hard to believe: an error of more than three standard deviations counts as three (P. Huber,
//     Robust Statistics, Wiley 1981, chapter 7). A cell that really got worse is followed all the same, within minutes;
//   - learn from less than a twentieth of the one-hour current, or from nothing: a current that stands still, be it
//     the load's or the sensor's, changes nothing.
//
// A sensor that tells 2 % too much makes all cells 2 % better; nothing here can see that, and nothing that compares
// cells with each other minds. (Recursive least squares with fading memory: L. Ljung, System Identification, 2nd ed.,
// Prentice Hall 1999, section 11.2. The resistance of cells by it: G. L. Plett, Battery Management Systems, Vol. II,
// Artech House 2016, chapter 4.)
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
  /// A cell of which nothing is known but its kind. `expected` must outlive the tracker.
  void begin(const ExpectedResistance& expected);
  /// The same expectation, where it lies now. Before begin(): nothing.
  void move_to(const ExpectedResistance& expected) { expected_.move_to(expected); }
  [[nodiscard]] bool is_begun() const { return expected_.is_set(); }
  /// After begin(): the cell is known from a former life, by its resistance at 25 C and learned_sigma_Ohm() of then.
  /// What is not above 0, or absurd, says nothing.
  void restore(double resistance_Ohm, double learned_sigma_Ohm);
  /// Before begin(): nothing happens. Of the sample its time, current, voltage and temperature are used; current and
  /// voltage must be of the same instant, or means over the same time. What was not measured is passed over and the
  /// next sample is compared with the last one that was, if that is not more than 2.5 s ago; otherwise, and when time
  /// did not pass, it begins anew with that sample. A jump of the voltage that no step of the current explains, now or
  /// just before, does the same.
  void update(const CellSample& sample);
  /// Between the last sample and the next the voltage moves for a reason of its own: the cell begins or ceases to
  /// bleed. What is known stays.
  void restart() { is_running_ = false; }

  /// At a temperature of the cell: now, or resistance_reference_C. Known after some three steps of the current, and
  /// from then on; not known without a temperature, unless the model does not mind it. Far from the temperatures that
  /// it was learned at it is less sure.
  [[nodiscard]] ResistanceEstimate estimate(double temperature_C) const;
  /// At 25 C, of what more steps average out; means nothing before it is known.
  [[nodiscard]] double learned_sigma_Ohm() const { return std::sqrt(variance_Ohm2_); }

 private:
  void age(double passed_s);
  void begin_with(const CellSample& sample);
  void learn(double factor, double kept_share);

  ModelPointer<ExpectedResistance> expected_;
  // At 25 C.
  double resistance_Ohm_ = 0.0;
  double variance_Ohm2_ = 0.0;
  double learned_factor_ = 1.0;  // of the temperature that it was learned at, about
  bool is_known_ = false;
  // The high-passes.
  bool is_running_ = false;
  double since_s_ = 0.0;  // the last sample that was whole
  double current_A_ = 0.0;
  double voltage_V_ = 0.0;
  double swing_A_ = 0.0;
  double swing_V_ = 0.0;
  double strength_A2_ = 0.0;  // the largest swing of the last half minute or so, squared
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

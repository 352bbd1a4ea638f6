// State of charge of one cell by an extended Kalman filter: counting gives its change, the voltage its value, each
// weighted by its uncertainty.
//
// The filter has eight states: the state of charge; the voltages of the three RC elements; the present error of the
// model, which varies (an Ornstein-Uhlenbeck process with the strength and the time constant of the fit's residuals);
// the offset of the current sensor; the relative error of the counting, by the sensor's gain or the cell's capacity;
// and the relative deviation of this cell's resistances from its model's. The duration of the model's error prevents
// overconfidence: without it ten thousand samples with the same error would count as independent. The hysteresis is
// computed, not estimated.
//
// The sensitivity of the voltage to the charge is that of a secant line over the possible states of charge, not of a
// tangent at one of them (statistical linearisation; A. Gelb, Applied Optimal Estimation, MIT Press 1974, section 6.2),
// and the resistances change along it, too: in the cold, near full and near empty, they contribute more than the
// open-circuit voltage. The deviation of the line from a bent curve is an error of the model as long as the charge is
// there: at a knee the voltage shows on which side of it the cell is, not where.
//
// An improbable voltage counts with an increased variance, with which it is just probable (P. Huber, Robust Statistics,
// Wiley 1981, chapter 7).
//
// Cost: three evaluations of the model and some 400 multiplications; docs/performance.md has the figure.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include "daemon/core/cell/cell_dynamics.hpp"
#include "daemon/core/estimation/soc/model_memo.hpp"
#include "daemon/core/estimation/soc/model_pointer.hpp"
#include "daemon/core/estimation/soc/soc_estimate.hpp"
#include "protocol/fields.hpp"

namespace bmu {

class SocFilter {
 public:
  /// `cell` must outlive the filter.
  void begin(const CellDynamics& cell, const CurrentSensorError& sensor, const SocBegin& from, double temperature_C);
  /// Rebinds to the same tables at their new address. Before begin(): no effect.
  void move_to(const CellDynamics& cell) { cell_.move_to(cell); }
  [[nodiscard]] bool is_begun() const { return cell_.is_set(); }
  /// Before begin(): no effect. `memo`: of the same model.
  void update(const CellSample& sample, ModelMemo& memo);
  void update(const CellSample& sample) {
    ModelMemo memo;
    update(sample, memo);
  }
  /// Corrects the state of charge by that of another source, e.g. the end of a charge, with one standard deviation
  /// above 0. Invalid values are ignored.
  void anchor(double soc, double sigma);

  [[nodiscard]] SocEstimate estimate() const;
  /// Standard deviation if the model were right up to the errors that it contains: smaller than the reported one, and
  /// the initial value of a filter that continues from here (SocBegin::has_followed).
  [[nodiscard]] double model_sigma() const { return std::sqrt(p_[soc_at][soc_at]); }
  /// Relative deviation of this cell's resistances from its model's: 0.4 is 40 % more.
  [[nodiscard]] double resistance_share() const { return x_[resistance_at]; }
  /// One standard deviation of it.
  [[nodiscard]] double resistance_sigma() const { return std::sqrt(p_[resistance_at][resistance_at]); }
  /// Present voltages of the RC elements, for a cell with the model's resistances.
  [[nodiscard]] std::array<double, CellDynamics::pairs> pair_V() const {
    return {x_[pair_at], x_[pair_at + 1], x_[pair_at + 2]};
  }
  /// Share by which too much is counted: the sensor's gain, or a capacity that is larger than the model's.
  [[nodiscard]] double counting_share() const { return x_[counting_at]; }
  /// Offset that the sensor adds to every current.
  [[nodiscard]] double offset_A() const { return x_[offset_at]; }
  [[nodiscard]] double hysteresis() const { return hysteresis_; }
  /// Deviation of the last voltage from the model's prediction of it, and the expected variance of that deviation: for
  /// this one voltage, not for all that share its error.
  [[nodiscard]] double innovation_V() const { return innovation_V_; }
  [[nodiscard]] double innovation_variance_V2() const { return innovation_variance_V2_; }
  /// Mismatch of this cell and its model, 0 or more; from 1 on the cell is not one of this model. The largest of three:
  /// the errors of the counting and of the resistances, as a share of the most that is learned; and the voltages of the
  /// last minutes, in units of three standard deviations.
  [[nodiscard]] double misfit() const;

 private:
  enum At : std::size_t {
    soc_at,
    pair_at,
    error_at = pair_at + CellDynamics::pairs,
    offset_at,
    counting_at,
    resistance_at,
    size
  };
  using Vector = std::array<double, size>;

  /// Secant line of the voltage over the possible states of charge, and its deviation from the curve.
  struct Chord {
    double slope_V = 0.0;
    double bend_V = 0.0;
  };

  struct Current {
    double A = 0.0;
    double kinetic_A = 0.0;  // I0 * asinh(I / I0), for the charge transfer
  };

  /// Variances of one voltage: of the measurement itself, and of the model for seconds.
  struct Errors {
    double sample_V2 = 0.0;
    double model_V2 = 0.0;
  };

  void share_error(const CellPoint& point, double age_s);
  void begin_pairs(const CellPoint& point, double current_A);
  void count(const CellSample& sample);
  void bound_doubt();
  void follow_hysteresis(double charge_As);
  void fade(const CellSample& sample, const CellPoint& point, ModelMemo& memo);
  void correct(const CellSample& sample, const CellDynamics::Row& row, const CellPoint& point);
  void follow_surprise(double left);
  /// Corrects the states by a measurement that is `innovation` above its prediction, with this variance of its own and
  /// the sensitivity `by` to each state; returns the variance of the prediction by the states.
  double learn(const Vector& by, double innovation, double variance);
  [[nodiscard]] double voltage_V(const CellPoint& here, const CellPoint& there, const Current& current) const;
  [[nodiscard]] Chord chord(const CellPoint& here, const CellDynamics::Row& row, const Current& current) const;
  [[nodiscard]] Errors errors(const CellSample& sample, const CellPoint& point, double current_A, double bend_V) const;

  ModelPointer<CellDynamics> cell_;
  CurrentSensorError sensor_;
  double capacity_As_ = 1.0;
  Vector x_{};                    // the states
  std::array<Vector, size> p_{};  // their covariance, symmetric
  double hysteresis_ = 0.0;
  double temperature_C_ = 25.0;
  double true_current_A_ = 0.0;  // mean of the last sample without the estimated error of the sensor
  double innovation_V_ = 0.0;
  double innovation_variance_V2_ = 0.0;
  bool are_pairs_unknown_ = false;  // until the first current
  double surprise_ = 0.0;           // squares of innovations relative to their variances, mean over some minutes
  [[nodiscard]] bool are_fields_possible() const;
  BMU_FIELDS(cell_, sensor_, capacity_As_, x_, p_, hysteresis_, temperature_C_, true_current_A_, innovation_V_,
             innovation_variance_V2_, are_pairs_unknown_, surprise_)
};

}  // namespace bmu

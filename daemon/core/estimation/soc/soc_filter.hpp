// State of charge of one cell by an extended Kalman filter: counting says how it changes, the voltage where it is, and
// both are believed as far as they deserve.
//
// The filter carries eight things that are not known: the state of charge; the three pairs' voltages; what the model is
// off by at the moment, which comes and goes (an Ornstein-Uhlenbeck process with the strength and the time that the fit
// left over); the offset of the current sensor; the share by which the counting is off, be it the sensor's gain or the
// cell's capacity; and the share by which this cell's resistances differ from its model's. That the model's error lasts
// is what keeps a filter from believing it: without it ten thousand samples with the same error count as ten thousand
// witnesses. The hysteresis is followed, not estimated.
//
// What a voltage says of the charge is taken from a chord over the states of charge that are possible, not from a
// tangent at one of them (statistical linearisation; A. Gelb, Applied Optimal Estimation, MIT Press 1974, section 6.2),
// and the resistances change along it, too: in the cold, near full and near empty, they say more than the open-circuit
// voltage. What the line is off by, where the curve bends, is an error of the model as long as the charge is there: at
// a knee the voltage says on which side of it the cell is, not where.
//
// A voltage that the model finds hard to believe counts as one that is just hard to believe (P. Huber, Robust
// Statistics, Wiley 1981, chapter 7).
//
// Cost: three looks at the model and some 400 multiplications; docs/performance.md has the figure.
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
  /// The same tables, where they lie now. Before begin(): nothing.
  void move_to(const CellDynamics& cell) { cell_.move_to(cell); }
  [[nodiscard]] bool is_begun() const { return cell_.is_set(); }
  /// Before begin(): nothing happens. `memo`: of the same model.
  void update(const CellSample& sample, ModelMemo& memo);
  void update(const CellSample& sample) {
    ModelMemo memo;
    update(sample, memo);
  }
  /// Somebody else knows the state of charge this well, one standard deviation above 0: the end of a charge does. What
  /// is not a number says nothing.
  void anchor(double soc, double sigma);

  [[nodiscard]] SocEstimate estimate() const;
  /// How sure it would be if the model were right up to the errors that it knows: less than it tells, and what a filter
  /// that goes on from here is to begin with (SocBegin::has_followed).
  [[nodiscard]] double model_sigma() const { return std::sqrt(p_[soc_at][soc_at]); }
  /// How far this cell's resistances are above its model's: 0.4 is 40 % more.
  [[nodiscard]] double resistance_share() const { return x_[resistance_at]; }
  /// How sure that is, one standard deviation.
  [[nodiscard]] double resistance_sigma() const { return std::sqrt(p_[resistance_at][resistance_at]); }
  /// What the model's pairs hold back at the moment, of a cell with the model's resistances.
  [[nodiscard]] std::array<double, CellDynamics::pairs> pair_V() const {
    return {x_[pair_at], x_[pair_at + 1], x_[pair_at + 2]};
  }
  /// By how much too much is counted: the sensor's gain, or a capacity that is larger than the model's.
  [[nodiscard]] double counting_share() const { return x_[counting_at]; }
  /// What the sensor adds to every current.
  [[nodiscard]] double offset_A() const { return x_[offset_at]; }
  [[nodiscard]] double hysteresis() const { return hysteresis_; }
  /// The last voltage less what the model expected before it was told, and what had to be expected of that, squared: of
  /// this one voltage, not of all that share its error.
  [[nodiscard]] double innovation_V() const { return innovation_V_; }
  [[nodiscard]] double innovation_variance_V2() const { return innovation_variance_V2_; }
  /// How far this cell is from being one of its model, 0 or more: from 1 on it is none. The farthest of three: what the
  /// counting and the resistances are off by, as a share of the most that is learned; and the voltages of the last
  /// minutes, in threes of standard deviations.
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

  /// The straight line that stands for the voltage over the states of charge that are possible, and what it is off by.
  struct Chord {
    double slope_V = 0.0;
    double bend_V = 0.0;
  };

  struct Current {
    double A = 0.0;
    double kinetic_A = 0.0;  // what the charge transfer makes of it
  };

  /// What a voltage may be off by itself, and what the model is for seconds, squared.
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
  /// Takes in a number that is `innovation` more than expected, has this variance of its own and changes `by` so much
  /// with each state; returns what had to be expected because of the states, squared.
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
  double true_current_A_ = 0.0;  // the mean of the last sample without what the sensor is thought to add
  double innovation_V_ = 0.0;
  double innovation_variance_V2_ = 0.0;
  bool are_pairs_unknown_ = false;  // until the first current
  double surprise_ = 0.0;           // squares of innovations against their variances, over some minutes
  [[nodiscard]] bool are_fields_possible() const;
  BMU_FIELDS(cell_, sensor_, capacity_As_, x_, p_, hysteresis_, temperature_C_, true_current_A_, innovation_V_,
             innovation_variance_V2_, are_pairs_unknown_, surprise_)
};

}  // namespace bmu

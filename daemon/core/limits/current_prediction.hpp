// Prediction of the maximum current of one cell until its voltage reaches a bound: the largest constant current, out of
// it or into it, with which the terminal voltage stays on the permitted side all through a horizon.
//
// The measured voltage is the reference, and the model only gives its change. With s = 1 out of the cell and -1 into
// it, i >= 0 the queried current, I0 the current that flowed as the voltage V0 was taken and j0 = s * I0, the margin
// that is left until the bound Vb is
//
//   margin(i) = s * (V0 - Vb)
//             + s * (OCV(z - s * i * T / Q) - OCV(z))                    the charge that will have flowed
//             - (1 + s * h) * (1 - exp(-i * T / (q0 * Q))) * H           the hysteresis on its way to the other curve
//             + (j0 - i) * R0 + f(j0) - f(i)                             the step from the present current to i
//             + sum min(0, (s * Uk - i * Rk) * (1 - exp(-T / tau_k)))    the contribution of the RC elements
//
// with f the charge transfer, K * I0 * asinh(I / I0), and T the horizon. It falls with i, so that the result is where
// it is 0. That is the bound by prediction over a horizon of G. L. Plett, Battery Management Systems, Vol. II, Artech
// House 2016, chapter 6, with the charge transfer and the hysteresis of CellDynamics in addition, and from a measured
// voltage: a wrong state of charge or a wrong curve then has little effect, and the deviation of this cell's
// resistances from its model's counts.
//
// Uncertain inputs are taken at their worst:
//   - the state of charge is the estimate, or two standard deviations from it towards the bound, whichever leaves less
//     margin; an unknown one is anything from empty to full;
//   - resistances are two standard deviations more where the voltage gets worse, and less where it recovers;
//   - an RC element may make the voltage worse, never better: it might do so late;
//   - an RC element of unknown voltage is as if the present current had always flowed, if it flows the other way, else
//     at rest;
//   - an unknown hysteresis has its whole way to go.
// The result is found by a bounded number of steps and is always a current that was tried and found permitted.
//
// Cost: three evaluations of the model for a cell, and for each query two if `at_most_A` is permitted, else at most 2 *
// (2 + prediction_steps_max). Pure and without allocation.
#pragma once

#include <array>

#include "daemon/core/cell/cell_dynamics.hpp"
#include "daemon/core/estimation/cell_forecast_input.hpp"
#include "daemon/core/types/memo.hpp"

namespace bmu {

/// Duration of a prediction, and the values that are the same for all cells queried for the same current.
class ForecastHorizon {
 public:
  /// A constant current for the whole horizon, its magnitude.
  struct Flow {
    double current_A = 0.0;
    double kinetic_A = 0.0;  // I0 * asinh(I / I0), for the charge transfer
    double charge_share = 0.0;
    double hysteresis_moved = 0.0;  // share of the way to the other curve
  };

  /// Unknown duration.
  ForecastHorizon() = default;
  ForecastHorizon(const CellDynamics& cell, double horizon_s);

  [[nodiscard]] double s() const { return s_; }
  /// Share to which each RC element settles within it, 0 to 1.
  [[nodiscard]] const std::array<double, CellDynamics::pairs>& settled() const { return settled_; }
  /// Precondition: `cell` is that of the constructor.
  [[nodiscard]] const Flow& flow(const CellDynamics& cell, double exchange_current_A, double current_A) const;

 private:
  struct Asked {
    double exchange_current_A = 0.0;
    double current_A = 0.0;
    friend bool operator==(const Asked&, const Asked&) = default;
  };

  double s_ = not_measured;  // above 0
  std::array<double, CellDynamics::pairs> settled_{};
  mutable Memo<Asked, Flow> flow_;
};

/// Query of a prediction.
struct ForecastBound {
  double voltage_V = not_measured;  // not to be passed
  ForecastHorizon horizon;
  double at_most_A = 0.0;  // upper bound of the result; 0 or more
};

/// Horizons of the peak limit and of the continuous limit. The longer one is as long as a hill: by then the RC elements
/// that settle within a minute have settled, and a current of 2 C has moved 3 % of the charge. It is not longer,
/// because the limits of later minutes cover the voltage in those minutes.
inline constexpr double forecast_peak_s = 10.0;
inline constexpr double forecast_continuous_s = 60.0;

inline constexpr int prediction_steps_max = 12;

/// The cell at its temperature; a default row for a temperature that is not measured, or a model without tables.
[[nodiscard]] CellDynamics::Row forecast_row(const CellDynamics& cell, const CellForecastInput& input);

class CellForecast {
 public:
  /// `row` is forecast_row(); both must outlive this.
  CellForecast(const CellDynamics& cell, const CellDynamics::Row& row, const CellForecastInput& input);

  /// Voltage, current and temperature were measured, and the model is valid. Else each result is 0, and not valid.
  [[nodiscard]] bool is_known() const { return is_known_; }

  /// Magnitudes. 0 where even without a current the voltage does not stay on the permitted side of its bound, and for
  /// an invalid bound.
  [[nodiscard]] double discharge_A(const ForecastBound& above) const { return most_A(above, 1.0); }
  [[nodiscard]] double charge_A(const ForecastBound& below) const { return most_A(below, -1.0); }

 private:
  /// The model at a possible state of charge.
  struct Start {
    double soc = 0.0;
    CellPoint point;
  };

  /// Values that are the same for every current that is tried.
  struct Question {
    double sign = 1.0;  // 1: out of the cell
    const ForecastHorizon& horizon;
    double present_V = 0.0;  // present margin
    const Start& doubted;
  };
  [[nodiscard]] Start start(double soc) const;
  [[nodiscard]] double most_A(const ForecastBound& bound, double sign) const;
  [[nodiscard]] double room_V(const Question& question, double current_A) const;
  [[nodiscard]] double change_V(const Question& question, const Start& start, const ForecastHorizon::Flow& flow) const;
  [[nodiscard]] double pairs_V(const Question& question, const CellPoint& from, const CellPoint& to,
                               double current_A) const;

  const CellDynamics* cell_;
  CellForecastInput input_;
  const CellDynamics::Row* row_;
  Start believed_;
  Start less_;  // less charge than estimated, by the uncertainty
  Start more_;
  double kinetic_now_A_ = 0.0;  // I0 * asinh(I / I0) of the present current
  double resistance_more_ = 1.0;
  double resistance_less_ = 1.0;
  bool is_known_ = false;
};

}  // namespace bmu

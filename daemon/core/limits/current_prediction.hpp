// How much current one cell bears from now on before its voltage reaches a bound: the largest constant current, out of
// it or into it, with which the terminal voltage stays on the good side all through a horizon.
//
// The measured voltage is the anchor, and the model only says by how much it will change. With s = 1 out of the cell
// and -1 into it, i >= 0 the current asked for, I0 the current that flowed as the voltage V0 was taken and j0 = s * I0,
// the room that is left until the bound Vb is
//
//   room(i) = s * (V0 - Vb)
//           + s * (OCV(z - s * i * T / Q) - OCV(z))                    the charge that will have flowed
//           - (1 + s * h) * (1 - exp(-i * T / (q0 * Q))) * H           the hysteresis on its way to the other curve
//           + (j0 - i) * R0 + f(j0) - f(i)                             the step from the present current to i
//           + sum min(0, (s * Uk - i * Rk) * (1 - exp(-T / tau_k)))    what the pairs add
//
// with f the charge transfer, K * I0 * asinh(I / I0), and T the horizon. It falls with i, so that the answer is where
// it is 0. That is the bound by prediction over a horizon of G. L. Plett, Battery Management Systems, Vol. II, Artech
// House 2016, chapter 6, with the charge transfer and the hysteresis of CellDynamics besides, and from a measured
// voltage: a wrong state of charge or a wrong curve then costs little, and what counts is how far this cell's
// resistances are from its model's.
//
// Whatever is not sure is taken the bad way:
//   - the state of charge is what is believed and two standard deviations towards the bound, whichever leaves less
//     room; one that nobody knows is anything from empty to full;
//   - resistances are two standard deviations more where the voltage gets worse, and less where it recovers;
//   - a pair may make the voltage worse, never better: it might do so late;
//   - a pair that nobody knows is as if the present current had always flowed, if it flows the other way, else at rest;
//   - a hysteresis that nobody knows has all its way to go.
// The answer is found by a bounded number of steps and is always one that was tried and found good.
//
// Cost: three looks at the model for a cell, and for each question two looks at it if `at_most_A` is allowed, else at
// most 2 * (2 + prediction_steps_max). Pure and without allocation.
#pragma once

#include <array>

#include "daemon/core/cell/cell_dynamics.hpp"
#include "daemon/core/estimation/cell_forecast_input.hpp"
#include "daemon/core/types/memo.hpp"

namespace bmu {

/// For how long, and what is the same for all cells that are asked for the same current.
class ForecastHorizon {
 public:
  /// A current for all that time, its magnitude.
  struct Flow {
    double current_A = 0.0;
    double kinetic_A = 0.0;  // what the charge transfer makes of it
    double charge_share = 0.0;
    double hysteresis_moved = 0.0;  // of the way to the other curve
  };

  /// Nobody has said how long.
  ForecastHorizon() = default;
  ForecastHorizon(const CellDynamics& cell, double horizon_s);

  [[nodiscard]] double s() const { return s_; }
  /// How far each pair settles within it, 0 to 1.
  [[nodiscard]] const std::array<double, CellDynamics::pairs>& settled() const { return settled_; }
  /// `cell` is that of the constructor.
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

/// What is asked.
struct ForecastBound {
  double voltage_V = not_measured;  // not to be passed
  ForecastHorizon horizon;
  double at_most_A = 0.0;  // the answer is never more; 0 or more
};

/// How long what is allowed for a moment, and what is allowed for long, must be bearable. The longer one is as long as
/// a hill: by then the pairs that settle within a minute have settled, and a current of 2 C has moved 3 % of the
/// charge. It is no longer, for what the voltage does in many minutes is told by the limit of those minutes.
inline constexpr double forecast_peak_s = 10.0;
inline constexpr double forecast_continuous_s = 60.0;

inline constexpr int prediction_steps_max = 12;

/// The cell at its temperature; of a temperature that is not measured, or a model that is none, nothing.
[[nodiscard]] CellDynamics::Row forecast_row(const CellDynamics& cell, const CellForecastInput& input);

class CellForecast {
 public:
  /// `row` is forecast_row(); both must outlive this.
  CellForecast(const CellDynamics& cell, const CellDynamics::Row& row, const CellForecastInput& input);

  /// Voltage, current and temperature were measured, and the model is one. Else each answer is 0, and means nothing.
  [[nodiscard]] bool is_known() const { return is_known_; }

  /// Magnitudes. 0 where even without a current the voltage does not stay on the good side of its bound, and for a
  /// bound that is none.
  [[nodiscard]] double discharge_A(const ForecastBound& above) const { return most_A(above, 1.0); }
  [[nodiscard]] double charge_A(const ForecastBound& below) const { return most_A(below, -1.0); }

 private:
  /// The model at a state of charge that is possible.
  struct Start {
    double soc = 0.0;
    CellPoint point;
  };

  /// What is the same for every current that is tried.
  struct Question {
    double sign = 1.0;  // 1: out of the cell
    const ForecastHorizon& horizon;
    double present_V = 0.0;  // the room that there is now
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
  Start less_;  // charge than is believed, by the doubt
  Start more_;
  double kinetic_now_A_ = 0.0;  // what the charge transfer makes of the present current
  double resistance_more_ = 1.0;
  double resistance_less_ = 1.0;
  bool is_known_ = false;
};

}  // namespace bmu

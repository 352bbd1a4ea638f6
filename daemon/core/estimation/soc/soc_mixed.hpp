// State of charge as small battery computers did it for years, and as this system's ancestor of 2013 did: counting
// where the open-circuit voltage says little, and where it says much the voltage, with what the current takes added
// back; and empty is where the voltage ends.
//
// High, where the curve is steep again, the compensated voltage pulls the count towards it, the more quickly the
// smaller the current is: what the resistance takes is known to a fifth or so. Low, a voltage that, compensated, is
// below that of an empty cell for five seconds sets it to empty. In between it is counting. It is here to be compared
// with, and for whom a Kalman filter is too much to believe.
//
// Cost: one look at the model.
#pragma once

#include "daemon/core/estimation/soc/model_memo.hpp"
#include "daemon/core/estimation/soc/model_pointer.hpp"
#include "daemon/core/estimation/soc/soc_coulomb.hpp"
#include "protocol/fields.hpp"

namespace bmu {

class SocMixed {
 public:
  /// `cell` must outlive the estimator.
  void begin(const CellDynamics& cell, const CurrentSensorError& sensor, const SocBegin& from, double temperature_C);
  /// The same tables, where they lie now. Before begin(): nothing.
  void move_to(const CellDynamics& cell) {
    cell_.move_to(cell);
    counting_.move_to(cell);
  }
  [[nodiscard]] bool is_begun() const { return cell_.is_set(); }
  /// `memo`: of the same model.
  void update(const CellSample& sample, ModelMemo& memo);
  void update(const CellSample& sample) {
    ModelMemo memo;
    update(sample, memo);
  }
  [[nodiscard]] SocEstimate estimate() const { return counting_.estimate(); }
  /// From now on it is this, and so sure: the end of a charge.
  void set(double soc, double sigma) { counting_.set(soc, sigma); }

 private:
  void listen(const CellSample& sample, const CellDynamics::Row& row);

  ModelPointer<CellDynamics> cell_;
  SocCoulomb counting_;
  double temperature_C_ = 25.0;
  double empty_s_ = 0.0;  // so long its voltage has been that of an empty cell
  [[nodiscard]] bool are_fields_possible() const { return counting_.is_begun() == is_begun(); }
  BMU_FIELDS(cell_, counting_, temperature_C_, empty_s_)
};

}  // namespace bmu

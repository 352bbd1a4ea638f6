// State of charge by the method of small battery computers, and of this system's predecessor of 2013: counting where
// the open-circuit voltage changes little, and where it changes much the voltage, compensated for the drop by the
// current; the cell is empty where the voltage ends.
//
// High, where the curve is steep again, the compensated voltage pulls the count towards it, the faster the smaller the
// current is: the resistive drop is known to a fifth or so. Low, a compensated voltage below that of an empty cell for
// five seconds sets it to empty. In between only the count is used. The method is a reference for comparisons, and an
// alternative for users who do not trust a Kalman filter.
//
// Cost: one evaluation of the model.
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
  /// Rebinds to the same tables at their new address. Before begin(): no effect.
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
  /// Sets the state of charge and its uncertainty: the end of a charge.
  void set(double soc, double sigma) { counting_.set(soc, sigma); }

 private:
  void listen(const CellSample& sample, const CellDynamics::Row& row);

  ModelPointer<CellDynamics> cell_;
  SocCoulomb counting_;
  double temperature_C_ = 25.0;
  double empty_s_ = 0.0;  // time for which its voltage has been that of an empty cell
  [[nodiscard]] bool are_fields_possible() const { return counting_.is_begun() == is_begun(); }
  BMU_FIELDS(cell_, counting_, temperature_C_, empty_s_)
};

}  // namespace bmu

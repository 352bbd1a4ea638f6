// State of charge by counting alone, with the losses that the counter does not measure: a part of a charging current is
// lost, and a cell discharges by itself.
//
//   SOC(t) = SOC(0) - 1/C * integral of (efficiency * I + loss) dt               (FS_4)
//
// The voltage is not used, so the uncertainty never decreases: the sensor's gain adds to it in proportion to the net
// charge, its offset in proportion to time, and, while the sensor is silent, the current that may flow.
//
// Cost: some ten multiplications and one exponential.
#pragma once

#include <cmath>

#include "daemon/core/cell/cell_dynamics.hpp"
#include "daemon/core/estimation/soc/model_pointer.hpp"
#include "daemon/core/estimation/soc/soc_estimate.hpp"
#include "protocol/fields.hpp"

namespace bmu {

class SocCoulomb {
 public:
  /// `cell` must outlive the estimator.
  void begin(const CellDynamics& cell, const CurrentSensorError& sensor, const SocBegin& from, double temperature_C);
  /// Rebinds to the same tables at their new address. Before begin(): no effect.
  void move_to(const CellDynamics& cell) { cell_.move_to(cell); }
  [[nodiscard]] bool is_begun() const { return cell_.is_set(); }
  void update(const CellSample& sample);
  [[nodiscard]] SocEstimate estimate() const;

  /// Sets the state of charge and its uncertainty: an anchor of another method.
  void set(double soc, double sigma);

 private:
  ModelPointer<CellDynamics> cell_;
  CurrentSensorError sensor_;
  double capacity_As_ = 1.0;
  double temperature_C_ = 25.0;
  double soc_ = 0.0;
  // Since soc_ was set:
  double begin_sigma_ = 1.0;
  double net_charge_As_ = 0.0;
  double passed_s_ = 0.0;
  double unseen_As_ = 0.0;  // charge that may have flowed uncounted
  [[nodiscard]] bool are_fields_possible() const {
    return capacity_As_ > 0.0 && capacity_As_ <= charge_most_As && is_within(soc_, 0.0, 1.0) && begin_sigma_ >= 0.0 &&
           !std::isnan(net_charge_As_) && passed_s_ >= 0.0 && unseen_As_ >= 0.0;
  }
  BMU_FIELDS(cell_, sensor_, capacity_As_, temperature_C_, soc_, begin_sigma_, net_charge_As_, passed_s_, unseen_As_)
};

}  // namespace bmu

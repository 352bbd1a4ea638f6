// State of charge by counting alone, with the losses that counting does not see: of a charging current not all arrives,
// and a cell discharges by itself.
//
//   SOC(t) = SOC(0) - 1/C * integral of (efficiency * I + loss) dt               (FS_4)
//
// It never looks at the voltage, so nothing takes its doubt away: by the sensor's gain it has some for the charge that
// flowed on balance, by its offset more with time, and, while the sensor is silent, as much as may flow.
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
  /// The same tables, where they lie now. Before begin(): nothing.
  void move_to(const CellDynamics& cell) { cell_.move_to(cell); }
  [[nodiscard]] bool is_begun() const { return cell_.is_set(); }
  void update(const CellSample& sample);
  [[nodiscard]] SocEstimate estimate() const;

  /// From now on it is this, and so sure: an anchor of another method.
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
  double unseen_As_ = 0.0;  // what may have flowed while nobody counted
  [[nodiscard]] bool are_fields_possible() const {
    return capacity_As_ > 0.0 && capacity_As_ <= charge_most_As && is_within(soc_, 0.0, 1.0) && begin_sigma_ >= 0.0 &&
           !std::isnan(net_charge_As_) && passed_s_ >= 0.0 && unseen_As_ >= 0.0;
  }
  BMU_FIELDS(cell_, sensor_, capacity_As_, temperature_C_, soc_, begin_sigma_, net_charge_As_, passed_s_, unseen_As_)
};

}  // namespace bmu

#include "daemon/core/estimation/soc/soc_coulomb.hpp"

#include <algorithm>
#include <cmath>

namespace bmu {

namespace {

constexpr double sigma_max = 1.0;  // bound of the uncertainty

}  // namespace

void SocCoulomb::begin(const CellDynamics& cell, const CurrentSensorError& sensor, const SocBegin& from,
                       double temperature_C) {
  *this = {};
  cell_.set(cell);
  sensor_ = sensor;
  capacity_As_ = from.capacity_or(cell.capacity_As);
  if (is_measured(temperature_C)) temperature_C_ = temperature_C;
  set(from.soc, from.sigma);
}

void SocCoulomb::set(double soc, double sigma) {
  soc_ = std::clamp(soc, 0.0, 1.0);
  begin_sigma_ = sigma;
  net_charge_As_ = 0.0;
  passed_s_ = 0.0;
  unseen_As_ = 0.0;
}

void SocCoulomb::update(const CellSample& sample) {
  if (!cell_.is_set() || !sample.has_passed()) return;
  if (is_measured(sample.temperature_C)) temperature_C_ = sample.temperature_C;
  double current_A = self_discharge_A(*cell_, temperature_C_);
  passed_s_ += sample.passed_s;
  if (is_measured(sample.mean_current_A)) {
    const double told_A = sample.mean_current_A;
    current_A += told_A < 0.0 ? told_A * cell_->charge_efficiency : told_A;
    net_charge_As_ += told_A * sample.passed_s;
  }
  unseen_As_ += sensor_.unseen_A(sample) * sample.passed_s;
  soc_ = std::clamp(soc_ - current_A * sample.passed_s / capacity_As_, 0.0, 1.0);
}

SocEstimate SocCoulomb::estimate() const {
  if (!cell_.is_set()) return {};
  const double by_gain_As = sensor_.gain * net_charge_As_;
  const double by_offset_As = sensor_.offset_A * passed_s_;
  const double counted = root_sum_square(by_gain_As, by_offset_As, unseen_As_) / capacity_As_;
  return {.is_known = true, .soc = soc_, .sigma = std::min(root_sum_square(begin_sigma_, counted), sigma_max)};
}

}  // namespace bmu

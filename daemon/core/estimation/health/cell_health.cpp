#include "daemon/core/estimation/health/cell_health.hpp"

#include <algorithm>
#include <cmath>

namespace bmu {

namespace {

constexpr double ppm = 1e6;
/// Minimum error that all samples share: that of the current sensor's gain.
constexpr double common_share_least = 0.01;

std::int32_t in_ppm(double share) {
  constexpr double most = 2e9;
  return static_cast<std::int32_t>(std::llround(std::clamp(share * ppm, 0.0, most)));
}

/// At 25 C.
ResistanceEstimate at_reference(const ResistanceTracker& tracker) {
  return tracker.estimate(resistance_reference_C);
}

}  // namespace

void CellHealth::begin(const HealthModel& model, const CellHealthRecord& former) {
  *this = {};
  model_.set(model);
  resistance_.begin(model.expected);
  const double expected_Ohm = model.expected.at_reference_Ohm();
  resistance_.restore(former.resistance_ppm / ppm * expected_Ohm, former.resistance_sigma_ppm / ppm * expected_Ohm);
  const CapacityPrior none{.capacity_As = model.rated_As,
                           .rated_As = model.rated_As,
                           .common_share = std::max(model.sensor.gain, common_share_least)};
  const bool is_former = former.capacity_ppm > 0 && former.capacity_sigma_ppm > 0;
  if (is_former) {
    CapacityPrior prior = none;
    prior.capacity_As = former.capacity_ppm / ppm * model.rated_As;
    prior.sigma_share = static_cast<double>(former.capacity_sigma_ppm) / former.capacity_ppm;
    capacity_.begin(prior);
  }
  is_capacity_restored_ = is_former && capacity_.is_known();
  if (!is_capacity_restored_) capacity_.begin(none);
  capacity_As_ = is_capacity_restored_ ? capacity_.capacity_As() : model.rated_As;
  if (model.plateau) plateau_.begin(*model.plateau);
}

void CellHealth::move_to(const HealthModel& model) {
  model_.move_to(model);
  resistance_.move_to(model.expected);
}

void CellHealth::learn(const CapacityPair& pair) {
  if (capacity_.take(pair)) capacity_As_ = capacity_.capacity_As();
}

void CellHealth::take(const CellSample& sample, const std::optional<ChargeAnchor>& anchor) {
  if (!model_.is_set()) return;
  resistance_.update(sample);
  if (!sample.has_passed()) return;
  passed_s_ += sample.passed_s;
  const bool is_counted = is_measured(sample.mean_current_A);
  if (is_counted) {
    const double arrives = sample.mean_current_A < 0.0 ? model_->charge_efficiency : 1.0;
    counted_As_ += arrives * sample.mean_current_A * sample.passed_s;
    capacity_.pass(sample.passed_s, std::abs(sample.mean_current_A) * sample.passed_s);
  } else {
    anchors_.forget();
  }
  if (model_->plateau) {
    const std::optional<PlateauCharge> shown = plateau_.take(sample);
    if (shown) learn(capacity_pair(*model_->plateau, *shown, model_->sensor));
  }
  if (!anchor) return;
  const std::optional<CapacityPair> pair =
      anchors_.take({.soc = anchor->soc, .sigma = anchor->sigma, .counted_As = counted_As_, .at_s = passed_s_},
                    model_->sensor, capacity_As_);
  if (pair) learn(*pair);
}

StateOfHealth CellHealth::health() const {
  if (!model_.is_set()) return {};
  StateOfHealth health;
  if (is_capacity_known()) {
    health.by_capacity = health_by_capacity(capacity_As_, capacity_sigma_As(), model_->rated_As);
  }
  const ResistanceEstimate known = at_reference(resistance_);
  const double expected_Ohm = model_->expected.at_reference_Ohm();
  if (known.is_known) {
    health.by_resistance =
        health_by_resistance(known.resistance_Ohm / expected_Ohm - 1.0, known.sigma_Ohm / expected_Ohm);
  }
  return health;
}

CellHealthRecord CellHealth::record() const {
  if (!model_.is_set()) return {};
  CellHealthRecord record;
  if (is_capacity_known()) {
    record.capacity_ppm = in_ppm(capacity_As_ / model_->rated_As);
    record.capacity_sigma_ppm = in_ppm(capacity_.learned_sigma_As() / model_->rated_As);
  }
  const ResistanceEstimate known = at_reference(resistance_);
  const double expected_Ohm = model_->expected.at_reference_Ohm();
  if (known.is_known) {
    record.resistance_ppm = in_ppm(known.resistance_Ohm / expected_Ohm);
    record.resistance_sigma_ppm = in_ppm(resistance_.learned_sigma_Ohm() / expected_Ohm);
  }
  return record;
}

}  // namespace bmu

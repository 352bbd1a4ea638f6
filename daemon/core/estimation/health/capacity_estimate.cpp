#include "daemon/core/estimation/health/capacity_estimate.hpp"

#include <algorithm>
#include <cmath>

namespace bmu {

namespace {

/// A sample that differs from the estimate by more standard deviations of both than this contradicts it.
constexpr double surprise_sigmas = 2.5;

constexpr double square(double value) {
  return value * value;
}

/// Minimum of the parabola through three values at -1, 0 and 1, and their second difference; the middle value is the
/// smallest.
struct Parabola {
  double at = 0.0;
  double bend = 0.0;
};
Parabola parabola(double before, double here, double after) {
  const double bend = before - 2.0 * here + after;
  return {.at = bend > 0.0 ? 0.5 * (before - after) / bend : 0.0, .bend = bend};
}

/// Variance of the difference between a sample's charge and that which this capacity would have taken.
double variance_of(const CapacityPair& pair, double capacity_As) {
  return square(pair.charge_sigma_As) + square(capacity_As * pair.soc_change_sigma);
}

constexpr double share_step =
    (CapacityEstimate::most_share - CapacityEstimate::least_share) / (CapacityEstimate::points - 1);

/// Minimum error of a counted charge: it is transferred in whole numbers at some point.
constexpr double counted_sigma_min_As = 1.0;

constexpr double year_s = 31'557'600.0;

bool is_between(double value, double least, double most) {
  return value >= least && value <= most;  // false for not-a-number
}

}  // namespace

double CapacityEstimate::at_As(std::size_t point) const {
  return rated_As_ * (least_share + share_step * static_cast<double>(point));
}

void CapacityEstimate::begin(const CapacityPrior& prior) {
  *this = {};
  const bool is_rated = prior.rated_As > 0.0 && std::isfinite(prior.rated_As);
  if (!is_rated || !is_between(prior.capacity_As / prior.rated_As, least_share, most_share)) return;
  if (!(prior.sigma_share > 0.0) || !(prior.common_share >= 0.0)) return;
  if (!(prior.loss_share_per_cycle >= 0.0) || !(prior.loss_share_per_year >= 0.0)) return;
  rated_As_ = prior.rated_As;
  common_share_ = prior.common_share;
  loss_share_per_cycle_ = prior.loss_share_per_cycle;
  loss_share_per_year_ = prior.loss_share_per_year;
  add({.charge_As = prior.capacity_As,
       .charge_sigma_As = prior.sigma_share * prior.capacity_As,
       .soc_change = 1.0,
       .soc_change_sigma = 0.0});
}

bool CapacityEstimate::is_sane(const CapacityPair& pair) const {
  const bool has_errors = pair.charge_sigma_As > 0.0 && is_measured(pair.charge_sigma_As) &&
                          pair.soc_change_sigma >= 0.0 && is_measured(pair.soc_change_sigma);
  return has_errors && is_between(std::abs(pair.soc_change), pair_apart_min, 1.0) &&
         is_between(pair.charge_As / pair.soc_change, least_share * rated_As_, most_share * rated_As_);
}

void CapacityEstimate::add(const CapacityPair& pair) {
  for (std::size_t point = 0; point < points; ++point) {
    const double capacity_As = at_As(point);
    costs_[point] += square(pair.charge_As - capacity_As * pair.soc_change) / variance_of(pair, capacity_As);
  }
}

void CapacityEstimate::relax(double variance_factor) {
  for (double& cost : costs_) cost /= variance_factor;
}

/// Adds the possible loss since the last sample to the variance of the estimate.
void CapacityEstimate::forget() {
  relax(1.0 + square(aged_share_ * rated_As_) / seen_variance());
  aged_share_ = 0.0;
}

/// 1 unless the sample contradicts the estimate: then the ratio of the deviation to the maximum that the uncertainty of
/// both together permits.
double CapacityEstimate::doubt_of(const CapacityPair& pair) const {
  const double capacity_As = this->capacity_As();
  const double expected = variance_of(pair, capacity_As) + square(pair.soc_change) * seen_variance();
  const double off_As = std::abs(pair.charge_As - capacity_As * pair.soc_change);
  return std::max(off_As / (surprise_sigmas * std::sqrt(expected)), 1.0);
}

bool CapacityEstimate::take(const CapacityPair& pair) {
  if (!is_known()) return false;
  if (!is_sane(pair)) {
    ++refused_;
    return false;
  }
  forget();
  const double doubt = doubt_of(pair);
  relax(doubt);
  CapacityPair believed = pair;
  believed.charge_sigma_As *= doubt;
  believed.soc_change_sigma *= doubt;
  add(believed);
  ++pairs_;
  return true;
}

void CapacityEstimate::pass(double passed_s, double moved_As) {
  if (!is_known()) return;
  const double years = passed_s > 0.0 && passed_s < passed_most_s ? passed_s / year_s : 0.0;
  const double cycles = moved_As > 0.0 && std::isfinite(moved_As) ? moved_As / (2.0 * rated_As_) : 0.0;
  aged_share_ = std::min(aged_share_ + loss_share_per_year_ * years + loss_share_per_cycle_ * cycles, 1.0);
}

/// Minimum of the inner points, so that there is one on either side.
std::size_t CapacityEstimate::least() const {
  const auto* const found = std::min_element(costs_.begin() + 1, costs_.end() - 1);
  return static_cast<std::size_t>(found - costs_.begin());
}

double CapacityEstimate::capacity_As() const {
  if (!is_known()) return 0.0;
  const std::size_t point = least();
  const Parabola low = parabola(costs_[point - 1], costs_[point], costs_[point + 1]);
  // Where J falls towards a bound of the grid the minimum of the parabola would be beyond it.
  return at_As(point) + rated_As_ * share_step * std::clamp(low.at, -1.0, 1.0);
}

/// J is twice the negative logarithm of the likelihood. Its curvature at the minimum gives the variance of a narrow
/// one, the spread of the likelihood over all points that of one that is wide or has several maxima.
double CapacityEstimate::seen_variance() const {
  const std::size_t point = least();
  const double capacity_As = this->capacity_As();
  const double step_As = rated_As_ * share_step;
  const Parabola low = parabola(costs_[point - 1], costs_[point], costs_[point + 1]);
  const double narrow = low.bend > 0.0 ? 2.0 * square(step_As) / low.bend : 0.0;
  double weights = 0.0;
  double spread = 0.0;
  for (std::size_t k = 0; k < points; ++k) {
    const double weight = std::exp(0.5 * (costs_[point] - costs_[k]));
    weights += weight;
    spread += weight * square(at_As(k) - capacity_As);
  }
  const bool is_narrow = narrow > 0.0 && spread / weights < square(step_As);
  return is_narrow ? narrow : std::max(narrow, spread / weights);
}

double CapacityEstimate::sigma_As() const {
  if (!is_known()) return 0.0;
  return std::hypot(learned_sigma_As(), common_share_ * capacity_As());
}

double CapacityEstimate::learned_sigma_As() const {
  if (!is_known()) return 0.0;
  return std::sqrt(seen_variance() + square(aged_share_ * rated_As_));
}

std::optional<CapacityPair> CapacityAnchors::take(const CapacityAnchor& anchor, const CurrentSensorError& sensor,
                                                  double capacity_As) {
  const bool is_sane = is_between(anchor.soc, 0.0, 1.0) && anchor.sigma > 0.0 && anchor.sigma < 1.0 &&
                       std::isfinite(anchor.counted_As) && std::isfinite(anchor.at_s) && sensor.offset_A >= 0.0 &&
                       capacity_As > 0.0;
  if (!is_sane) return std::nullopt;
  const CapacityAnchor before = waiting_;
  const double passed_s = anchor.at_s - before.at_s;
  if (!(passed_s > 0.0)) {  // also false if there was none
    waiting_ = anchor;
    return std::nullopt;
  }
  const double miscounted_As = std::hypot(sensor.offset_A * passed_s, counted_sigma_min_As);
  if (std::abs(before.soc - anchor.soc) < anchors_apart_min) {
    if (anchor.sigma <= std::hypot(before.sigma, miscounted_As / capacity_As)) waiting_ = anchor;
    return std::nullopt;
  }
  waiting_ = anchor;
  return CapacityPair{.charge_As = anchor.counted_As - before.counted_As,
                      .charge_sigma_As = miscounted_As,
                      .soc_change = before.soc - anchor.soc,
                      .soc_change_sigma = std::hypot(before.sigma, anchor.sigma)};
}

}  // namespace bmu

#include "daemon/core/estimation/health/resistance_tracker.hpp"

#include <algorithm>
#include <cmath>

namespace bmu {

namespace {

constexpr double square(double value) {
  return value * value;
}

/// Two samples of the slowest polling, and half of one more.
constexpr double gap_most_s = 2.5;
/// Time for which the small steps after a large one count with the uncertainty of that one.
constexpr double strength_time_s = 30.0;
constexpr double swing_least_share = 0.05;  // share of 1C
/// Uncertainty of the resistance by one step, one standard deviation.
constexpr double step_share = 0.06;
constexpr double voltage_noise_V = 0.002;
/// Drift of a resistance in an hour, and its maximum, one standard deviation: it changes by that much over the charge
/// of a cell, except near empty.
constexpr double wander_share_per_hour = 0.10;
constexpr double wander_share_most = 0.15;
/// As accurate as by three steps.
constexpr double known_share = 0.04;
/// Error that no number of steps averages out: drive cycles contain another mixture of fast and slow than single steps
/// do. In the cold it is larger, by the increase of the resistance, which depends on the current there.
constexpr double method_share = 0.04;
/// Relative error of the model's conversion over a difference in temperature.
constexpr double weather_share = 0.20;
constexpr double surprise_sigmas = 3.0;
/// A ratio to the model above this, or below its inverse, is a loose bolt or an error, not a cell.
constexpr double absurd_factor = 20.0;
/// No voltage moves by this between two samples without a current now or just before.
constexpr double jump_V = 0.1;

}  // namespace

void ResistanceTracker::begin(const ExpectedResistance& expected) {
  *this = {};
  expected_.set(expected);
  resistance_Ohm_ = expected.at_reference_Ohm();
  variance_Ohm2_ = square(resistance_Ohm_);
}

void ResistanceTracker::restore(double resistance_Ohm, double learned_sigma_Ohm) {
  if (!expected_.is_set() || !(resistance_Ohm > 0.0) || !(learned_sigma_Ohm > 0.0)) return;
  if (!is_measured(resistance_Ohm) || !is_measured(learned_sigma_Ohm)) return;
  const double share = resistance_Ohm / expected_->at_reference_Ohm();
  if (share > absurd_factor || share < 1.0 / absurd_factor) return;
  resistance_Ohm_ = resistance_Ohm;
  variance_Ohm2_ = square(std::min(learned_sigma_Ohm, wander_share_most * resistance_Ohm));
  is_known_ = true;
}

void ResistanceTracker::update(const CellSample& sample) {
  if (!expected_.is_set()) return;
  if (!sample.has_passed()) return restart();
  age(sample.passed_s);
  since_s_ += sample.passed_s;
  if (!is_measured(sample.current_A) || !is_measured(sample.voltage_V)) return;
  if (!is_running_ || since_s_ > gap_most_s) return begin_with(sample);
  const double kept = std::exp(-since_s_ / resistance_pass_time_s);
  const double step_A = sample.current_A - current_A_;
  const double step_V = sample.voltage_V - voltage_V_;
  const double factor = expected_->factor(sample.temperature_C);
  const double known_factor = is_measured(factor) ? factor : learned_factor_;
  const double most_Ohm = absurd_factor * expected_->at_reference_Ohm() * known_factor;
  const double explained_V = most_Ohm * (std::abs(step_A) + std::abs(swing_A_));
  if (std::abs(step_V) > explained_V + jump_V) return begin_with(sample);
  swing_A_ = swing_A_ * kept + step_A;
  swing_V_ = swing_V_ * kept + step_V;
  strength_A2_ = std::max(square(swing_A_), strength_A2_ * (1.0 - since_s_ / strength_time_s));
  current_A_ = sample.current_A;
  voltage_V_ = sample.voltage_V;
  since_s_ = 0.0;
  if (is_measured(factor)) learn(factor, square(kept));
}

void ResistanceTracker::begin_with(const CellSample& sample) {
  is_running_ = true;
  since_s_ = 0.0;
  current_A_ = sample.current_A;
  voltage_V_ = sample.voltage_V;
  swing_A_ = 0.0;
  swing_V_ = 0.0;
  strength_A2_ = 0.0;
}

/// Increases the uncertainty with time, up to the maximum change of a cell's resistance. Before the resistance is known
/// it has no effect.
void ResistanceTracker::age(double passed_s) {
  constexpr double hour_s = 3600.0;
  if (!is_known_) return;
  variance_Ohm2_ += square(wander_share_per_hour * resistance_Ohm_) * passed_s / hour_s;
  variance_Ohm2_ = std::min(variance_Ohm2_, square(wander_share_most * resistance_Ohm_));
}

/// Each sample of a step counts for the part of it that decays until the next, 1 - kept: so all samples of a step
/// together count as one step, however many they are.
void ResistanceTracker::learn(double factor, double kept_share) {
  if (std::abs(swing_A_) < swing_least_share * expected_->hour_current_A()) return;
  const double swing_A = swing_A_ * factor;  // current with the same effect at 25 C
  const double doubt_V2 = square(voltage_noise_V) + square(step_share * resistance_Ohm_ * factor) * strength_A2_;
  const double variance_V2 = square(swing_A) * variance_Ohm2_ + doubt_V2 / (1.0 - kept_share);
  const double most_V = surprise_sigmas * std::sqrt(variance_V2);
  const double error_V = -swing_V_ - resistance_Ohm_ * swing_A;
  const double believed_V = is_known_ ? std::clamp(error_V, -most_V, most_V) : error_V;
  const double gain = swing_A * variance_Ohm2_ / variance_V2;
  const double learned_share = gain * swing_A;
  const double least_Ohm = expected_->at_reference_Ohm() / absurd_factor;
  resistance_Ohm_ = std::max(resistance_Ohm_ + gain * believed_V, least_Ohm);
  variance_Ohm2_ *= 1.0 - learned_share;
  learned_factor_ += (factor - learned_factor_) * learned_share;
  is_known_ = is_known_ || variance_Ohm2_ <= square(known_share * resistance_Ohm_);
}

ResistanceEstimate ResistanceTracker::estimate(double temperature_C) const {
  if (!is_known_) return {};
  const double factor = expected_->factor(temperature_C);
  if (!is_measured(factor)) return {};
  const double away = std::max(factor, learned_factor_) / std::min(factor, learned_factor_) - 1.0;
  const double share_2 = square(method_share * std::max(factor, 1.0)) + square(weather_share * away);
  const double sigma_Ohm = std::sqrt(variance_Ohm2_ + share_2 * square(resistance_Ohm_));
  return {true, resistance_Ohm_ * factor, sigma_Ohm * factor};
}

}  // namespace bmu

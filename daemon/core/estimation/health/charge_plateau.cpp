#include "daemon/core/estimation/health/charge_plateau.hpp"

#include <algorithm>
#include <cmath>

namespace bmu {

namespace {

constexpr double block_s = 30.0;
/// Width of a bin: the curve is evaluated where the voltage passes multiples of it; ten of them are the width of the
/// flattest stretch.
constexpr double rung_V = 0.005;
/// Minimum number of bins reached below the flattest stretch; with fewer the plateau may have begun earlier.
constexpr std::size_t rungs_before = 2;
/// A voltage that steps by more between two blocks does not follow the charge.
constexpr double step_max_V = 0.2;

}  // namespace

CapacityPair capacity_pair(const ChargePlateauModel& model, const PlateauCharge& charge,
                           const CurrentSensorError& sensor) {
  return {.charge_As = model.above_weight * charge.above_As + model.plateau_weight * charge.plateau_As,
          .charge_sigma_As = std::hypot(model.sigma_As, sensor.offset_A * charge.lasted_s),
          .soc_change = 1.0,
          .soc_change_sigma = 0.0};
}

void ChargePlateau::begin(const ChargePlateauModel& model) {
  *this = {};
  model_ = model;
}

void ChargePlateau::give_up() {
  begin(ChargePlateauModel(model_));
}

bool ChargePlateau::may_charge(const CellSample& sample) const {
  return sample.passed_s <= plateau_gap_max_s && is_measured(sample.mean_current_A) && sample.mean_current_A < 0.0 &&
         sample.temperature_C >= model_.temperature_min_C && sample.temperature_C <= model_.temperature_max_C;
}

std::optional<PlateauCharge> ChargePlateau::take(const CellSample& sample) {
  if (!sample.has_passed()) return std::nullopt;
  if (!may_charge(sample)) {
    give_up();
    return std::nullopt;
  }
  block_.lasted_s += sample.passed_s;
  block_.charge_As -= sample.mean_current_A * sample.passed_s;
  if (is_measured(sample.voltage_V)) {
    block_.weighted_V += sample.voltage_V * sample.passed_s;
    block_.voltage_s += sample.passed_s;
  }
  if (block_.lasted_s < block_s || block_.voltage_s <= 0.0) return std::nullopt;
  const Block block = block_;
  block_ = {};
  const Point middle{.counted_As = counted_As_ + 0.5 * block.charge_As,
                     .voltage_V = block.weighted_V / block.voltage_s,
                     .current_A = block.charge_As / block.lasted_s};
  counted_As_ += block.charge_As;
  lasted_s_ += block.lasted_s;
  return take(middle, block.lasted_s);
}

/// True if the current is still that of the first block.
bool ChargePlateau::goes_on(const Point& point) const {
  return std::abs(point.current_A - first_current_A_) <= steady_current_share * first_current_A_;
}

std::optional<PlateauCharge> ChargePlateau::take(const Point& point, double lasted_s) {
  if (phase_ == Phase::held) return taper(point);
  if (phase_ == Phase::steady && goes_on(point)) {
    if (steady_s_ >= plateau_settle_s) climb(point);
    if (phase_ == Phase::waiting) return std::nullopt;  // aborted
    steady_s_ += lasted_s;
    before_ = point;
    return std::nullopt;
  }
  const bool is_held = point.voltage_V >= model_.full_voltage_V - held_within_V;
  if (phase_ == Phase::steady && is_held && point.current_A < first_current_A_ && end_As_) {
    phase_ = Phase::held;
    return taper(point);
  }
  give_up();
  begin_steady(point, lasted_s);
  return std::nullopt;
}

/// Starts the phase of constant current if the model is for this current. It counts from here: only differences are
/// used.
void ChargePlateau::begin_steady(const Point& point, double lasted_s) {
  if (std::abs(point.current_A - model_.current_A) > plateau_current_share * model_.current_A) return;
  phase_ = Phase::steady;
  first_current_A_ = point.current_A;
  steady_s_ = lasted_s;
  lasted_s_ = lasted_s;
}

/// Advances from the previous point to this one, over all bins that the voltage has not reached yet.
void ChargePlateau::climb(const Point& to) {
  if (!has_begun_climbing_) {
    has_begun_climbing_ = true;
    next_rung_ = std::floor(to.voltage_V / rung_V) + 1.0;
    return;
  }
  const double rise_V = to.voltage_V - before_.voltage_V;
  if (!(std::abs(rise_V) <= step_max_V)) return give_up();
  for (; next_rung_ * rung_V <= to.voltage_V; next_rung_ += 1.0) {
    const double share = (next_rung_ * rung_V - before_.voltage_V) / rise_V;
    reach(before_.counted_As + share * (to.counted_As - before_.counted_As));
  }
}

void ChargePlateau::reach(double counted_As) {
  const std::size_t from = (rungs_ + 1) % reached_As_.size();  // ten bins ago
  reached_As_[rungs_ % reached_As_.size()] = counted_As;
  ++rungs_;
  if (rungs_ > rungs_in_width) compare(counted_As - reached_As_[from], 0.5 * (counted_As + reached_As_[from]));
}

void ChargePlateau::compare(double width_As, double middle_As) {
  const double enough_As = plateau_end_share * flattest_As_;
  if (width_As > flattest_As_) {
    flattest_As_ = width_As;
    flattest_at_ = rungs_;
    end_As_.reset();
  } else if (!end_As_ && width_As < enough_As) {
    const double share = (width_before_As_ - enough_As) / (width_before_As_ - width_As);
    end_As_ = middle_before_As_ + share * (middle_As - middle_before_As_);
  }
  width_before_As_ = width_As;
  middle_before_As_ = middle_As;
}

std::optional<PlateauCharge> ChargePlateau::taper(const Point& point) {
  const Point before = before_;
  before_ = point;
  if (point.voltage_V < model_.full_voltage_V - held_within_V) {
    give_up();
    return std::nullopt;
  }
  if (point.current_A >= model_.end_current_A) return std::nullopt;
  const double share = (before.current_A - model_.end_current_A) / (before.current_A - point.current_A);
  const double full_As = before.counted_As + share * (point.counted_As - before.counted_As);
  const PlateauCharge shown{
      .plateau_As = flattest_As_, .above_As = full_As - end_As_.value_or(full_As), .lasted_s = lasted_s_};
  const bool has_seen_it_begin = flattest_at_ > rungs_in_width + rungs_before;
  give_up();
  if (!has_seen_it_begin) return std::nullopt;
  return shown;
}

}  // namespace bmu

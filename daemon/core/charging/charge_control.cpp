#include "daemon/core/charging/charge_control.hpp"

#include <algorithm>

namespace bmu {

namespace {

/// Shares of the current that would bring the cell to its full voltage at once, per second.
constexpr std::int64_t rise_permille_per_s = 200;
constexpr std::int64_t fall_permille_per_s = 1'000;
/// Samples that are further apart than this do not belong to one movement.
constexpr Duration sample_gap_max = 1s;
/// Lower bound of the cell's resistance, also for an unknown one: it bounds the rate of the current.
constexpr std::int64_t resistance_min_uOhm = 100;

}  // namespace

std::string_view to_text(ChargeStage stage) {
  switch (stage) {
    case ChargeStage::off: return "off";
    case ChargeStage::waiting: return "waiting";
    case ChargeStage::charging: return "charging";
    case ChargeStage::balancing: return "balancing";
    case ChargeStage::full: return "full";
  }
  return "?";
}

void ChargeControl::init(const CoreConfig& config) {
  config_ = config.charger;
  idle_max_ = idle_max + config.balancing.settle;
  cell_resistance_uOhm_ = std::max(cell_resistance_uOhm(config), resistance_min_uOhm);
  voltage_mV_ = config_.voltage_max_mV;
}

void ChargeControl::enter(ChargeStage stage, TimePoint now) {
  if (stage == stage_) return;
  if (stage_ == ChargeStage::balancing) balanced_ += now - since_;
  if (stage == ChargeStage::off) {
    is_full_ = is_in_vain_ = false;
    balanced_ = {};
  }
  if (stage == ChargeStage::full) is_full_ = true;
  if (stage != ChargeStage::charging) is_held_ = false;
  stage_ = stage;
  since_ = now;
  held_since_ = {};
  little_since_ = {};
  idle_since_ = {};
  rested_uV_ = 0;
  has_bled_ = false;
}

void ChargeControl::step(const ChargeInputs& in) {
  if (stepped_at_ == TimePoint{}) stepped_at_ = in.now;  // the first tick has no time before it
  enter(next_stage(in), in.now);
  const bool knows_cells = in.pack->cell_voltage_uV.is_complete();
  if (!is_enabled() || !knows_cells) {
    current_mA_ = 0;
    stepped_at_ = in.now;
    return;
  }
  hold(*in.pack);
  std::int32_t wanted_mA = std::min(in.limits->charge.limit_mA, in.limits->charge_continuous.limit_mA);
  wanted_mA = std::min(wanted_mA, config_.current_max_mA);
  if (is_held_) wanted_mA = std::min(wanted_mA, held_mA_);
  current_mA_ = ramped(std::max(wanted_mA, 0), in.now);
  stepped_at_ = in.now;
}

ChargeStage ChargeControl::next_stage(const ChargeInputs& in) {
  if (!in.is_wanted) return ChargeStage::off;
  const bool has_fallen = in.soc_permille && *in.soc_permille < config_.resume_below_permille;
  if (is_full_ && has_fallen) is_full_ = is_in_vain_ = false;
  if (is_full_) return ChargeStage::full;
  if (!in.is_connected || !in.may_charge || !in.is_talking) return ChargeStage::waiting;
  if (stage_ == ChargeStage::balancing) return after_balancing(in);
  if (stage_ != ChargeStage::charging) return ChargeStage::charging;
  if (!has_reached_top(in)) return ChargeStage::charging;
  const Spread& cells = in.pack->cell_voltage_uV;
  const bool differ = cells.max - cells.min > config_.balance_window_uV;
  const bool pauses = differ && in.has_to_balance && !is_in_vain_ && balanced_ < balancing_max;
  return pauses ? ChargeStage::balancing : ChargeStage::full;
}

/// Continues when the highest cell has fallen far enough to accept charge again, or when nothing is bled any more and
/// it is below the top: bled within the window or relaxed, all cells can accept charge. Ends the charge if it is at the
/// top.
ChargeStage ChargeControl::after_balancing(const ChargeInputs& in) {
  const Spread& cells = in.pack->cell_voltage_uV;
  has_bled_ = has_bled_ || in.is_bleeding;
  if (in.is_bleeding) idle_since_ = {};
  if (!in.is_bleeding && idle_since_ == TimePoint{}) idle_since_ = in.now;
  const bool is_idle = idle_since_ != TimePoint{} && in.now - idle_since_ >= idle_max_;
  const bool takes_too_long = balanced_ + (in.now - since_) >= balancing_max;
  if (takes_too_long) return ChargeStage::full;
  if (!cells.is_complete()) return ChargeStage::balancing;
  if (rested_uV_ == 0 && in.now - since_ >= rest_for) rested_uV_ = cells.max;
  const bool has_room = cells.max < config_.cell_full_uV - top_band_uV;
  const bool has_come_down = has_bled_ && rested_uV_ != 0 && cells.max <= rested_uV_ - config_.resume_uV;
  if (has_room && has_come_down) return ChargeStage::charging;
  if (!is_idle) return ChargeStage::balancing;
  is_in_vain_ = !has_bled_;
  return has_room ? ChargeStage::charging : ChargeStage::full;
}

bool ChargeControl::has_reached_top(const ChargeInputs& in) {
  const Spread& cells = in.pack->cell_voltage_uV;
  const bool is_at_top = cells.is_complete() && cells.max >= config_.cell_full_uV - top_band_uV;
  const Measured<std::int32_t>& sensed = in.pack->current_mA;
  const std::int64_t into_mA = sensed.is_valid() ? -std::int64_t{sensed.value} : current_mA_;
  const std::int64_t flows_mA = std::min<std::int64_t>(current_mA_, into_mA);
  const bool is_little = is_held_ && flows_mA <= config_.end_current_mA;
  if (!is_held_) held_since_ = {};
  if (is_held_ && held_since_ == TimePoint{}) held_since_ = in.now;
  if (is_held_ && in.now - held_since_ >= hold_max) return true;
  if (!is_at_top || !is_little) {
    little_since_ = {};
    return false;
  }
  if (little_since_ == TimePoint{}) little_since_ = in.now;
  return in.now - little_since_ >= config_.end_for;
}

/// Adjusts the held current by the highest cell, with each new sample of it.
void ChargeControl::hold(const PackState& pack) {
  const Spread& cells = pack.cell_voltage_uV;
  if (cells.max_taken_at == sampled_at_) return;
  const Duration since_last = cells.max_taken_at - sampled_at_;
  sampled_at_ = cells.max_taken_at;
  const std::int64_t below_uV = std::int64_t{config_.cell_full_uV} - cells.max;
  if (below_uV >= near_band_uV) {
    is_held_ = false;
    return;
  }
  if (!is_held_) held_mA_ = current_mA_;
  is_held_ = true;
  const std::int64_t span_ms = to_ms(std::clamp<Duration>(since_last, Duration{}, sample_gap_max));
  const std::int64_t share = below_uV >= 0 ? rise_permille_per_s : fall_permille_per_s;
  // uV over uOhm is A; permille of it a second, times ms, is A / 1'000'000.
  const std::int64_t step_mA = below_uV * share * span_ms / (cell_resistance_uOhm_ * 1'000);
  held_mA_ = static_cast<std::int32_t>(std::clamp<std::int64_t>(held_mA_ + step_mA, 0, config_.current_max_mA));
}

std::int32_t ChargeControl::ramped(std::int32_t wanted_mA, TimePoint now) const {
  if (wanted_mA <= current_mA_) return wanted_mA;
  const std::int64_t span_ms = to_ms(std::clamp<Duration>(now - stepped_at_, Duration{}, sample_gap_max));
  const std::int64_t rise_mA = config_.rise_mA_per_s * span_ms / 1'000;
  return static_cast<std::int32_t>(std::min<std::int64_t>(wanted_mA, current_mA_ + rise_mA));
}

}  // namespace bmu

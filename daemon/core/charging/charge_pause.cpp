#include "daemon/core/charging/charge_pause.hpp"

namespace bmu {

namespace {

/// For C/20: its current is the capacity divided by this.
constexpr std::int64_t twentieth_rate_uAs_per_mA = std::int64_t{20} * 3'600 * 1'000;

}  // namespace

void ChargePause::init(const CoreConfig& config) {
  at_permille_ = config.soc.resistance_pause_permille;
  lasts_ = config.soc.resistance_pause;
  charging_mA_ = static_cast<std::int32_t>(config.cell.capacity_uAs / twentieth_rate_uAs_per_mA);
}

bool ChargePause::is_charging(const ChargePauseInputs& in) const {
  return in.is_closed && in.current_mA.is_valid() && -in.current_mA.value >= charging_mA_;
}

/// The first pause measures a resistance again that is known from earlier charges; the others measure unknown ones
/// only.
bool ChargePause::is_due(const ChargePauseInputs& in) const {
  const Duration after = is_first_ ? pause_after : pause_repeat_after;
  const bool has_charged = charging_since_ != TimePoint{} && in.now - charging_since_ >= after;
  const bool is_at_place = *in.soc_permille >= at_permille_ && *in.soc_permille < at_permille_ + pause_span_permille;
  const bool is_wanted = is_first_ ? *in.soc_permille >= at_permille_ : is_at_place && !in.is_resistance_known;
  return pauses_left_ > 0 && has_charged && is_wanted;
}

void ChargePause::update(const ChargePauseInputs& in) {
  if (at_permille_ == 0) return;
  if (is_pausing_) {
    is_pausing_ = in.is_closed && in.now - paused_at_ < lasts_;
    charging_since_ = {};
    return;
  }
  if (!is_charging(in)) {
    charging_since_ = {};
  } else if (charging_since_ == TimePoint{}) {
    charging_since_ = in.now;
  }
  if (!in.soc_permille) return;
  if (*in.soc_permille <= at_permille_ - pause_span_permille) {
    pauses_left_ = pauses_max;
    is_first_ = true;
  }
  if (!is_due(in)) return;
  --pauses_left_;
  is_first_ = false;
  is_pausing_ = true;
  paused_at_ = in.now;
}

}  // namespace bmu

#include "daemon/core/contactors/rest_mode.hpp"

#include <utility>

namespace bmu {

std::string_view to_text(RestPhase phase) {
  switch (phase) {
    case RestPhase::awake: return "awake";
    case RestPhase::resting: return "resting";
    case RestPhase::looking: return "looking";
  }
  return "?";
}

bool RestMode::step(const RestInputs& in) {
  const bool line_rose = (in.resume_button && !was_button_) || (in.vehicle_on && !was_vehicle_);
  was_button_ = in.resume_button;
  was_vehicle_ = in.vehicle_on;
  const bool is_woken = std::exchange(is_wake_wanted_, false) || line_rose || in.charger_connected;
  const bool is_alone = in.is_undervoltage && in.is_open && !is_woken;
  if (!is_alone) alone_since_ = {};
  if (is_alone && alone_since_ == TimePoint{}) alone_since_ = in.now;
  const RestPhase phase = next(in, is_woken);
  if (phase == phase_) return false;
  phase_ = phase;
  since_ = in.now;
  return true;
}

RestPhase RestMode::next(const RestInputs& in, bool is_woken) const {
  // Woken, charged and cleared while looking, or never in undervoltage: awake.
  if (is_woken || !in.is_undervoltage) return RestPhase::awake;
  const Duration since = in.now - since_;
  if (phase_ == RestPhase::resting) return since >= config_.look_every ? RestPhase::looking : RestPhase::resting;
  const bool has_looked = in.has_complete_view || since >= look_max;
  if (phase_ == RestPhase::looking) return has_looked ? RestPhase::resting : RestPhase::looking;
  const bool is_due = alone_since_ != TimePoint{} && in.now - alone_since_ >= config_.after;
  return is_due ? RestPhase::resting : RestPhase::awake;
}

}  // namespace bmu

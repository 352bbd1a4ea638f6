#include "daemon/core/modules/module_broadcasts.hpp"

namespace bmu {

bool ModuleBroadcasts::Repeated::is_due(TimePoint now) {
  const bool is_first = left == twice;
  if (left == 0 || (!is_first && now - said_at < broadcast_spacing)) return false;
  --left;
  said_at = now;
  return true;
}

void ModuleBroadcasts::sleep() {
  rounds_left_ = sleep_rounds;
  is_asked_ = false;
  slept_at_ = {};
}

ModuleBroadcasts::Step ModuleBroadcasts::step(TimePoint now) {
  Step step;
  step.says_stop = stop_.is_due(now);
  step.says_clear = clear_.is_due(now);
  if (rounds_left_ > 0) step_sleep(now, step);
  return step;
}

void ModuleBroadcasts::step_sleep(TimePoint now, Step& step) {
  if (slept_at_ != TimePoint{} && now - slept_at_ < sleep_spacing) return;
  const bool is_said = slept_at_ != TimePoint{} && !is_asked_;
  slept_at_ = now;
  if (is_said) {
    step.asks = is_asked_ = true;
    is_answered_ = false;
    return;
  }
  const bool are_asleep = is_asked_ && !is_answered_;
  if (are_asleep) {
    rounds_left_ = 0;  // the poll has woken them: sent a last time
  } else if (is_asked_) {
    step.stays_awake = --rounds_left_ == 0;
  }
  step.says_sleep = !step.stays_awake;
  is_asked_ = false;
}

}  // namespace bmu

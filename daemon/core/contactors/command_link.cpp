#include "daemon/core/contactors/command_link.hpp"

#include <algorithm>

#include "daemon/core/types/core_config.hpp"
#include "protocol/tables/internal_bus.hpp"

namespace bmu {

bool CommandLink::is_due(TimePoint now, bool has_changed) const {
  if (has_changed || has_failed_) return true;
  const bool must_wait = waiting_ >= commands_waiting_max && now - sent_at_ < command_wait_given_up;
  return now >= due_at_ && !must_wait;
}

void CommandLink::note_sent(std::uint8_t counter, TimePoint now) {
  constexpr Duration period = internal_bus::contactor_command.period;
  if (!has_sent_) {
    // The first one may have the counter of the previous session's last command, and be ignored as repeated.
    due_at_ = now + tick_period;
  } else if (now >= due_at_ && now < due_at_ + period) {
    due_at_ += period;  // from the due time, so that a decision between two ticks makes no interval longer
  } else {
    due_at_ = now + period - tick_period;  // sent in the tick after it, at the latest
  }
  if (unconfirmed_since_ == TimePoint{}) unconfirmed_since_ = now;
  waiting_ = static_cast<std::uint8_t>(std::min(waiting_ + 1, int{commands_waiting_max}));
  has_failed_ = false;
  counter_ = counter;
  sent_at_ = now;
  has_sent_ = true;
}

void CommandLink::note_echo(std::uint8_t counter) {
  if (counter != counter_ || !has_sent_) return;  // an older one: the latest command is still queued behind it
  has_echoed_ = true;
  waiting_ = 0;
  unconfirmed_since_ = {};
}

void CommandLink::note_failed() {
  waiting_ = 0;
  has_failed_ = true;
}

bool CommandLink::is_on_bus(TimePoint now) const {
  return has_echoed_ && (unconfirmed_since_ == TimePoint{} || now - unconfirmed_since_ <= command_wait_max);
}

bool CommandLink::is_stuck(TimePoint now) const {
  const bool is_full = waiting_ >= commands_waiting_max;  // the next command has to be one with changed outputs
  return is_full || (waiting_ > 0 && now - sent_at_ > command_wait_usual);
}

}  // namespace bmu

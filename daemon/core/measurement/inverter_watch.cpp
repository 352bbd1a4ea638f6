#include "daemon/core/measurement/inverter_watch.hpp"

namespace bmu {

bool InverterWatch::observe(const CanFrame& frame, TimePoint at) {
  if (!is_there()) return false;
  BatteryReport ignored;
  if (config_.driver->hear(frame, ignored) != BatteryWord::none) {
    foreign_at_ = at;
    return true;
  }
  const InverterWord word = config_.driver->take(frame, report_);
  if (word == InverterWord::none) return false;
  if (word == InverterWord::refused) {
    ++frames_refused_;
    return true;
  }
  ++frames_taken_;
  if (word == InverterWord::alive) heard_at_ = at;
  return true;
}

void InverterWatch::forget_values() {
  report_ = {.values_out_of_range = report_.values_out_of_range};
  heard_at_ = {};
}

bool InverterWatch::is_silent(TimePoint now, TimePoint closed_since) const {
  const bool is_watched = is_there() && config_.silence_max > Duration{} && closed_since != TimePoint{};
  if (!is_watched || is_talking(now)) return false;
  const bool had_begun = heard_at_ != TimePoint{} && heard_at_ + config_.silence_max >= closed_since;
  return had_begun || now - closed_since > config_.first_word_max;
}

}  // namespace bmu

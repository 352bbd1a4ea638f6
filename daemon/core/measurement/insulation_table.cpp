#include "daemon/core/measurement/insulation_table.hpp"

namespace bmu {

namespace {

InsulationState state_of(ir155::State state) {
  switch (state) {
    case ir155::State::no_signal_low:
    case ir155::State::no_signal_high: return InsulationState::no_signal;
    case ir155::State::normal: return InsulationState::normal;
    case ir155::State::undervoltage: return InsulationState::undervoltage;
    case ir155::State::speed_start_good:
    case ir155::State::speed_start_bad: return InsulationState::speed_start;
    case ir155::State::device_error: return InsulationState::device_error;
    case ir155::State::earth_fault: return InsulationState::earth_fault;
    case ir155::State::undefined: break;
  }
  return InsulationState::undefined;
}

}  // namespace

std::string_view to_text(InsulationState state) {
  switch (state) {
    case InsulationState::no_signal: return "no signal";
    case InsulationState::normal: return "normal";
    case InsulationState::undervoltage: return "undervoltage";
    case InsulationState::speed_start: return "speed start";
    case InsulationState::device_error: return "device error";
    case InsulationState::earth_fault: return "earth fault";
    case InsulationState::undefined: return "undefined";
  }
  return "?";
}

bool InsulationTable::observe(const CanFrame& frame, TimePoint at) {
  if (!is_on_bus()) return false;
  MonitorReport report;
  const MonitorWord word = driver().take(frame, report);
  if (word == MonitorWord::none) return false;
  if (word == MonitorWord::refused) {
    ++frames_refused_;
    return true;
  }
  report_ = report;
  if (first_heard_at_ == TimePoint{}) first_heard_at_ = at;
  if (heard_at_ == TimePoint{} || at - heard_at_ > silence_max()) heard_since_ = at;
  heard_at_ = at;
  if (report.resistance_Ohm.is_valid()) {
    resistance_Ohm_ = report.resistance_Ohm;
    measured_at_ = at;
  }
  return true;
}

void InsulationTable::observe(const ir155::Pwm& pwm, TimePoint at) {
  pwm_ = pwm;
  pulsed_at_ = at;
}

void InsulationTable::forget_values() {
  report_ = {};
  first_heard_at_ = {};
  heard_since_ = {};
  heard_at_ = {};
  resistance_Ohm_ = {};
  measured_at_ = {};
}

ir155::Pwm InsulationTable::pulses(TimePoint now) const {
  ir155::Pwm pwm = pwm_;
  pwm.since_edge += now - pulsed_at_;
  return pwm;
}

bool InsulationTable::is_talking(TimePoint now) const {
  if (config_.has_pulse_line) return word_of_pulses(now).state != InsulationState::no_signal;
  return is_there() && heard_at_ != TimePoint{} && now - heard_at_ <= silence_max();
}

bool InsulationTable::waits_for_test(TimePoint now) const {
  return report_.is_test_pending && now - heard_since_ < test_wait;
}

bool InsulationTable::is_untested(TimePoint now) const {
  return is_on_bus() && is_talking(now) && report_.is_test_pending && !waits_for_test(now);
}

InsulationWord InsulationTable::word(TimePoint now) const {
  return config_.has_pulse_line ? word_of_pulses(now) : word_of_reports(now);
}

/// Each period is a sample of its own, taken at its end.
InsulationWord InsulationTable::word_of_pulses(TimePoint now) const {
  const ir155::Pwm pwm = pulses(now);
  const ir155::Reading reading = ir155::decode(pwm);
  const bool has_value = reading.resistance_Ohm.validity != Validity::unknown;
  return {.state = state_of(reading.state),
          .resistance_Ohm = reading.resistance_Ohm,
          .is_ok = reading.state != ir155::State::speed_start_bad,
          .taken_at = has_value ? now - pwm.since_edge : TimePoint{}};
}

InsulationWord InsulationTable::word_of_reports(TimePoint now) const {
  if (!is_there() || heard_at_ == TimePoint{}) return {.state = InsulationState::speed_start};
  InsulationWord word{.is_ok = !report_.is_low};
  if (!is_talking(now)) return word;
  const bool has_value = measured_at_ != TimePoint{} && now - measured_at_ <= held_max;
  if (report_.is_earth_lost) {
    word.state = InsulationState::earth_fault;
  } else if (report_.is_faulty || report_.is_off) {
    word.state = InsulationState::device_error;
  } else if (waits_for_test(now) || !has_value) {
    word.state = InsulationState::speed_start;
    word.awaits_first_test = waits_for_test(now) && heard_since_ == first_heard_at_;
  } else {
    word = {InsulationState::normal, resistance_Ohm_, word.is_ok, measured_at_};
  }
  return word;
}

}  // namespace bmu

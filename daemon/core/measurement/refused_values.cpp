#include "daemon/core/measurement/refused_values.hpp"

namespace bmu {

namespace {

/// The end of a period comes in whole microseconds, and no signal of a monitor has periods as short as this.
constexpr Duration same_period_within = 1ms;

}  // namespace

std::string_view to_text(ResultRefusal why) {
  switch (why) {
    case ResultRefusal::sensor_fault: return to_text(Validity::sensor_fault);
    case ResultRefusal::out_of_range: return to_text(Validity::out_of_range);
    case ResultRefusal::not_known: return to_text(Validity::unknown);
    case ResultRefusal::wrong_frame: return "wrong frame";
  }
  return "?";
}

ResultRefusal refusal_of(Validity validity) {
  switch (validity) {
    case Validity::out_of_range:
    case Validity::above_range: return ResultRefusal::out_of_range;
    case Validity::open_circuit:
    case Validity::short_circuit:
    case Validity::sensor_fault: return ResultRefusal::sensor_fault;
    default: return ResultRefusal::not_known;
  }
}

void RefusedPulses::observe(const ir155::Pwm& pwm, TimePoint at) {
  if (!ir155::has_signal(pwm)) return;
  const TimePoint period_ended_at = at - pwm.since_edge;
  if (ended_at != TimePoint{} && period_ended_at - ended_at < same_period_within) return;
  ended_at = period_ended_at;
  if (const auto why = ir155::misfit(pwm)) ++by_reason[static_cast<std::size_t>(*why)];
}

}  // namespace bmu

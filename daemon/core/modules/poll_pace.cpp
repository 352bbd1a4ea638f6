#include "daemon/core/modules/poll_pace.hpp"

#include <algorithm>

namespace bmu {

namespace {

/// Minimum time for the answers to a POLL, which the ages of a pack file must include.
constexpr Duration answer_margin = 50ms;

}  // namespace

std::string_view to_text(PollPace pace) {
  switch (pace) {
    case PollPace::fast: return "fast";
    case PollPace::active: return "active";
    case PollPace::parked: return "parked";
  }
  return "?";
}

void PollPacer::init(const PollConfig& config, TimePoint started_at) {
  config_ = config;
  start_over(started_at);
}

void PollPacer::start_over(TimePoint at) {
  pace_ = PollPace::active;
  since_ = busy_at_ = at;
  hurried_at_ = {};
}

Duration PollPacer::period() const {
  switch (pace_) {
    case PollPace::fast: return config_.fast_period;
    case PollPace::active: return config_.period;
    case PollPace::parked: return config_.parked_period;
  }
  return config_.period;
}

PollPace PollPacer::step(const PaceInputs& in) {
  const bool is_hurried = in.is_suspected || (!in.is_open && (in.is_near_limit || in.changes_current));
  const bool is_busy =
      is_hurried || !in.is_open || in.is_wanted || in.is_bleeding || !in.is_settled || in.is_near_limit;
  if (is_hurried) hurried_at_ = in.now;
  if (is_busy) busy_at_ = in.now;
  const PollPace pace = next(in.now);
  if (pace != pace_) since_ = in.now;
  return pace_ = pace;
}

PollPace PollPacer::next(TimePoint now) const {
  const bool is_hurried = hurried_at_ != TimePoint{} && now - hurried_at_ < fast_for;
  if (is_hurried && config_.fast_period > Duration{}) return PollPace::fast;
  const bool is_quiet = now - busy_at_ >= parked_after;
  return is_quiet && config_.parked_period > Duration{} ? PollPace::parked : PollPace::active;
}

AgeConfig ages_at(PollPace pace, const AgeConfig& configured, const PollConfig& poll) {
  AgeConfig ages = configured;
  if (pace != PollPace::parked) return ages;
  const Duration slow = 2 * poll.parked_period + answer_margin;
  // Cell voltages are dated at the POLL: the time that the configuration leaves for all answers is needed here, too.
  const Duration cell_margin = std::max(answer_margin, configured.cell_voltage - 2 * poll.period);
  ages.cell_voltage = std::max(ages.cell_voltage, 2 * poll.parked_period + cell_margin);
  ages.temperature = std::max(ages.temperature, slow);
  ages.module_status = std::max(ages.module_status, slow);
  return ages;
}

}  // namespace bmu

#include "daemon/core/modules/poll_schedule.hpp"

#include <algorithm>

#include "protocol/tables/internal_bus.hpp"

namespace bmu {

namespace {

/// Time after a POLL before a module with a missing answer is polled singly: by then all others have answered.
constexpr Duration silence_max = 100ms;
/// Time before the next broadcast: room for an answer.
constexpr Duration single_takes = 20ms;
/// Tolerance by which a deadline may be early, due to the ticks: a tenth of the shortest period.
constexpr Duration early_max = 2ms;

/// Deadlines of parts that are not in every poll advance by their own period; true if the part is due in this poll.
bool is_turn(TimePoint now, Duration period, TimePoint& due_at) {
  if (now + early_max < due_at) return false;
  due_at += period;
  if (due_at <= now) due_at = now + period;
  return true;
}

CanFrame poll_frame(std::uint8_t node, const PollWants& wants, std::uint8_t counter) {
  using namespace internal_bus;
  CanFrame frame = make_frame(poll);
  write<poll, "target_node">(frame, node);
  write<poll, "sync">(frame, 1);
  write<poll, "want_status">(frame, wants.status ? 1 : 0);
  write<poll, "want_cells">(frame, wants.cells ? 1 : 0);
  write<poll, "want_temp">(frame, wants.temperatures ? 1 : 0);
  write<poll, "want_module">(frame, wants.module ? 1 : 0);
  write<poll, "want_ident">(frame, wants.identity ? 1 : 0);
  seal(poll, counter, frame);
  return frame;
}

}  // namespace

void PollSchedule::init(const PollConfig& config, TimePoint started_at, std::uint8_t first_counter) {
  *this = {};
  counter_ = first_counter;
  config_ = config;
  next_at_ = temperatures_at_ = identities_at_ = started_at;
}

Poll PollSchedule::step(TimePoint now, Duration period, bool identities_known) {
  if (is_hurried_) {
    next_at_ = std::min(next_at_, hurried_at(now, period));
  } else if (last_at_ != TimePoint{}) {
    next_at_ = std::min(next_at_, last_at_ + period);
  }
  if (now < next_at_) return {};
  is_hurried_ = false;
  last_at_ = now;
  next_at_ += period;
  if (next_at_ <= now) next_at_ = now + period;  // after a gap; no burst to catch up
  singles_ = 0;
  const bool wants_identity = is_turn(now, identity_period, identities_at_);
  const PollWants wants{.temperatures = is_turn(now, config_.period * config_.temperature_every, temperatures_at_),
                        .identity = !identities_known || wants_identity};
  return {.is_due = true, .frame = poll_frame(0, wants, counter_++), .wants = wants};
}

/// Not before the end of the answer window of the last poll: two consecutive answers of a large pack would block the
/// sensor, which has the identifiers of lowest priority, for longer than its maximum age.
TimePoint PollSchedule::hurried_at(TimePoint now, Duration period) const {
  return last_at_ == TimePoint{} ? now : std::max(now, last_at_ + std::min(period, silence_max));
}

bool PollSchedule::may_ask_silent(TimePoint now, Duration period) {
  const Duration after = std::min(silence_max, std::max(period / 2, period - single_takes));
  if (singles_ >= singles_per_cycle || now - last_at_ < after) return false;
  ++singles_;
  return true;
}

bool PollSchedule::is_answer_over(TimePoint now) const {
  return last_at_ != TimePoint{} && now - last_at_ >= silence_max;
}

CanFrame PollSchedule::single(std::uint8_t node, const PollWants& wants) {
  return poll_frame(node, wants, counter_++);
}

}  // namespace bmu

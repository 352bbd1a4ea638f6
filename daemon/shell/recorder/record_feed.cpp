#include "daemon/shell/recorder/record_feed.hpp"

#include <algorithm>
#include <cstdlib>
#include <utility>

namespace bmu {

namespace {

/// Maximum difference between the wall clock and the times of the recording; beyond it they are set to the clock.
constexpr std::int64_t clock_step_us = 1'000'000;

}  // namespace

RecordFeed::RecordFeed(RecordFeedOptions options, const Core& core, RecordQueue& queue)
    : options_(std::move(options)), core_(core), queue_(queue), lines_(options_.buses) {
  const std::size_t usual_bytes = options_.chunk_max_bytes / 4;
  chunk_.text.reserve(usual_bytes);
  queue_.make_room(usual_bytes);
}

void RecordFeed::begin(TimePoint now) {
  is_part_due_ = !begin_part(now);
}

bool RecordFeed::begin_part(TimePoint now) {
  // The core first: without a spare one the lines continue in the current part, in chunks of the usual length.
  if (spare_ == nullptr) spare_ = queue_.spare_core();
  if (spare_ == nullptr || (!chunk_.is_empty() && !hand_over())) return false;
  *spare_ = core_;
  chunk_.core = std::move(spare_);
  lines_.begin(now, options_.wall_clock(now), core_.outputs());
  chunk_.clock = lines_.clock();
  chunk_.from = now;
  part_ += has_lost_ ? 2 : 1;
  chunk_.part = part_;
  part_began_at_ = now;
  has_lost_ = false;
  return true;
}

void RecordFeed::observed(const Observation& observation) {
  // Here, because the core has handled and decided on all that was recorded, and on nothing of this observation.
  if (is_part_due_) is_part_due_ = !begin_part(observation.at);
  if (has_lost_ || chunk_.text.size() > options_.chunk_max_bytes) {
    has_lost_ = is_part_due_ = true;
    ++pieces_lost_;
    return;
  }
  if (const auto* const seen = std::get_if<WallClockSeen>(&observation.what)) follow_wall_clock(observation.at, *seen);
  lines_.observed(observation, chunk_.text);
  ++pieces_waiting_;
}

void RecordFeed::follow_wall_clock(TimePoint at, const WallClockSeen& seen) {
  const std::int64_t seen_us = seen.unix_time_ms * 1000;
  if (std::llabs(seen_us - lines_.clock().to_log_us(at)) > clock_step_us) {
    lines_.set_wall_clock(at, seen_us, chunk_.text);
  }
}

void RecordFeed::decided(TimePoint at, const Decisions& decisions) {
  if (has_lost_) {
    ++pieces_lost_;
    return look_for_trigger(at, decisions);
  }
  lines_.decided(at, decisions, chunk_.text);
  ++pieces_waiting_;
  chunk_.until = at;
  if (at - part_began_at_ >= options_.part_length) is_part_due_ = true;
  look_for_trigger(at, decisions);
  if (!chunk_.triggers.empty() || at - chunk_.from >= options_.chunk_length) static_cast<void>(hand_over());
}

bool RecordFeed::hand_over() {
  chunk_.unix_time_us = chunk_.clock.to_log_us(chunk_.from);
  const TimePoint until = chunk_.until;
  if (!queue_.offer(chunk_)) return false;
  chunk_.clear();
  pieces_waiting_ = 0;
  chunk_.clock = lines_.clock();
  chunk_.from = until;
  return true;
}

bool RecordFeed::is_worth_keeping(const Event& event) const {
  if (event.id == EventId::opened) return true;
  if (event.id != EventId::fault_confirmed || row_of(event.fault).latch == Latch::none) return false;
  const TimePoint shown_at = shown_at_[static_cast<std::size_t>(event.fault)];
  return shown_at == TimePoint{} || event.at - shown_at >= options_.again_after;
}

void RecordFeed::keep(const Event& event, TimePoint at) {
  const bool is_of_fault = event.id == EventId::fault_confirmed || event.cause == OpeningCause::fault;
  RecordTrigger trigger{.at = at, .unix_time_us = lines_.clock().to_log_us(at), .event = event};
  if (is_of_fault) trigger.freeze = core_.persistent().faults[static_cast<std::size_t>(event.fault)].frame;
  if (!chunk_.triggers.try_push_back(trigger)) ++triggers_lost_;
}

void RecordFeed::look_for_trigger(TimePoint at, const Decisions& decisions) {
  const std::uint64_t lost_before = triggers_lost_;
  bool has_one = false;
  for (const Event& event : decisions.events) {
    if (!is_worth_keeping(event)) continue;
    // The first event of a decision is the reason; the others are in the lines.
    if (!std::exchange(has_one, true)) keep(event, at);
    const bool is_shown = event.id == EventId::fault_confirmed && triggers_lost_ == lost_before;
    if (is_shown) shown_at_[static_cast<std::size_t>(event.fault)] = event.at;
  }
}

bool RecordFeed::end(Duration at_most) {
  if (chunk_.is_empty()) return true;
  chunk_.unix_time_us = chunk_.clock.to_log_us(chunk_.from);
  const bool is_taken = queue_.offer(chunk_, at_most);
  if (!is_taken) {
    pieces_lost_ += pieces_waiting_;
    triggers_lost_ += chunk_.triggers.size();
  }
  chunk_.clear();
  pieces_waiting_ = 0;
  return is_taken;
}

}  // namespace bmu

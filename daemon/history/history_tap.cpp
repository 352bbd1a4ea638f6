#include "daemon/history/history_tap.hpp"

#include <utility>

namespace bmu {

namespace {

constexpr Duration tell_period = 1s;

}  // namespace

HistoryTap::HistoryTap(const Core& core, HistoryStore& store, Duration period, Log log)
    : core_(core), store_(store), averager_(core, period), log_(std::move(log)) {}

void HistoryTap::decided(TimePoint at, const Decisions& decisions) {
  decided_at_ = at;
  for (const Event& event : decisions.events) {
    if (row_of(event.id).severity == Severity::debug) continue;
    store_.offer(TimedEvent{.event = event,
                            .number = ++events_,
                            .unix_time_ms = core_.unix_time_ms(event.at),
                            .uptime = event.at - core_.started_at()});
  }
  if (averager_.update(at)) store_.offer(averager_.minute());
  if (at - told_at_ >= tell_period) {
    told_at_ = at;
    tell_changes();
  }
}

void HistoryTap::finish() {
  if (averager_.finish(decided_at_)) store_.offer(averager_.minute());
}

void HistoryTap::tell_changes() {
  const HistoryHealth health = store_.health();
  if (health.state == HistoryState::off) return;
  if (health.put_aside != std::exchange(told_aside_, health.put_aside)) {
    log_(Severity::warning, "history: database damaged, moved to " + health.put_aside + "; new database created");
  }
  const HistoryState before = std::exchange(told_state_, health.state);
  if (health.state == HistoryState::failing && health.last_error != told_error_) {
    told_error_ = health.last_error;
    log_(Severity::warning, "history: write failed: " + health.last_error);
  }
  if (health.state != HistoryState::writing || before == HistoryState::writing) return;
  told_error_.clear();
  std::string lost;
  if (health.rows_lost == 1) lost = "; 1 row lost";
  if (health.rows_lost > 1) lost = "; " + std::to_string(health.rows_lost) + " rows lost";
  log_(Severity::info,
       "history " + store_.path() + ": writing " + (before == HistoryState::starting ? "started" : "resumed") + lost);
}

}  // namespace bmu

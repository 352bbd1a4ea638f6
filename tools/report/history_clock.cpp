#include "tools/report/history_clock.hpp"

#include <cstdlib>

#include "tools/common/clock_set.hpp"
#include "tools/report/time.hpp"

namespace bmu::report {

namespace {

/// A smaller step is a correction of the clock.
constexpr std::int64_t setting_min_ms = 1'000;
constexpr std::size_t notes_max = 20;
constexpr std::int64_t us_of_ms = 1'000;

/// Start of a row, since the daemon's start.
HistoryNumber begin_of(const HistoryRow& row) {
  if (!row.uptime_ms || !row.span_ms) return std::nullopt;
  return *row.uptime_ms - *row.span_ms;
}

std::string setting_text(std::int64_t set_by_ms, std::int64_t at_ms) {
  const bool is_first = is_clock_set(at_ms * us_of_ms) && !is_clock_set((at_ms - set_by_ms) * us_of_ms);
  return "The clock was set " + std::string(set_by_ms < 0 ? "back" : "forward") + " by " +
         span_text(std::abs(set_by_ms) * us_of_ms) + " before " + time_text(at_ms * us_of_ms) +
         (is_first ? ", for the first time since the computer started" : "") +
         "; what the same session has before is shown on the clock as it was set.";
}

}  // namespace

void HistoryClock::take(const HistoryRow& row) {
  const HistoryNumber since_start_ms = begin_of(row);
  if (!row.life || !row.unix_time_ms || !since_start_ms) return;
  const std::int64_t ahead_ms = *row.unix_time_ms - *since_start_ms;
  const auto [known, is_new] = lives_.try_emplace(*row.life, Life{.ahead_ms = ahead_ms});
  Life& life = known->second;
  const std::int64_t set_by_ms = ahead_ms - life.ahead_ms;
  life.ahead_ms = ahead_ms;
  if (is_new || std::abs(set_by_ms) < setting_min_ms) return;
  life.was_set = true;
  if (++settings_ <= notes_max) notes_.push_back(setting_text(set_by_ms, *row.unix_time_ms));
}

HistoryNumber HistoryClock::shown(HistoryNumber unix_time_ms, const HistoryNumber& life,
                                  const HistoryNumber& since_start_ms) const {
  if (!unix_time_ms || !life || !since_start_ms) return unix_time_ms;
  const auto known = lives_.find(*life);
  if (known == lives_.end() || !known->second.was_set) return unix_time_ms;
  // A correction of the clock by milliseconds is followed.
  const std::int64_t shown_ms = *since_start_ms + known->second.ahead_ms;
  return std::abs(shown_ms - *unix_time_ms) < setting_min_ms ? unix_time_ms : HistoryNumber(shown_ms);
}

HistoryNumber HistoryClock::shown_ms(const HistoryRow& row) const {
  return shown(row.unix_time_ms, row.life, begin_of(row));
}

HistoryNumber HistoryClock::shown_ms(const HistoryEvent& event) const {
  return shown(event.unix_time_ms, event.life, event.uptime_ms);
}

std::vector<std::string> HistoryClock::notes() const {
  std::vector<std::string> notes = notes_;
  if (settings_ > notes_max) {
    notes.push_back(std::to_string(settings_ - notes_max) + " more settings of the clock are left out here.");
  }
  return notes;
}

}  // namespace bmu::report

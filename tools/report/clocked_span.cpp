#include "tools/report/clocked_span.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <set>

#include "tools/common/clock_set.hpp"

namespace bmu::report {

namespace {

constexpr std::int64_t us_of_ms = 1'000;
constexpr std::int64_t ms_of_s = 1'000;
constexpr std::int64_t clock_set_from_ms = clock_set_from_us / us_of_ms;

bool has_set_time(const HistoryRow& row) {
  return row.unix_time_ms && is_clock_set(*row.unix_time_ms * us_of_ms);
}

}  // namespace

ClockedSpan::ClockedSpan(HistoryReader& history, const HistorySpan& span) : history_(history), span_(span) {
  if (is_whole()) return;
  first_ = first_to_read();
  if (first_ >= 0) {
    read_clock();
  } else {
    count_behind_all();
  }
}

/// Rows before the first one of the span by its own time may belong to the span by that of a clock that was set later:
/// as many as fit between. -1: there is no row from its start on.
std::int64_t ClockedSpan::first_to_read() {
  std::optional<std::int64_t> first;
  std::int64_t begins_ms = 0;
  history_.for_each_row({.from_unix_ms = span_.from_unix_ms.value_or(0)}, [&](const HistoryRow& row) {
    first = row.sequence;
    begins_ms = row.unix_time_ms.value_or(0);
    return false;
  });
  if (!first) return -1;
  if (!span_.from_unix_ms) return 0;
  std::int64_t period_s = history_.period_s();
  for (const HistoryLife& life : history_.lives()) period_s = std::min(period_s, life.period_s);
  // The first row of a session and the last may be half as long.
  const std::int64_t apart_min_ms = std::max<std::int64_t>(1, period_s) * ms_of_s / 2;
  return std::max<std::int64_t>(0, *first - (begins_ms - *span_.from_unix_ms) / apart_min_ms - 2);
}

/// Reads to the end: the clock of a session may be set long after the rows of the span.
void ClockedSpan::read_clock() {
  std::set<HistoryNumber> lives_with_time;
  std::map<HistoryNumber, std::size_t> without_time;
  bool is_behind = false;
  history_.for_each_row_after(first_ - 1, [&](const HistoryRow& row) {
    clock_.take(row);
    if (!has_set_time(row)) {
      if (!is_behind && !span_.has(row.unix_time_ms)) ++without_time[row.life];
      return true;
    }
    lives_with_time.insert(row.life);
    if (span_.from_unix_ms && *row.unix_time_ms < *span_.from_unix_ms) without_time.clear();
    is_behind = is_behind || (span_.to_unix_ms && *row.unix_time_ms >= *span_.to_unix_ms);
    return true;
  });
  for (const auto& [life, rows] : without_time) {
    if (!lives_with_time.contains(life)) rows_of_no_time_ += rows;
  }
}

/// For a history without a time within the span or later: counts its last rows without a set clock.
void ClockedSpan::count_behind_all() {
  if (span_.from_unix_ms.value_or(0) < clock_set_from_ms) return;
  std::int64_t last = -1;
  std::size_t rows = 0;
  history_.for_each_row({.to_unix_ms = clock_set_from_ms}, [&](const HistoryRow& row) {
    rows = row.sequence == last + 1 ? rows + 1 : 1;
    last = row.sequence;
    return true;
  });
  history_.for_each_row_after(last, [&](const HistoryRow&) {
    rows = 0;
    return false;
  });
  rows_of_no_time_ = rows;
}

void ClockedSpan::for_each_row(const std::function<bool(const HistoryRow&)>& take) {
  if (!clock_.was_set()) return history_.for_each_row(span_, take);
  history_.for_each_row_after(first_ - 1, [&](const HistoryRow& row) {
    const HistoryNumber shown_ms = clock_.shown_ms(row);
    if (!span_.has(shown_ms)) return true;
    if (shown_ms == row.unix_time_ms) return take(row);
    HistoryRow shown = row;
    shown.unix_time_ms = shown_ms;
    return take(shown);
  });
}

void ClockedSpan::for_each_event(const std::function<bool(const HistoryEvent&)>& take) {
  if (!clock_.was_set()) return history_.for_each_event(span_, take);
  history_.for_each_event({}, [&](const HistoryEvent& event) {
    HistoryEvent shown = event;
    shown.unix_time_ms = clock_.shown_ms(event);
    return !span_.has(shown.unix_time_ms) || take(shown);
  });
}

}  // namespace bmu::report

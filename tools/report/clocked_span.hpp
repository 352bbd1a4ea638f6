// What a history has of a span of time, by the clock as it was set last in each life of the daemon: a life that begins
// without a set clock (in 1970) has its first minutes where they were, as soon as a later one of it has the time.
//
//   ClockedSpan span(history, {.from_unix_ms = an_hour_ago});
//   span.for_each_row([&](const HistoryRow& row) { show(row); return true; });
//   if (span.rows_of_no_time() > 0) warn(...);
//
// Without bounds it is the whole history, with the times as they were written.
//
// Cost: reading the rows from the span's beginning to the newest, and those of the span again.
#pragma once

#include <cstdint>
#include <functional>

#include "daemon/history/history_reader.hpp"
#include "tools/report/history_clock.hpp"

namespace bmu::report {

class ClockedSpan {
 public:
  /// `history` must outlive it.
  ClockedSpan(HistoryReader& history, const HistorySpan& span);

  /// In the order in which they were written, each with its time on that clock, until `take` returns false.
  void for_each_row(const std::function<bool(const HistoryRow&)>& take);
  void for_each_event(const std::function<bool(const HistoryEvent&)>& take);
  /// Rows that may be of the span: no row before them is later than it, none behind them earlier, and nobody knew the
  /// time in all of their life.
  [[nodiscard]] std::size_t rows_of_no_time() const { return rows_of_no_time_; }

 private:
  [[nodiscard]] bool is_whole() const { return !span_.from_unix_ms && !span_.to_unix_ms; }
  [[nodiscard]] std::int64_t first_to_read();
  void read_clock();
  void count_behind_all();

  HistoryReader& history_;
  HistorySpan span_;
  HistoryClock clock_;
  std::int64_t first_ = 0;  // the sequence number from which on rows are read
  std::size_t rows_of_no_time_ = 0;
};

}  // namespace bmu::report

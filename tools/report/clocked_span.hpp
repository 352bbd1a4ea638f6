// The rows and events of a history within a span of time, by the clock as it was set last in each session of the
// daemon: a session that starts without a set clock (in 1970) has its first minutes at their true time, as soon as a
// later one has a set clock.
//
//   ClockedSpan span(history, {.from_unix_ms = an_hour_ago});
//   span.for_each_row([&](const HistoryRow& row) { show(row); return true; });
//   if (span.rows_of_no_time() > 0) warn(...);
//
// Without bounds it is the whole history, with the times as written.
//
// Cost: reading the rows from the start of the span to the newest, and those of the span again.
#pragma once

#include <cstdint>
#include <functional>

#include "daemon/history/history_reader.hpp"
#include "tools/report/history_clock.hpp"

namespace bmu::report {

class ClockedSpan {
 public:
  /// `history` must outlive the object.
  ClockedSpan(HistoryReader& history, const HistorySpan& span);

  /// In the order in which they were written, each with its time on that clock, until `take` returns false.
  void for_each_row(const std::function<bool(const HistoryRow&)>& take);
  void for_each_event(const std::function<bool(const HistoryEvent&)>& take);
  /// Rows that may belong to the span: no row before them is later than the span, none after them earlier, and the
  /// clock was never set in their session.
  [[nodiscard]] std::size_t rows_of_no_time() const { return rows_of_no_time_; }

 private:
  [[nodiscard]] bool is_whole() const { return !span_.from_unix_ms && !span_.to_unix_ms; }
  [[nodiscard]] std::int64_t first_to_read();
  void read_clock();
  void count_behind_all();

  HistoryReader& history_;
  HistorySpan span_;
  HistoryClock clock_;
  std::int64_t first_ = 0;  // the first sequence number to read
  std::size_t rows_of_no_time_ = 0;
};

}  // namespace bmu::report

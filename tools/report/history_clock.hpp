// The clock of a history, which may have been set while the daemon ran: in each session the times of the rows follow
// it, and their uptime does not. All times of a session are shown on the clock as it was set last in it.
//
//   HistoryClock clock;
//   for each row in its order: clock.take(row);
//   for each row and event: const HistoryNumber at_ms = clock.shown_ms(row);
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "daemon/history/history_row.hpp"

namespace bmu::report {

class HistoryClock {
 public:
  /// Adds the rows in the order in which they were written.
  void take(const HistoryRow& row);
  /// Start of a row; without an uptime, or if the clock was not set, as written.
  [[nodiscard]] HistoryNumber shown_ms(const HistoryRow& row) const;
  [[nodiscard]] HistoryNumber shown_ms(const HistoryEvent& event) const;
  /// True if it was set by a second or more, in any session taken so far.
  [[nodiscard]] bool was_set() const { return settings_ > 0; }
  /// A sentence for each change of the clock by a second or more, with its size; the first 20 and the number of others.
  [[nodiscard]] std::vector<std::string> notes() const;

 private:
  struct Life {
    std::int64_t ahead_ms = 0;  // of the row taken last: its time minus its uptime
    bool was_set = false;       // by a second or more, since the session started
  };

  [[nodiscard]] HistoryNumber shown(HistoryNumber unix_time_ms, const HistoryNumber& life,
                                    const HistoryNumber& since_start_ms) const;

  std::map<std::int64_t, Life> lives_;
  std::vector<std::string> notes_;
  std::size_t settings_ = 0;
};

}  // namespace bmu::report

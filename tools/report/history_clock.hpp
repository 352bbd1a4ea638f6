// The clock of a history, which may have been set while the daemon ran: in each life the times of the rows follow it,
// and their uptime does not. All times of a life are shown on the clock as it was set last in it.
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
  /// In the order in which they were written.
  void take(const HistoryRow& row);
  /// When a row begins; without an uptime, or where the clock was not set, as it was written.
  [[nodiscard]] HistoryNumber shown_ms(const HistoryRow& row) const;
  [[nodiscard]] HistoryNumber shown_ms(const HistoryEvent& event) const;
  /// By a second or more, in any life, as far as it was taken.
  [[nodiscard]] bool was_set() const { return settings_ > 0; }
  /// A sentence for each setting of the clock by a second or more, with its size; the first 20 and how many more.
  [[nodiscard]] std::vector<std::string> notes() const;

 private:
  struct Life {
    std::int64_t ahead_ms = 0;  // of the row that was taken last: its time less its uptime
    bool was_set = false;       // by a second or more, since the life began
  };

  [[nodiscard]] HistoryNumber shown(HistoryNumber unix_time_ms, const HistoryNumber& life,
                                    const HistoryNumber& since_start_ms) const;

  std::map<std::int64_t, Life> lives_;
  std::vector<std::string> notes_;
  std::size_t settings_ = 0;
};

}  // namespace bmu::report

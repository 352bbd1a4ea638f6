// The transitions within the minutes of a history, and their times: a row has the phase at its end and the duration
// with closed contactors, the events have the times. Both are compared; if the events do not match the row, because
// some are missing, the row is used, and what it does not determine is reported as unknown.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/history/history_row.hpp"

namespace bmu::report {

/// A part of a minute, in ms since its start.
struct MinutePart {
  std::int64_t from_ms = 0;
  std::int64_t to_ms = 0;

  friend bool operator==(const MinutePart&, const MinutePart&) = default;
};

struct PhasePart : MinutePart {
  std::string phase;           // unknown_phase: unknown
  std::int64_t closed_ms = 0;  // of it, with both main contactors commanded closed: all, zero, or at unknown times

  [[nodiscard]] bool is_closed() const { return closed_ms == to_ms - from_ms && closed_ms > 0; }
};

class HistoryMoves {
 public:
  /// Adds the events in the order in which they were written.
  void take(const HistoryEvent& event);

  /// Consecutive parts that cover the whole minute. `before`: the row that ended where this one starts; null if there
  /// is none.
  [[nodiscard]] std::vector<PhasePart> phases_of(const HistoryRow& row, const HistoryRow* before) const;
  /// The times in a minute at which a fault or warning in the row was present: the whole minute unless events show
  /// otherwise.
  [[nodiscard]] std::vector<MinutePart> times_of_fault(const HistoryRow& row, std::string_view name,
                                                       bool is_warning) const;

 private:
  enum class What : std::uint8_t { phase, fault, warning };
  struct Move {
    What what = What::phase;
    std::int64_t uptime_ms = 0;
    std::string name;  // of a fault
    bool begins = false;
    std::string from, to;  // phases
  };
  [[nodiscard]] std::vector<const Move*> moves_in(const HistoryRow& row, What what, std::string_view name = {}) const;
  [[nodiscard]] std::vector<PhasePart> told_phases(const HistoryRow& row, const HistoryRow* before) const;

  std::map<std::int64_t, std::vector<Move>> of_life_;
};

}  // namespace bmu::report

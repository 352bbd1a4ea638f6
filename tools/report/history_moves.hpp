// What changed within the minutes of a history, and when: a row says how a minute ended and how long the contactors
// were closed in it, the events say at what times. Both are held against each other; where the events do not fit the
// row, as some are missing, the row counts, and what it leaves open is told as not known.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/history/history_row.hpp"

namespace bmu::report {

/// A part of a minute, in ms since its begin.
struct MinutePart {
  std::int64_t from_ms = 0;
  std::int64_t to_ms = 0;

  friend bool operator==(const MinutePart&, const MinutePart&) = default;
};

struct PhasePart : MinutePart {
  std::string phase;           // unknown_phase: nobody knows
  std::int64_t closed_ms = 0;  // of it, with both main contactors commanded closed: all, nothing, or unknown when

  [[nodiscard]] bool is_closed() const { return closed_ms == to_ms - from_ms && closed_ms > 0; }
};

class HistoryMoves {
 public:
  /// In the order in which they were written.
  void take(const HistoryEvent& event);

  /// Parts that follow each other over the whole minute. `before`: the row that ended where this one begins; null if
  /// there is none.
  [[nodiscard]] std::vector<PhasePart> phases_of(const HistoryRow& row, const HistoryRow* before) const;
  /// When in a minute a fault that the row names was there, or a warning: all of it unless events say otherwise.
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

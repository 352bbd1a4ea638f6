// A report of a stretch of the history (daemon/history/history_reader.hpp): a sample a minute, with the lowest and the
// highest of it.
//
// What the history does not have stays unknown: a minute knows the phase at its end and how long the contactors were
// commanded closed, the events when they moved (history_moves.hpp); not each contact, and no cell's resistance. Minutes
// of another pack than the last one are left out, and so are those that somebody set the clock back over; the report
// says how many.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "daemon/history/history_reader.hpp"
#include "tools/report/data.hpp"

namespace bmu::report {

struct HistoryOptions {
  std::optional<std::int64_t> from_us;  // since 1970
  std::optional<std::int64_t> to_us;
  std::size_t samples_max = 9'000;
};

/// is_empty() if no minute lies within.
[[nodiscard]] ReportData report_from_history(HistoryReader& history, const HistoryOptions& options);

}  // namespace bmu::report

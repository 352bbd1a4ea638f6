// A report of a span of the history (daemon/history/history_reader.hpp): one sample per minute, with its minimum and
// maximum.
//
// Data that the history does not contain stays unknown: a minute has the phase at its end and the duration of
// contactors commanded closed, the events have the times of their changes (history_moves.hpp); there are no single
// contacts and no cell resistances. Minutes of another pack than the last one are omitted, and so are those over which
// the clock was set back; the report states their number.
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

/// is_empty() if the span contains no minute.
[[nodiscard]] ReportData report_from_history(HistoryReader& history, const HistoryOptions& options);

}  // namespace bmu::report

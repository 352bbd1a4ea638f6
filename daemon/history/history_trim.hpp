// Removal of excess rows of a history: by number, by age and by size, the oldest first, a bounded number at a time.
//
// Rows are ordered as they were written. A jump of the wall clock must not delete a history: the age counts only if the
// wall clock has matched the daemon's monotonic clock for an hour, it is relative to the newest row, and it removes at
// most ten rows for each new one. The limits by number, the rows of the retention time, and by size always apply.
#pragma once

#include <cstdint>

#include "daemon/history/database.hpp"

namespace bmu {

struct TrimOptions {
  std::int64_t rows_max = 0;
  std::int64_t keep_ms = 0;
  std::int64_t period_s = 60;
  std::int64_t size_max_bytes = 0;
  std::int64_t log_bytes = 0;  // of the log beside the database, which counts as well
  std::int64_t events_max = 0;
};

/// Call after each row. True: there is more to do.
[[nodiscard]] DatabaseResult<bool> trim_history(const Database& database, const TrimOptions& options);

}  // namespace bmu

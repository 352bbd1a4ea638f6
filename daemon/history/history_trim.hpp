// What of a history is too much: by number, by age and by size, the oldest first, a bounded number at a time.
//
// The order is the one in which rows were written. A wall clock that jumps must not cost a history: the age counts only
// while the clock has gone by the daemon's own for an hour, it is the one of the newest row, and it takes at most ten
// rows for each that comes. What a month holds by number, and the size, hold always.
#pragma once

#include <cstdint>

#include "daemon/history/database.hpp"

namespace bmu {

struct TrimOptions {
  std::int64_t rows_max = 0;
  std::int64_t keep_ms = 0;
  std::int64_t period_s = 60;
  std::int64_t size_max_bytes = 0;
  std::int64_t log_bytes = 0;  // of the file beside the database, which counts as well
  std::int64_t events_max = 0;
};

/// To be called after each row. True: there is more to do.
[[nodiscard]] DatabaseResult<bool> trim_history(const Database& database, const TrimOptions& options);

}  // namespace bmu

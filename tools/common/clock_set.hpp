// Detects whether a wall clock has been set: a computer without a battery for its clock starts in 1970.
#pragma once

#include <cstdint>

namespace bmu {

/// 2000-01-01 UTC: an earlier clock has not been set since the computer started.
inline constexpr std::int64_t clock_set_from_us = 946'684'800'000'000;

[[nodiscard]] constexpr bool is_clock_set(std::int64_t unix_time_us) {
  return unix_time_us >= clock_set_from_us;
}

}  // namespace bmu

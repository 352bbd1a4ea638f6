// Times as people write them on a command line.
//
//   2026-03-01  2026-03-01 17:05  2026-03-01T17:05:09     of this machine's time zone
//   2026-03-01T17:05:09Z                                  UTC
//   now  today  yesterday                                 the days begin at midnight of this machine's time zone
//   -90s  -30min  -2h  -7d                                so long before now
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace bmu {

inline constexpr const char* time_words_form = "2026-03-01 17:05, 2026-03-01T17:05:09Z, now, today, yesterday or -2h";

/// ms since 1970; none if it is no such text.
[[nodiscard]] std::optional<std::int64_t> time_from_words(std::string_view text, std::int64_t now_unix_ms);

/// "2026-03-01 17:05:09", of this machine's time zone.
[[nodiscard]] std::string local_time_text(std::int64_t unix_ms);
/// "2026-03-01T16:05:09Z": UTC.
[[nodiscard]] std::string utc_time_text(std::int64_t unix_ms);

}  // namespace bmu

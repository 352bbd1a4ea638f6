// Times as people write them on a command line, the same for every command, and as they are shown to them.
//
//   2026-03-01  2026-03-01 17:05  2026-03-01T17:05:09     of this machine's time zone
//   2026-03-01T17:05:09Z  2026-03-01 17:05+01:00          UTC, and so far ahead of it
//   now  today  yesterday                                 the days begin at midnight of this machine's time zone
//   -90s  -30min  -2h  -7d                                so long before now
//   begin                                                 of all there is, for a --from
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "protocol/result.hpp"

namespace bmu {

inline constexpr const char* time_words_form =
    "2026-03-01 17:05, 2026-03-01T17:05:09Z, now, today, yesterday, -2h or, for --from, begin";
/// For a --help.
inline constexpr const char* time_words_help =
    R"(Times: 2026-03-01, 2026-03-01 17:05, 2026-03-01T17:05:09 (of this machine's time zone), 2026-03-01T17:05:09Z (UTC),
2026-03-01 17:05+01:00, now, today, yesterday, -90s, -30min, -2h, -7d, and --from begin for all there is.)";

/// ms since 1970; none if it is no such text. `begin` is none: it is no time.
[[nodiscard]] std::optional<std::int64_t> time_from_words(std::string_view text, std::int64_t now_unix_ms);

/// What --from and --to say; what is not there bounds nothing.
struct TimeSpan {
  std::optional<std::int64_t> from_unix_ms;
  std::optional<std::int64_t> to_unix_ms;
};
/// "": not given. The error says which of them is wrong, and what was wanted.
[[nodiscard]] Result<TimeSpan, std::string> time_span_from_words(std::string_view from, std::string_view to,
                                                                 std::int64_t now_unix_ms);

/// "2026-03-01 17:05:09+01:00", of this machine's time zone, and how far that is ahead of UTC then.
[[nodiscard]] std::string local_time_text(std::int64_t unix_ms);
/// "2026-03-01T16:05:09Z": UTC.
[[nodiscard]] std::string utc_time_text(std::int64_t unix_ms);
/// The clock of this machine.
[[nodiscard]] std::int64_t now_in_unix_ms();

}  // namespace bmu

// Times on a command line, in the same form for every command, and times in the output.
//
//   2026-03-01  2026-03-01 17:05  2026-03-01T17:05:09     of this machine's time zone
//   2026-03-01T17:05:09Z  2026-03-01 17:05+01:00          UTC, and an offset ahead of it
//   now  today  yesterday                                 the days begin at midnight of this machine's time zone
//   -90s  -30min  -2h  -7d                                the span before now
//   begin                                                 the start of all data, for a --from
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "protocol/result.hpp"

namespace bmu {

inline constexpr const char* time_words_form =
    "2026-03-01 17:05, 2026-03-01T17:05:09Z, now, today, yesterday, -2h or, for --from, begin";
/// Help text.
inline constexpr const char* time_words_help =
    R"(Times: 2026-03-01, 2026-03-01 17:05, 2026-03-01T17:05:09 (of this machine's time zone), 2026-03-01T17:05:09Z (UTC),
2026-03-01 17:05+01:00, now, today, yesterday, -90s, -30min, -2h, -7d, and --from begin for all there is.)";

/// ms since 1970; none if the text is invalid. `begin` is invalid: it is no time.
[[nodiscard]] std::optional<std::int64_t> time_from_words(std::string_view text, std::int64_t now_unix_ms);

/// Bounds from --from and --to; a missing bound does not limit the span.
struct TimeSpan {
  std::optional<std::int64_t> from_unix_ms;
  std::optional<std::int64_t> to_unix_ms;
};
/// "": not given. The error names the wrong option and the expected form.
[[nodiscard]] Result<TimeSpan, std::string> time_span_from_words(std::string_view from, std::string_view to,
                                                                 std::int64_t now_unix_ms);

/// "2026-03-01 17:05:09+01:00", of this machine's time zone, with its offset to UTC at that time.
[[nodiscard]] std::string local_time_text(std::int64_t unix_ms);
/// "2026-03-01T16:05:09Z": UTC.
[[nodiscard]] std::string utc_time_text(std::int64_t unix_ms);
/// The clock of this machine.
[[nodiscard]] std::int64_t now_in_unix_ms();

}  // namespace bmu

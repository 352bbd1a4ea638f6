// Texts of wall-clock times, and round times for an axis. All of them are UTC: a report may be read in another time
// zone, and an axis must not jump at the change of summer time.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace bmu::report {

/// "2026-03-01 17:05:09"
[[nodiscard]] std::string time_text(std::int64_t at_us);
/// A time that is known only as that of a sample: "2026-03-01 17:05:09", "in the minute from 2026-03-01 17:05".
[[nodiscard]] std::string sample_text(std::int64_t at_us, std::int64_t sample_us);
/// The name of a sample's length: "minute", "10.0 s".
[[nodiscard]] std::string sample_name(std::int64_t sample_us);
/// "17:05:09.250"
[[nodiscard]] std::string clock_text_ms(std::int64_t at_us);
/// "2026-03-01 17:05:09 to 17:05:12 UTC"; with the day of the second one if it differs.
[[nodiscard]] std::string stretch_text(std::int64_t from_us, std::int64_t to_us);
/// "2.4 s", "5 min 3 s", "3 h 20 min", "4 d 7 h".
[[nodiscard]] std::string span_text(std::int64_t span_us);

struct TimeTick {
  std::int64_t at_us = 0;
  std::string text;  // the day if it has changed, else the time
};
/// About `count` round times from end to end.
[[nodiscard]] std::vector<TimeTick> time_ticks(std::int64_t from_us, std::int64_t to_us, int count);

}  // namespace bmu::report

// Output of candump other than log lines (candump.hpp): its screen, as written by `candump can0 >FILE`.
//
//     can0  143   [8]  8E A0 8E 92 8E B2 2A B2                    no time
//   (1700000000.123456)  can0  143   [3]  41 42 43   'ABC'        -t a, -a; with -t d and -t z as (000.001234)
//   (2023-11-14 22:13:20.123456)  can0  RX B -  143  [02]  8E A0  -t A, -x; CAN FD has two digits in its brackets
//     can0  143   [4]  remote request
//     can0  143   {C}  8E A0 8E 92 8E B2 2A B2                    -8: the length code
//     can0  20000004   [8]  00 08 00 00 00 00 60 00   ERRORFRAME  with -e; lines that start with a tab explain it
//
//   DROPCOUNT: dropped 3 CAN frames on 'can0' socket (total drops 7)   -d, on the screen and in a log
//
// Colours (-c), bits (-i), bytes in reverse (-S) and CAN XL are not read.
//
// Pure, no allocation, like the log parser, which parses the line after it was rewritten in log form.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "protocol/candump.hpp"

namespace bmu {

enum class LogTimeForm : std::uint8_t {
  seconds,
  date,  // local time where it was written: time_us is computed as if it were UTC
  none,  // time_us is 0
};

struct ScreenLine {
  LogLine line;
  LogTimeForm time_form = LogTimeForm::seconds;
  bool has_length = true;  // screen output: a line with fewer bytes is damaged; false: a log line
};

/// Buffer in which a screen line is rewritten as a log line. `line` of a ScreenLine points into it.
using ScreenRoom = std::array<char, long_log_line_length_max>;

/// Parses one line without its newline, not blank. Log lines with a date or without a time are accepted, too.
[[nodiscard]] Result<ScreenLine, LogLineDamage> parse_screen_line(std::string_view line, ScreenRoom& room);

/// Whether a damaged line is screen output rather than a log line.
[[nodiscard]] bool is_of_screen(std::string_view line);

/// Frames that candump -d did not receive because its buffer was full.
struct LostFrames {
  std::string_view bus;     // points into the line
  std::uint32_t count = 0;  // since the previous such line
};

inline constexpr std::string_view lost_frames_begin = "DROPCOUNT:";

/// Parses one line without its newline that begins with lost_frames_begin; none if it is damaged.
[[nodiscard]] std::optional<LostFrames> parse_lost_frames(std::string_view line);

/// Whether a line explains the error frame above it.
[[nodiscard]] bool is_error_text(std::string_view line);

}  // namespace bmu

// What candump writes and what is no line of a log (candump.hpp): its screen, as `candump can0 >FILE` leaves it.
//
//     can0  143   [8]  8E A0 8E 92 8E B2 2A B2                    no time
//   (1700000000.123456)  can0  143   [3]  41 42 43   'ABC'        -t a, -a; with -t d and -t z as (000.001234)
//   (2023-11-14 22:13:20.123456)  can0  RX B -  143  [02]  8E A0  -t A, -x; CAN FD has two digits in its brackets
//     can0  143   [4]  remote request
//     can0  143   {C}  8E A0 8E 92 8E B2 2A B2                    -8: the length code
//     can0  20000004   [8]  00 08 00 00 00 00 60 00   ERRORFRAME  with -e, lines with a tab before them explain it
//
//   DROPCOUNT: dropped 3 CAN frames on 'can0' socket (total drops 7)   -d, on the screen and in a log
//
// Colours (-c), bits (-i), bytes in reverse (-S) and CAN XL are not read.
//
// Pure, no allocation, as the reader of logs, which reads the same line in the form of a log.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "protocol/candump.hpp"

namespace bmu {

enum class LogTimeForm : std::uint8_t {
  seconds,
  date,  // of the place where it was written: time_us counts as if that were UTC
  none,  // time_us is 0
};

struct ScreenLine {
  LogLine line;
  LogTimeForm time_form = LogTimeForm::seconds;
  bool has_length = true;  // as a screen has it: a line with fewer bytes is damaged; false: it is of a log
};

/// Where a line of a screen is written as one of a log. `line` of a ScreenLine points into it.
using ScreenRoom = std::array<char, long_log_line_length_max>;

/// One line without its newline, but not a blank one. A line of a log is read, too, with a date or without a time.
[[nodiscard]] Result<ScreenLine, LogLineDamage> parse_screen_line(std::string_view line, ScreenRoom& room);

/// Whether a damaged line is one of a screen rather than of a log.
[[nodiscard]] bool is_of_screen(std::string_view line);

/// Frames that candump -d did not receive, as its buffer was full.
struct LostFrames {
  std::string_view bus;     // points into the line
  std::uint32_t count = 0;  // since the line like this before
};

inline constexpr std::string_view lost_frames_begin = "DROPCOUNT:";

/// One line without its newline that begins so; none if it is damaged.
[[nodiscard]] std::optional<LostFrames> parse_lost_frames(std::string_view line);

/// Whether a line explains the error frame that stands above it.
[[nodiscard]] bool is_error_text(std::string_view line);

}  // namespace bmu

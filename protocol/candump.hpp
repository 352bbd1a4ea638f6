// Lines of a candump log, as `candump -l` writes into a file and `candump -L` to the screen:
//
//   (1700000000.123456) vcan0 143#8EA08E928EB22AB2      data, 11-bit identifier
//   (1700000000.123456) vcan0 18FF50E5#0102 R           29-bit identifier; received (R) or sent (T) with candump -x
//   (1700000000.123456) vcan0 143#R4                    remote frame requesting 4 bytes; R alone requests none
//   (1700000000.123456) vcan0 20000040#0000000000000000 error frame of the controller (bit 29 of the identifier)
//   (1700000000.123456) vcan0 143#8EA08E928EB22AB2_C    eight bytes with the length code C
//   (1700000000.123456) vcan0 143##1AABB                CAN FD: its flags (a digit) and bytes are kept, not decoded
//   (1700000000.123456) can0 45123#81:00:12345678#AABB  CAN XL: the same
//   # a comment                                         and blank lines are ignored
//
// Fields may be separated by several spaces: candump pads bus names to the longest. Other output of candump is read by
// candump_screen.hpp.
//
// Pure, no allocation: the result of the parser points into the given line. A line is accepted completely or rejected.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "protocol/frame.hpp"
#include "protocol/result.hpp"

namespace bmu {

enum class LogLineKind : std::uint8_t {
  nothing,   // blank or a comment
  frame,     // classic CAN
  fd_frame,  // CAN FD or XL: `frame` holds the identifier only, `long_frame` all of it
};

enum class Direction : std::uint8_t { unknown, received, sent };

struct LogLine {
  LogLineKind kind = LogLineKind::nothing;
  Direction direction = Direction::unknown;
  std::uint8_t length_code = 0;  // 9 to 15: the code on the wire, which also means eight bytes; 0: equal to the length
  std::uint32_t number = 0;      // of a frame of a screen without times, from 1; 0: the frame has a time
  std::int64_t time_us = 0;      // as written: since 1970, or since the start of the recording
  std::string_view bus;          // points into the line
  CanFrame frame;
  std::string_view long_frame;  // of an fd_frame: identifier, flags and bytes as written; points into the line
};

inline constexpr std::size_t fd_bytes_max = 64;
inline constexpr std::size_t xl_bytes_max = 2'048;

/// Contents of a `long_frame`.
struct LongFrame {
  bool is_xl = false;
  std::uint8_t flags = 0;   // of CAN FD: 1 faster data phase (BRS), 2 the sender is error-passive (ESI)
  std::string_view digits;  // two per byte; in CAN XL with the dots between bytes, if any
};
[[nodiscard]] LongFrame long_frame_of(const LogLine& line);

/// Writes the data bytes and returns their number.
[[nodiscard]] std::size_t unpack(const LongFrame& frame, std::span<std::uint8_t, xl_bytes_max> out);

/// Element that was expected at the column of the first error in a damaged line.
enum class LogLineWanted : std::uint8_t {
  opening_parenthesis,
  seconds,
  decimal_point,
  fraction,
  closing_parenthesis,
  space,
  bus_name,
  identifier,
  identifier_in_range,
  hash,
  data_byte,
  length_code,
  at_most_8_bytes,
  at_most_2048_bytes,
  direction,
  date,
  length,
  all_bytes,
  letters,
};

[[nodiscard]] std::string_view to_text(LogLineWanted wanted);

struct LogLineDamage {
  LogLineWanted wanted = LogLineWanted::opening_parenthesis;
  std::size_t column = 0;  // from 0; the line's length if it is truncated
};

inline constexpr std::size_t bus_name_length_max = 63;

/// One line without its newline; a carriage return at its end is ignored.
[[nodiscard]] Result<LogLine, LogLineDamage> parse_log_line(std::string_view line);

/// Buffer sizes for the longest line that print_log_line writes, for a classic frame and for any frame.
inline constexpr std::size_t log_line_length_max = 192;
inline constexpr std::size_t long_log_line_length_max = log_line_length_max + 3 * xl_bytes_max;

/// Writes the line of a frame without newline and returns its length. The output parses to the same line.
/// Preconditions: time_us is not negative, the bus name is not longer than bus_name_length_max, and `out` has
/// log_line_length_max bytes, plus the size of `long_frame` for an fd_frame.
[[nodiscard]] std::size_t print_log_line(const LogLine& line, std::span<char> out);

}  // namespace bmu

// Lines of a candump log, as `candump -l` writes into a file and `candump -L` to the screen:
//
//   (1700000000.123456) vcan0 143#8EA08E928EB22AB2      data, 11-bit identifier
//   (1700000000.123456) vcan0 18FF50E5#0102 R           29-bit identifier; received (R) or sent (T) with candump -x
//   (1700000000.123456) vcan0 143#R4                    remote frame asking for 4 bytes; R alone asks for none
//   (1700000000.123456) vcan0 20000040#0000000000000000 error frame of the controller (bit 29 of the identifier)
//   (1700000000.123456) vcan0 143#8EA08E928EB22AB2_C    eight bytes under the length code C
//   (1700000000.123456) vcan0 143##1AABB                CAN FD: its flags (a digit) and bytes are kept, not decoded
//   (1700000000.123456) can0 45123#81:00:12345678#AABB  CAN XL: the same
//   # a comment                                         and blank lines say nothing
//
// Between the fields may be more spaces: candump fills names of buses up to the longest. What else it writes is read by
// candump_screen.hpp.
//
// Pure, no allocation: the parser's answer points into the line it was given. A line is taken whole or not at all.
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
  std::uint8_t length_code = 0;  // 9 to 15: the one on the wire, which means eight bytes, too; 0: the length itself
  std::uint32_t number = 0;      // of a frame of a screen without times, from 1; 0: it has a time
  std::int64_t time_us = 0;      // as written: since 1970, or since the start of the recording
  std::string_view bus;          // points into the line
  CanFrame frame;
  std::string_view long_frame;  // of an fd_frame: identifier, flags and bytes as written; points into the line
};

inline constexpr std::size_t fd_bytes_max = 64;
inline constexpr std::size_t xl_bytes_max = 2'048;

/// What stands in a `long_frame`.
struct LongFrame {
  bool is_xl = false;
  std::uint8_t flags = 0;   // of CAN FD: 1 faster data phase (BRS), 2 the sender is error-passive (ESI)
  std::string_view digits;  // two a byte; of CAN XL with a dot between bytes where there is one
};
[[nodiscard]] LongFrame long_frame_of(const LogLine& line);

/// Writes its bytes and returns how many.
[[nodiscard]] std::size_t unpack(const LongFrame& frame, std::span<std::uint8_t, xl_bytes_max> out);

/// What a damaged line should have had at the column where it stopped making sense.
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
  std::size_t column = 0;  // from 0; the line's length if it ended too soon
};

inline constexpr std::size_t bus_name_length_max = 63;

/// One line without its newline; a carriage return at its end is ignored.
[[nodiscard]] Result<LogLine, LogLineDamage> parse_log_line(std::string_view line);

/// Room for the longest line print_log_line writes of a classic frame, and of any.
inline constexpr std::size_t log_line_length_max = 192;
inline constexpr std::size_t long_log_line_length_max = log_line_length_max + 3 * xl_bytes_max;

/// Writes the line of a frame without newline and returns its length. What it writes parses to the same line again;
/// time_us must not be negative, the bus name not longer than bus_name_length_max. `out` has log_line_length_max bytes,
/// and for an fd_frame as many more as its `long_frame` has.
[[nodiscard]] std::size_t print_log_line(const LogLine& line, std::span<char> out);

}  // namespace bmu

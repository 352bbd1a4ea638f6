// Lines of a candump log, as `candump -l` writes into a file and `candump -L` to the screen:
//
//   (1700000000.123456) vcan0 143#8EA08E928EB22AB2      data, 11-bit identifier
//   (1700000000.123456) vcan0 18FF50E5#0102 R           29-bit identifier; received (R) or sent (T) with candump -x
//   (1700000000.123456) vcan0 143#R4                    remote frame asking for 4 bytes; R alone asks for none
//   (1700000000.123456) vcan0 20000040#0000000000000000 error frame of the controller (bit 29 of the identifier)
//   (1700000000.123456) vcan0 143##1AABB                CAN FD: recognised, not decoded
//   (1700000000.123456) can0 45123#81:00:12345678#AABB  CAN XL: the same
//   # a comment                                         and blank lines say nothing
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
  fd_frame,  // CAN FD or XL: `frame` holds the identifier only
};

enum class Direction : std::uint8_t { unknown, received, sent };

struct LogLine {
  LogLineKind kind = LogLineKind::nothing;
  Direction direction = Direction::unknown;
  std::int64_t time_us = 0;  // as written: since 1970, or since the start of the recording
  std::string_view bus;      // points into the line
  CanFrame frame;
};

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
  direction,
};

[[nodiscard]] std::string_view to_text(LogLineWanted wanted);

struct LogLineDamage {
  LogLineWanted wanted = LogLineWanted::opening_parenthesis;
  std::size_t column = 0;  // from 0; the line's length if it ended too soon
};

inline constexpr std::size_t bus_name_length_max = 63;

/// One line without its newline; a carriage return at its end is ignored.
[[nodiscard]] Result<LogLine, LogLineDamage> parse_log_line(std::string_view line);

/// Room for the longest line print_log_line writes.
inline constexpr std::size_t log_line_length_max = 192;

/// Writes the line of a frame without newline and returns its length. What it writes parses to the same line again;
/// time_us must not be negative, the bus name not longer than bus_name_length_max.
[[nodiscard]] std::size_t print_log_line(const LogLine& line, std::span<char, log_line_length_max> out);

}  // namespace bmu

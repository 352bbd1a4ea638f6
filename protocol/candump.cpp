#include "protocol/candump.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstddef>

#include "protocol/assert.hpp"
#include "protocol/eight_letters.hpp"

namespace bmu {

std::string_view to_text(LogLineWanted wanted) {
  switch (wanted) {
    case LogLineWanted::opening_parenthesis: return "'(' before the time";
    case LogLineWanted::seconds: return "seconds of the time, 1 to 12 digits";
    case LogLineWanted::decimal_point: return "'.' between seconds and fraction";
    case LogLineWanted::fraction: return "6 (or 9) digits of a second";
    case LogLineWanted::closing_parenthesis: return "')' after the time";
    case LogLineWanted::space: return "a space";
    case LogLineWanted::bus_name: return "a bus name of 1 to 63 characters";
    case LogLineWanted::identifier: return "an identifier of 3 or 8 hexadecimal digits";
    case LogLineWanted::identifier_in_range: return "an identifier up to 7FF (3 digits) or 3FFFFFFF (8 digits)";
    case LogLineWanted::hash: return "'#' after the identifier";
    case LogLineWanted::data_byte: return "data bytes of two hexadecimal digits";
    case LogLineWanted::length_code: return "a length code";
    case LogLineWanted::at_most_8_bytes: return "at most 8 data bytes (64 after '##')";
    case LogLineWanted::at_most_2048_bytes: return "at most 2048 data bytes";
    case LogLineWanted::direction: return "the end of the line, or ' R' or ' T'";
    case LogLineWanted::date: return "a date as 2023-11-14 22:13:20";
    case LogLineWanted::length: return "the number of bytes in brackets, 0 to 8 or 00 to 64";
    case LogLineWanted::all_bytes: return "as many bytes, each behind a space, as the brackets have";
    case LogLineWanted::letters: return "the end of the line, ERRORFRAME, or the bytes as letters in quotes";
  }
  return "?";
}

namespace {

constexpr std::uint32_t error_frame_bit = 0x2000'0000;
constexpr std::uint32_t extended_id_max = 0x1FFF'FFFF;
constexpr std::uint8_t no_nibble = 0xFF;
constexpr std::ptrdiff_t xl_digits = 5;

constexpr std::array<std::uint8_t, 256> nibble_table = [] {
  std::array<std::uint8_t, 256> table{};
  table.fill(no_nibble);
  for (unsigned digit = 0; digit < 10; ++digit) table['0' + digit] = static_cast<std::uint8_t>(digit);
  for (unsigned digit = 10; digit < 16; ++digit) {
    table['A' + digit - 10] = static_cast<std::uint8_t>(digit);
    table['a' + digit - 10] = static_cast<std::uint8_t>(digit);
  }
  return table;
}();

constexpr std::uint8_t nibble_of(char letter) {
  return nibble_table[static_cast<std::uint8_t>(letter)];
}

/// Parser that walks a line once. Every step returns whether it found what it expected; if not, the first error is kept
/// with its column and later steps are not tried. Some steps first try the most common form, eight characters at once:
/// that either consumes all of it, or nothing and gives no reason.
class Cursor {
 public:
  explicit Cursor(std::string_view line) : begin_(line.data()), at_(begin_), end_(begin_ + line.size()) {}

  bool parse(LogLine& out) {
    out.kind = LogLineKind::frame;
    return parse_time(out.time_us) && expect_spaces() && parse_bus(out.bus) && expect_spaces() && parse_frame(out) &&
           parse_extras(out.direction);
  }
  [[nodiscard]] LogLineDamage damage() const { return {wanted_, static_cast<std::size_t>(at_ - begin_)}; }

 private:
  [[nodiscard]] bool has(std::ptrdiff_t letters) const { return end_ - at_ >= letters; }
  [[nodiscard]] char peek() const { return at_ < end_ ? *at_ : '\0'; }
  bool fail(LogLineWanted wanted) {
    wanted_ = wanted;
    return false;
  }
  bool expect(char letter, LogLineWanted wanted) {
    if (at_ == end_ || *at_ != letter) return fail(wanted);
    ++at_;
    return true;
  }

  /// One space, or several where candump pads bus names to one length.
  bool expect_spaces() {
    if (!expect(' ', LogLineWanted::space)) return false;
    while (peek() == ' ') ++at_;
    return true;
  }

  /// Parses up to `count_max` decimal digits and returns their number.
  int parse_digits(std::int64_t& number, int count_max) {
    int count = 0;
    for (; count < count_max && at_ < end_ && *at_ >= '0' && *at_ <= '9'; ++count, ++at_) {
      number = number * 10 + (*at_ - '0');
    }
    return count;
  }

  /// "(1700000000.123456)", the form of present-day times: twice eight digits at once, the ninth and tenth moved over
  /// the point. Any other time is left to parse_time.
  bool parse_usual_time(std::int64_t& time_us) {
    constexpr std::ptrdiff_t length = 19;
    if (!has(length) || at_[0] != '(' || at_[11] != '.' || at_[length - 1] != ')') return false;
    const std::uint64_t high = load_letters(at_ + 1);
    const std::uint64_t ninth_and_tenth = load_letters(at_ + 3) << 48U;
    const std::uint64_t low = (load_letters(at_ + 10) & mask_of(48)) | ninth_and_tenth;
    if (!are_decimal(high) || !are_decimal(low)) return false;
    time_us = std::int64_t{decimal_number(high)} * 100'000'000 + decimal_number(low);
    at_ += length;
    return true;
  }

  bool parse_time(std::int64_t& time_us) {
    if (parse_usual_time(time_us)) return true;
    if (!expect('(', LogLineWanted::opening_parenthesis)) return false;
    std::int64_t seconds = 0;
    if (parse_digits(seconds, 12) == 0) return fail(LogLineWanted::seconds);
    if (!expect('.', LogLineWanted::decimal_point)) return false;
    std::int64_t fraction = 0;
    if (parse_digits(fraction, 6) != 6) return fail(LogLineWanted::fraction);
    std::int64_t below_us = 0;
    const int more = parse_digits(below_us, 3);
    if (more != 0 && more != 3) return fail(LogLineWanted::fraction);
    time_us = seconds * 1'000'000 + fraction;
    return expect(')', LogLineWanted::closing_parenthesis);
  }

  /// The first characters of the name are skipped at once while they are ASCII.
  bool parse_bus(std::string_view& bus) {
    const char* const first = at_;
    if (has(letters_at_once)) at_ += marked_at_start(marks_between(load_letters(at_), '!', '~'));
    while (at_<end_&& static_cast<unsigned char>(*at_)> ' ' && *at_ != '\x7F') ++at_;
    const auto length = static_cast<std::size_t>(at_ - first);
    if (length > bus_name_length_max) at_ = first;
    if (length == 0 || length > bus_name_length_max) return fail(LogLineWanted::bus_name);
    bus = {first, length};
    return true;
  }

  /// "143#": three digits up to 7FF, the most common form. Any other is left to parse_identifier.
  bool parse_usual_identifier(CanFrame& frame) {
    constexpr std::ptrdiff_t length = 3;
    if (!has(length + 1) || at_[length] != '#') return false;
    const std::uint32_t high = nibble_of(at_[0]);
    const std::uint32_t middle = nibble_of(at_[1]);
    const std::uint32_t low = nibble_of(at_[2]);
    if (high > 7 || middle == no_nibble || low == no_nibble) return false;
    frame.id = (high << 8) | (middle << 4) | low;
    at_ += length;
    return true;
  }

  bool parse_identifier(CanFrame& frame) {
    if (parse_usual_identifier(frame)) return true;
    const char* const first = at_;
    std::uint32_t id = 0;
    for (; at_ < end_ && at_ - first < 8 && nibble_of(*at_) != no_nibble; ++at_) id = (id << 4) | nibble_of(*at_);
    const auto digits = at_ - first;
    if (digits == xl_digits && begins_xl_payload()) {
      is_xl_ = true;
      frame.id = id & 0x7FF;  // the priority; the bits above it are the number of the virtual network
      return true;
    }
    if (digits != 3 && digits != 8) return fail(LogLineWanted::identifier);
    frame.is_error = digits == 8 && (id & ~extended_id_max) == error_frame_bit;
    frame.is_extended = digits == 8 && !frame.is_error;
    frame.id = frame.is_error ? id & extended_id_max : id;
    if (frame.id > (digits == 3 ? 0x7FFU : extended_id_max)) {
      at_ = first;
      return fail(LogLineWanted::identifier_in_range);
    }
    return true;
  }

  bool parse_frame(LogLine& out) {
    const char* const first = at_;
    if (!parse_identifier(out.frame) || !expect('#', LogLineWanted::hash) || !parse_payload(out)) return false;
    if (out.kind == LogLineKind::fd_frame) out.long_frame = {first, static_cast<std::size_t>(at_ - first)};
    return true;
  }

  /// "#81:"; five digits without it are an error.
  [[nodiscard]] bool begins_xl_payload() const { return end_ - at_ >= 4 && at_[0] == '#' && at_[3] == ':'; }

  bool parse_payload(LogLine& out) {
    if (is_xl_) return parse_xl(out);
    switch (peek()) {
      case '#': ++at_; return parse_fd(out);
      case 'R': ++at_; return parse_remote(out);
      default: return parse_data(out.frame) && parse_raw_length_code(out);
    }
  }

  /// Parses eight bytes at once, the most common case. Fewer, or anything else, is left to parse_data.
  std::size_t parse_eight_bytes(CanFrame& frame) {
    if (!has(2 * letters_at_once)) return 0;
    const std::uint64_t high = load_letters(at_);
    const std::uint64_t low = load_letters(at_ + letters_at_once);
    if (!are_hex(high) || !are_hex(low)) return 0;
    frame.data = store_big_endian((std::uint64_t{hex_number(high)} << 32) | hex_number(low));
    at_ += 2 * letters_at_once;
    return frame.data.size();
  }

  bool parse_data(CanFrame& frame) {
    std::size_t count = parse_eight_bytes(frame);
    while (end_ - at_ >= 2 && nibble_of(at_[0]) != no_nibble) {
      const std::uint8_t low = nibble_of(at_[1]);
      if (low == no_nibble) break;
      if (count == frame.data.size()) return fail(LogLineWanted::at_most_8_bytes);
      frame.data[count++] = static_cast<std::uint8_t>((nibble_of(at_[0]) << 4) | low);
      at_ += 2;
    }
    frame.length = static_cast<std::uint8_t>(count);
    return at_ == end_ || nibble_of(*at_) == no_nibble || fail(LogLineWanted::data_byte);
  }

  bool parse_remote(LogLine& out) {
    out.frame.is_remote = true;
    if (peek() < '0' || peek() > '9') return true;
    if (*at_ > '8') return fail(LogLineWanted::length_code);
    out.frame.length = static_cast<std::uint8_t>(*at_++ - '0');
    return parse_raw_length_code(out);
  }

  /// "_C" after eight bytes: the length code 9 to F that was on the wire, which also means eight.
  bool parse_raw_length_code(LogLine& out) {
    if (peek() != '_') return true;
    ++at_;
    const std::uint8_t code = nibble_of(peek());
    if (out.frame.length != 8 || code <= 8 || code == no_nibble) return fail(LogLineWanted::length_code);
    out.length_code = code;
    ++at_;
    return true;
  }

  bool parse_fd(LogLine& out) {
    out.kind = LogLineKind::fd_frame;
    if (nibble_of(peek()) == no_nibble) return fail(LogLineWanted::data_byte);  // the flags: one digit
    ++at_;
    return parse_long_data(fd_bytes_max, false, LogLineWanted::at_most_8_bytes);
  }

  /// CAN XL: flags, service data unit type, acceptance field, then data, optionally with a dot between bytes.
  bool parse_xl(LogLine& out) {
    out.kind = LogLineKind::fd_frame;
    if (!skip_digits(2) || !expect(':', LogLineWanted::data_byte) || !skip_digits(2) ||
        !expect(':', LogLineWanted::data_byte) || !skip_digits(8) || !expect('#', LogLineWanted::hash)) {
      return false;
    }
    return parse_long_data(xl_bytes_max, true, LogLineWanted::at_most_2048_bytes);
  }
  bool parse_long_data(std::size_t bytes_max, bool may_have_dots, LogLineWanted wanted) {
    for (std::size_t bytes = 0; at_ < end_; ++bytes) {
      if (may_have_dots && bytes > 0 && *at_ == '.') ++at_;
      if (nibble_of(peek()) == no_nibble) return true;
      if (bytes == bytes_max) return fail(wanted);
      if (!skip_digits(2)) return false;
    }
    return true;
  }
  bool skip_digits(int count) {
    for (; count > 0; --count, ++at_) {
      if (nibble_of(peek()) == no_nibble) return fail(LogLineWanted::data_byte);
    }
    return true;
  }

  /// " R" or " T", and for CAN FD " B" and " E"; trailing spaces are accepted.
  bool parse_extras(Direction& direction) {
    for (; at_ < end_; ++at_) {
      if (*at_ == ' ') continue;
      if (at_[-1] != ' ') return fail(LogLineWanted::direction);
      switch (*at_) {
        case 'R': direction = Direction::received; break;
        case 'T': direction = Direction::sent; break;
        case 'B':
        case 'E': break;
        default: return fail(LogLineWanted::direction);
      }
    }
    return true;
  }

  const char* begin_;
  const char* at_;
  const char* end_;
  bool is_xl_ = false;
  LogLineWanted wanted_ = LogLineWanted::opening_parenthesis;
};

bool says_nothing(std::string_view line) {
  if (line.starts_with('#')) return true;
  return std::all_of(line.begin(), line.end(), [](char letter) { return letter == ' ' || letter == '\t'; });
}

}  // namespace

Result<LogLine, LogLineDamage> parse_log_line(std::string_view line) {
  if (line.ends_with('\r')) line.remove_suffix(1);
  Result<LogLine, LogLineDamage> parsed;
  if (says_nothing(line)) return parsed;
  Cursor cursor(line);
  if (!cursor.parse(*parsed)) parsed = failure(cursor.damage());  // single return: the result is constructed in place
  return parsed;
}

LongFrame long_frame_of(const LogLine& line) {
  const std::string_view text = line.long_frame;
  const std::size_t hash = text.find('#');
  const bool is_xl = text.substr(hash + 1, 1) != "#";
  if (is_xl) return {.is_xl = true, .digits = text.substr(text.rfind('#') + 1)};
  return {.flags = nibble_of(text[hash + 2]), .digits = text.substr(hash + 3)};
}

std::size_t unpack(const LongFrame& frame, std::span<std::uint8_t, xl_bytes_max> out) {
  std::size_t count = 0;
  for (std::size_t at = 0; at + 1 < frame.digits.size(); at += 2) {
    if (frame.digits[at] == '.') ++at;
    out[count++] = static_cast<std::uint8_t>((nibble_of(frame.digits[at]) << 4) | nibble_of(frame.digits[at + 1]));
  }
  return count;
}

namespace {

constexpr std::string_view hex_digits = "0123456789ABCDEF";

class LinePrinter {
 public:
  explicit LinePrinter(char* out) : begin_(out), at_(out) {}

  void letter(char one) { *at_++ = one; }
  void text(std::string_view some) { at_ = std::copy(some.begin(), some.end(), at_); }
  void hex(std::uint32_t number, int digits) {
    while (digits-- > 0) letter(hex_digits[(number >> (4 * digits)) & 0xF]);
  }
  void decimal(std::int64_t number) { at_ = std::to_chars(at_, at_ + 20, number).ptr; }
  void fraction(std::int64_t number) {
    for (std::int64_t weight = 100'000; weight > 0; weight /= 10) {
      letter(static_cast<char>('0' + number / weight % 10));
    }
  }
  [[nodiscard]] std::size_t length() const { return static_cast<std::size_t>(at_ - begin_); }

 private:
  char* begin_;
  char* at_;
};

void print_payload(const CanFrame& frame, LinePrinter& out) {
  if (frame.is_remote) {
    out.letter('R');
    if (frame.length > 0) out.decimal(frame.length);
    return;
  }
  for (std::size_t index = 0; index < frame.length; ++index) out.hex(frame.data[index], 2);
}

void print_frame(const LogLine& line, LinePrinter& out) {
  if (line.kind == LogLineKind::fd_frame) return out.text(line.long_frame);
  const CanFrame& frame = line.frame;
  const std::uint32_t id = frame.id | (frame.is_error ? error_frame_bit : 0);
  out.hex(id, frame.is_extended || frame.is_error ? 8 : 3);
  out.letter('#');
  print_payload(frame, out);
  if (line.length_code == 0) return;
  out.letter('_');
  out.hex(line.length_code, 1);
}

}  // namespace

std::size_t print_log_line(const LogLine& line, std::span<char> out) {
  BMU_ASSERT(line.time_us >= 0 && line.bus.size() <= bus_name_length_max && line.frame.length <= 8);
  BMU_ASSERT(out.size() >= log_line_length_max + line.long_frame.size());
  LinePrinter printer(out.data());
  printer.letter('(');
  printer.decimal(line.time_us / 1'000'000);
  printer.letter('.');
  printer.fraction(line.time_us % 1'000'000);
  printer.text(") ");
  printer.text(line.bus);
  printer.letter(' ');
  print_frame(line, printer);
  if (line.direction == Direction::received) printer.text(" R");
  if (line.direction == Direction::sent) printer.text(" T");
  return printer.length();
}

}  // namespace bmu

#include "protocol/candump_screen.hpp"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cstddef>
#include <optional>

#include "protocol/number_text.hpp"

namespace bmu {
namespace {

constexpr std::string_view error_mark = "ERRORFRAME";
constexpr std::string_view remote_mark = "remote request";
constexpr std::size_t time_length_max = 32;
constexpr std::string_view date_example = "(2023-11-14 22:13:20.";

bool is_hex(char letter) {
  return (letter >= '0' && letter <= '9') || (letter >= 'A' && letter <= 'F') || (letter >= 'a' && letter <= 'f');
}

/// "(2023-11", regardless of the text after it.
bool begins_with_date(std::string_view text) {
  return text.size() > 5 && text[0] == '(' && text[5] == '-';
}

/// Walks a line once and rewrites it as a log line. Each step returns whether it found what it expected; if not, later
/// steps are not tried.
class Rewriter {
 public:
  Rewriter(std::string_view line, ScreenRoom& room) : line_(line), room_(&room) {}

  bool rewrite() {
    skip_spaces();
    return take_time() && take_bus() && take_flags() && take_frame();
  }
  [[nodiscard]] std::string_view log_line() const { return {room_->data(), length_}; }
  [[nodiscard]] LogTimeForm time_form() const { return time_form_; }
  [[nodiscard]] bool has_length() const { return has_length_; }
  [[nodiscard]] LogLineDamage damage() const { return {wanted_, at_}; }

  /// Maps an error in the log line to its position in the original line.
  [[nodiscard]] LogLineDamage origin_of(const LogLineDamage& damage) const {
    std::size_t next = 0;
    while (next < copy_count_ && copies_[next].to <= damage.column) ++next;
    if (next == 0) return {damage.wanted, 0};
    const Copy& copy = copies_[next - 1];
    return {damage.wanted, std::min(copy.from + damage.column - copy.to, line_.size())};
  }

 private:
  /// Text that was copied unchanged: an error in it has a position in the original line.
  struct Copy {
    std::size_t from = 0;
    std::size_t to = 0;
  };

  bool fail(LogLineWanted wanted) {
    wanted_ = wanted;
    return false;
  }
  [[nodiscard]] char peek() const { return at_ < line_.size() ? line_[at_] : '\0'; }
  [[nodiscard]] std::string_view left() const { return line_.substr(at_); }
  void skip_spaces() { at_ = std::min(line_.find_first_not_of(' ', at_), line_.size()); }
  bool expect_spaces() {
    if (peek() != ' ') return fail(LogLineWanted::space);
    skip_spaces();
    return true;
  }
  /// Remaining text up to the next character of `ends`.
  [[nodiscard]] std::string_view word(std::string_view ends = " ") const {
    return left().substr(0, left().find_first_of(ends));
  }
  bool write(std::string_view text) {
    if (room_->size() - length_ < text.size()) return fail(LogLineWanted::at_most_2048_bytes);
    length_ = static_cast<std::size_t>(std::copy(text.begin(), text.end(), room_->data() + length_) - room_->data());
    return true;
  }
  bool write_number(std::uint32_t number) {
    std::array<char, 12> digits{};
    return write({digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), number).ptr});
  }
  /// Copies the text unchanged.
  bool copy(std::string_view text) {
    copies_[copy_count_++] = {.from = at_, .to = length_};
    if (!write(text)) return false;
    at_ += text.size();
    return true;
  }

  bool take_time() {
    if (peek() != '(') {
      time_form_ = LogTimeForm::none;
      return write("(0.000000)");
    }
    if (begins_with_date(left())) {
      time_form_ = LogTimeForm::date;
      if (!take_date()) return false;
    }
    const std::size_t end = left().substr(0, time_length_max).find(')');
    if (end == std::string_view::npos) {
      at_ = std::min(at_ + time_length_max, line_.size());
      return fail(LogLineWanted::closing_parenthesis);
    }
    return copy(left().substr(0, end + 1)) && (peek() == ' ' || fail(LogLineWanted::space));
  }

  /// Rewrites "(2023-11-14 22:13:20" as "(1700000000".
  bool take_date() {
    const std::string_view text = left().substr(0, date_example.size());
    for (std::size_t index = 0; index < date_example.size(); ++index) {
      const bool is_digit = date_example[index] >= '0' && date_example[index] <= '9';
      const char letter = index < text.size() ? text[index] : '\0';
      if (is_digit ? letter >= '0' && letter <= '9' : letter == date_example[index]) continue;
      at_ += std::min(index, text.size());
      return fail(LogLineWanted::date);
    }
    const auto number = [text](std::size_t at, std::size_t digits) {
      return number_of_text<std::uint32_t>(text.substr(at, digits), 10).value_or(0);
    };
    const std::chrono::year_month_day day(std::chrono::year(static_cast<int>(number(1, 4))),
                                          std::chrono::month(number(6, 2)), std::chrono::day(number(9, 2)));
    const std::int64_t hour = number(12, 2), minute = number(15, 2), second = number(18, 2);
    const bool is_time = hour < 24 && minute < 60 && second <= 60;  // 60: a leap second
    if (!day.ok() || day.year() < std::chrono::year(1970) || !is_time) return fail(LogLineWanted::date);
    const std::int64_t day_s = std::int64_t{std::chrono::sys_days(day).time_since_epoch().count()} * 86'400;
    std::array<char, 24> digits{};
    const std::int64_t time_s = day_s + hour * 3'600 + minute * 60 + second;
    const char* const end = std::to_chars(digits.data(), digits.data() + digits.size(), time_s).ptr;
    at_ += date_example.size() - 1;
    return write("(") && write({digits.data(), end});
  }

  bool take_bus() {
    skip_spaces();
    if (at_ == line_.size()) return fail(LogLineWanted::bus_name);
    return write(" ") && copy(word()) && expect_spaces();
  }

  /// "RX - -" or "TX B E", printed with -x.
  bool take_flags() {
    const std::string_view direction = word();
    if (direction != "RX" && direction != "TX") return true;
    direction_ = direction == "RX" ? " R" : " T";
    at_ += direction.size();
    skip_spaces();
    for (int count = 0; count < 2 && (word() == "-" || word() == "B" || word() == "E"); ++count) {
      fd_flags_ |= peek() == 'B' ? 1U : peek() == 'E' ? 2U : 0U;
      ++at_;
      skip_spaces();
    }
    return true;
  }

  bool take_frame() {
    if (!write(" ") || !copy(word(" #"))) return false;
    has_length_ = peek() != '#';
    if (!has_length_) return copy(left());
    return expect_spaces() && take_length() && take_payload() && take_letters() && write(direction_);
  }

  bool take_length() {
    const bool is_code = peek() == '{';
    const std::string_view number = left().substr(std::min<std::size_t>(left().size(), 1));
    const std::size_t digits = number.find(is_code ? '}' : ']');
    const std::size_t digits_max = is_code ? 1 : 2;
    const bool is_torn = digits == std::string_view::npos && number.size() <= digits_max;
    if (is_torn) at_ = line_.size();
    if (is_torn || (!is_code && peek() != '[') || digits < 1 || digits > digits_max) return fail(LogLineWanted::length);
    const auto count = number_of_text<std::uint32_t>(number.substr(0, digits), is_code ? 16 : 10);
    is_fd_ = digits == 2;
    if (!count || *count > (is_fd_ ? fd_bytes_max : is_code ? 15 : 8)) return fail(LogLineWanted::length);
    if (is_code && *count > 8) length_code_ = number.front();
    byte_count_ = is_fd_ ? *count : std::min<std::uint32_t>(*count, 8);
    at_ += digits + 2;
    return true;
  }

  bool take_payload() {
    if (!write(is_fd_ ? "##" : "#") || (is_fd_ && !write_number(fd_flags_))) return false;
    if (const std::size_t begin = std::min(line_.find_first_not_of(' ', at_), line_.size());
        !is_fd_ && line_.substr(begin).starts_with(remote_mark)) {
      at_ = begin + remote_mark.size();
      is_remote_ = true;
      return write("R") && write_number(byte_count_) && write_length_code();
    } else if (!is_fd_ && begin < line_.size() && remote_mark.starts_with(line_.substr(begin))) {
      at_ = line_.size();
      return fail(LogLineWanted::all_bytes);
    }
    for (std::uint32_t count = 0; count < byte_count_; ++count) {
      const bool has_space = peek() == ' ';
      skip_spaces();
      const std::string_view byte = word();
      const bool is_byte = byte.size() == 2 && is_hex(byte[0]) && is_hex(byte[1]);
      if (!has_space || !is_byte) return fail(LogLineWanted::all_bytes);
      if (!write(byte)) return false;
      at_ += byte.size();
    }
    return write_length_code();
  }
  bool write_length_code() { return length_code_ == '\0' || (write("_") && write({&length_code_, 1})); }

  /// Skips the text after the bytes, which is redundant.
  bool take_letters() {
    const std::size_t end_of_bytes = at_;
    skip_spaces();
    if (left().starts_with(error_mark)) {
      at_ += error_mark.size();
    } else if (peek() == '\'' && !is_remote_) {
      if (left().size() < byte_count_ + 2 || left()[byte_count_ + 1] != '\'') {
        at_ = line_.size();
        return fail(LogLineWanted::letters);
      }
      at_ += byte_count_ + 2;
    } else if (at_ < line_.size() && at_ == end_of_bytes) {
      return fail(LogLineWanted::letters);
    }
    skip_spaces();
    return at_ == line_.size() || fail(LogLineWanted::letters);
  }

  std::string_view line_;
  ScreenRoom* room_;
  std::size_t at_ = 0;
  std::size_t length_ = 0;  // of the rewritten line
  std::array<Copy, 4> copies_{};
  std::size_t copy_count_ = 0;
  LogLineWanted wanted_ = LogLineWanted::bus_name;
  LogTimeForm time_form_ = LogTimeForm::seconds;
  std::string_view direction_;
  std::uint32_t fd_flags_ = 0;
  std::uint32_t byte_count_ = 0;
  char length_code_ = '\0';
  bool is_fd_ = false;
  bool is_remote_ = false;
  bool has_length_ = true;
};

}  // namespace

Result<ScreenLine, LogLineDamage> parse_screen_line(std::string_view line, ScreenRoom& room) {
  if (line.ends_with('\r')) line.remove_suffix(1);
  Rewriter rewriter(line, room);
  if (!rewriter.rewrite()) return failure(rewriter.damage());
  const auto parsed = parse_log_line(rewriter.log_line());
  if (!parsed) return failure(rewriter.origin_of(parsed.error()));
  return ScreenLine{*parsed, rewriter.time_form(), rewriter.has_length()};
}

bool is_of_screen(std::string_view line) {
  line.remove_prefix(std::min(line.find_first_not_of(' '), line.size()));
  return begins_with_date(line) || line.find(" [") != std::string_view::npos ||
         line.find(" {") != std::string_view::npos;
}

std::optional<LostFrames> parse_lost_frames(std::string_view line) {
  if (line.ends_with('\r')) line.remove_suffix(1);
  /// Consumes the text up to the next `end`, and `end` as well.
  const auto take_until = [&line](std::string_view end) -> std::optional<std::string_view> {
    const std::size_t at = line.find(end);
    if (at == std::string_view::npos) return std::nullopt;
    const std::string_view taken = line.substr(0, at);
    line.remove_prefix(at + end.size());
    return taken;
  };
  const auto nothing = take_until("DROPCOUNT: dropped ");
  const auto count = take_until(" CAN frame");
  const auto plural = take_until(" on '");
  const auto bus = take_until("' socket (total drops ");
  const auto total = take_until(")");
  if (!nothing || !count || !plural || !bus || !total || !nothing->empty() || !line.empty()) return std::nullopt;
  const auto frames = number_of_text<std::uint32_t>(*count);
  if (!frames || !number_of_text<std::uint32_t>(*total)) return std::nullopt;
  if (bus->empty() || bus->size() > bus_name_length_max) return std::nullopt;
  return LostFrames{*bus, *frames};
}

bool is_error_text(std::string_view line) {
  return line.starts_with('\t');
}

}  // namespace bmu

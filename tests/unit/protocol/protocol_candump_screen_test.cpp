// Screen output of candump is read like the equivalent log line, and damage is reported with its column.
#include <array>
#include <memory>
#include <string>

#include "protocol/candump_screen.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/worked_frames.hpp"

namespace {

using namespace bmu;
using namespace bmu::test;

ScreenRoom room;

ScreenLine screen(std::string_view text) {
  const auto line = parse_screen_line(text, room);
  INFO(text);
  REQUIRE(line.has_value());
  return *line;
}

/// Equivalent log line.
std::string as_log(std::string_view text) {
  const ScreenLine parsed = screen(text);
  std::array<char, long_log_line_length_max> out{};
  return {out.data(), print_log_line(parsed.line, out)};
}

std::string damage(std::string_view text) {
  const auto line = parse_screen_line(text, room);
  if (line.has_value()) return "none";
  return std::to_string(line.error().column + 1) + ": " + std::string(to_text(line.error().wanted));
}

}  // namespace

TEST_CASE("each form of candump's screen is read as its log line", "[unit][protocol][candump]") {
  CHECK(as_log("  can0  143   [8]  8E A0 8E 92 8E B2 2A B2") == "(0.000000) can0 143#8EA08E928EB22AB2");
  CHECK(as_log("vcan10       143   [2]  8E A0\r") == "(0.000000) vcan10 143#8EA0");
  CHECK(as_log("  can0  143   [0]") == "(0.000000) can0 143#");
  CHECK(as_log("  can0  143   [0] ") == "(0.000000) can0 143#");
  CHECK(as_log("(1700000000.123456)  can0  18FF50E5   [1]  01") == "(1700000000.123456) can0 18FF50E5#01");
  CHECK(as_log(" (012.000500)  can0  143   [1]  01") == "(12.000500) can0 143#01");
  CHECK(as_log("  can0  143   [3]  41 42 43                  'ABC'") == "(0.000000) can0 143#414243");
  CHECK(as_log("  can0  143   [3]  27 20 27                  '' ''") == "(0.000000) can0 143#272027");
  CHECK(as_log("  can0  143   [0]                             ''") == "(0.000000) can0 143#");
  CHECK(as_log("  can0  143   [0]  remote request") == "(0.000000) can0 143#R");
  CHECK(as_log("  can0  143   [8]  remote request") == "(0.000000) can0 143#R8");
  CHECK(as_log("  can0  143   {C}  01 02 03 04 05 06 07 08") == "(0.000000) can0 143#0102030405060708_C");
  CHECK(as_log("  can0  143   {3}  01 02 03") == "(0.000000) can0 143#010203");
  CHECK(as_log("  can0  143   {F}  remote request") == "(0.000000) can0 143#R8_F");
  CHECK(as_log("  can0  20000004   [8]  00 08 00 00 00 00 60 00   ERRORFRAME") ==
        "(0.000000) can0 20000004#0008000000006000");
  CHECK(as_log("  can0  143  [02]  8E A0") == "(0.000000) can0 143##08EA0");
  CHECK(as_log("  can0  143  [00]") == "(0.000000) can0 143##0");
}

TEST_CASE("candump -x gives the direction, and of CAN FD the flags", "[unit][protocol][candump]") {
  CHECK(as_log("  can0  RX - -  143   [1]  01") == "(0.000000) can0 143#01 R");
  CHECK(as_log("  can0  TX - -  143   [1]  01   '.'") == "(0.000000) can0 143#01 T");
  CHECK(as_log("  can0  TX B -  143  [01]  01") == "(0.000000) can0 143##101 T");
  CHECK(as_log("  can0  RX - E  143  [01]  01") == "(0.000000) can0 143##201 R");
  CHECK(as_log("  can0  RX B E  143  [01]  01") == "(0.000000) can0 143##301 R");
  CHECK(as_log("  can0  RX  143   [1]  01") == "(0.000000) can0 143#01 R");
}

TEST_CASE("a date counts as if it were that of UTC", "[unit][protocol][candump]") {
  const ScreenLine line = screen(" (2023-11-14 22:13:20.123456)  can0  RX - -  143   [1]  01");
  CHECK(line.time_form == LogTimeForm::date);
  CHECK(line.line.time_us == 1'700'000'000'123'456);
  CHECK(screen("(1970-01-01 00:00:00.000000)  can0  143   [0]").line.time_us == 0);
  CHECK(screen("(2024-02-29 23:59:60.000001) can0 143#01").line.time_us == 1'709'251'200'000'001);  // from a log
  CHECK(screen("  can0  143   [0]").time_form == LogTimeForm::none);
  CHECK(screen("(1.000000)  can0  143   [0]").time_form == LogTimeForm::seconds);
  CHECK(damage("(2023-02-29 22:13:20.000000)  can0  143   [0]") == "1: a date as 2023-11-14 22:13:20");
  CHECK(damage("(1969-12-31 22:13:20.000000)  can0  143   [0]") == "1: a date as 2023-11-14 22:13:20");
  CHECK(damage("(2023-11-14T22:13:20.000000)  can0  143   [0]") == "12: a date as 2023-11-14 22:13:20");
  CHECK(damage("(2023-11-1") == "11: a date as 2023-11-14 22:13:20");
  CHECK(damage("(2023-11-14 22:13:20.12)  can0  143   [0]") == "24: 6 (or 9) digits of a second");
}

TEST_CASE("a log without times is read by the same", "[unit][protocol][candump]") {
  CHECK(as_log("can0 143#R4 T") == "(0.000000) can0 143#R4 T");
  CHECK(as_log("  can0  143##1AABB") == "(0.000000) can0 143##1AABB");
}

TEST_CASE("damage of a screen is named with its column", "[unit][protocol][candump]") {
  CHECK(damage("") == "1: a bus name of 1 to 63 characters");
  CHECK(damage("  can0") == "7: a space");
  CHECK(damage("(1.000000)can0  143   [0]") == "11: a space");
  CHECK(damage("(1.000000  can0  143   [0]") == "27: ')' after the time");
  CHECK(damage("(1.00000)  can0  143   [0]") == "9: 6 (or 9) digits of a second");
  CHECK(damage(std::string(64, 'x') + "  143   [0]") == "1: a bus name of 1 to 63 characters");
  CHECK(damage("  can0  143") == "12: a space");
  CHECK(damage("  can0  143   ") == "15: the number of bytes in brackets, 0 to 8 or 00 to 64");
  CHECK(damage("  can0  143   01 02") == "15: the number of bytes in brackets, 0 to 8 or 00 to 64");
  CHECK(damage("  can0  143   [9]  01") == "15: the number of bytes in brackets, 0 to 8 or 00 to 64");
  CHECK(damage("  can0  143  [65]  01") == "14: the number of bytes in brackets, 0 to 8 or 00 to 64");
  CHECK(damage("  can0  143  [0012] (00|81:00:12345678) 01") ==
        "14: the number of bytes in brackets, 0 to 8 or 00 to 64");
  CHECK(damage("  can0  143   [8") == "17: the number of bytes in brackets, 0 to 8 or 00 to 64");
  CHECK(damage("  can0  14   [0]") == "11: an identifier of 3 or 8 hexadecimal digits");
  CHECK(damage("  can0  1G3   [0]") == "10: an identifier of 3 or 8 hexadecimal digits");
  CHECK(damage("  can0  800   [0]") == "9: an identifier up to 7FF (3 digits) or 3FFFFFFF (8 digits)");
  CHECK(damage("  can0  143   [3]  01 02") == "25: as many bytes, each behind a space, as the brackets have");
  CHECK(damage("  can0  143   [3]  01 02 0") == "26: as many bytes, each behind a space, as the brackets have");
  CHECK(damage("  can0  143   [2]  0102") == "20: as many bytes, each behind a space, as the brackets have");
  CHECK(damage("  can0  143   [2]  01 02 03") ==
        "26: the end of the line, ERRORFRAME, or the bytes as letters in quotes");
  CHECK(damage("  can0  143   [1]  41   'A") ==
        "27: the end of the line, ERRORFRAME, or the bytes as letters in quotes");
  CHECK(damage("  can0  143   [2]  41`42") == "20: as many bytes, each behind a space, as the brackets have");     // -S
  CHECK(damage("  can0  143   [1]  01000001") == "20: as many bytes, each behind a space, as the brackets have");  // -i
  CHECK(damage("  can0  143#01 X") == "16: the end of the line, or ' R' or ' T'");
  CHECK(damage("(1.000000)  can0  143#" + std::string(10'000, '0')) == "22: at most 2048 data bytes");
}

TEST_CASE("no beginning of a line of a screen is a shorter frame", "[unit][protocol][candump]") {
  for (const std::string whole :
       {" (2023-11-14 22:13:20.000000)  can0  RX - -  143   [8]  8E A0 8E 92 8E B2 2A B2",
        "  can0  143  [12]  01 02 03 04 05 06 07 08 09 0A 0B 0C", "  can0  143   [8]  remote request"}) {
    for (std::size_t length = 0; length < whole.size(); ++length) {
      const auto line = parse_screen_line(std::string_view(whole).substr(0, length), room);
      REQUIRE_FALSE(line.has_value());
      CHECK(line.error().column <= length);
    }
  }
}

TEST_CASE("random and mutated lines of a screen never crash the parser", "[unit][protocol][candump]") {
  Random random(5);
  const std::string_view good_lines[] = {" (2023-11-14 22:13:20.000000)  can0  RX - E  143   [3]  41 42 43   'ABC'",
                                         "  can0  20000004   [8]  00 08 00 00 00 00 60 00   ERRORFRAME",
                                         "  can0  TX B -  143  [10]  01 02 03 04 05 06 07 08 09 0A",
                                         "  can0  143   {C}  01 02 03 04 05 06 07 08",
                                         "can0 143   [4]  remote request",
                                         "(2023-11-14 22:13:20.000000) can0 143#01 R"};
  for (int count = 0; count < 200'000; ++count) {
    std::string text(good_lines[random.below(std::size(good_lines))]);
    for (std::uint32_t change = random.below(4); change > 0 && !text.empty(); --change) {
      const std::size_t at = random.below(static_cast<std::uint32_t>(text.size()));
      switch (random.below(3)) {
        case 0: text[at] = static_cast<char>(random.next()); break;
        case 1: text.erase(at, 1); break;
        default: text.insert(at, 1, static_cast<char>(random.next())); break;
      }
    }
    const auto line = parse_screen_line(text, room);
    if (!line.has_value()) {
      REQUIRE(line.error().column <= text.size());
    } else if (line->line.kind != LogLineKind::nothing) {
      std::array<char, long_log_line_length_max> out{};
      const auto again = parse_log_line({out.data(), print_log_line(line->line, out)});
      REQUIRE(again.has_value());
      REQUIRE(again->frame == line->line.frame);
      REQUIRE(again->long_frame == line->line.long_frame);
    }
  }
}

TEST_CASE("what is of a screen and what explains an error frame is known", "[unit][protocol][candump]") {
  CHECK(is_of_screen("  can0  143   [9"));
  CHECK(is_of_screen(" (2023-11-14"));
  CHECK_FALSE(is_of_screen("(1.000000) can0 143#01"));
  CHECK_FALSE(is_of_screen("garbage"));
  CHECK(is_error_text("\tbus-error"));
  CHECK_FALSE(is_error_text("bus-error"));
}

// Log lines: output of candump is read, damage is reported with its column, and nothing crashes.
#include <array>
#include <string>
#include <vector>

#include "protocol/candump.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/worked_frames.hpp"

namespace {

using namespace bmu;
using namespace bmu::test;

LogLine parsed(std::string_view text) {
  const auto line = parse_log_line(text);
  INFO(text);
  REQUIRE(line.has_value());
  return *line;
}

/// "column: expected text", column from 1 as an editor counts.
std::string damage(std::string_view text) {
  const auto line = parse_log_line(text);
  if (line.has_value()) return "none";
  return std::to_string(line.error().column + 1) + ": " + std::string(to_text(line.error().wanted));
}

std::string printed(const LogLine& line) {
  std::array<char, long_log_line_length_max> text{};
  return {text.data(), print_log_line(line, text)};
}

std::string hex_bytes(std::size_t count) {
  std::string text;
  for (std::size_t index = 0; index < count; ++index) {
    text += "0123456789ABCDEF"[index / 16 % 16];
    text += "0123456789ABCDEF"[index % 16];
  }
  return text;
}

std::vector<std::uint8_t> long_bytes(const LogLine& line) {
  std::array<std::uint8_t, xl_bytes_max> bytes{};
  const std::size_t count = unpack(long_frame_of(line), bytes);
  return {bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(count)};
}

}  // namespace

TEST_CASE("a data frame gives time, bus, identifier and bytes", "[unit][protocol][candump]") {
  const LogLine line = parsed("(1700000000.123456) vcan0 143#8EA08E928EB22AB2");
  CHECK(line.kind == LogLineKind::frame);
  CHECK(line.time_us == 1'700'000'000'123'456);
  CHECK(line.bus == "vcan0");
  CHECK(line.direction == Direction::unknown);
  CHECK(line.frame == internal_worked_frames()[2].frame());
}

TEST_CASE("all forms of classic frames are read", "[unit][protocol][candump]") {
  CHECK(parsed("(0.000000) can0 000#").frame == data_frame(0, 0));
  CHECK(parsed("(0.000000) can0 7ff#aB").frame.data[0] == 0xAB);
  const CanFrame extended = parsed("(1.000000) can0 18FF50E5#0102").frame;
  CHECK(extended == CanFrame{.id = 0x18FF50E5, .is_extended = true, .length = 2, .data = {1, 2}});
  CHECK(parsed("(1.000000) can0 00000123#").frame == CanFrame{.id = 0x123, .is_extended = true});
  CHECK(parsed("(1.000000) can0 143#R").frame == CanFrame{.id = 0x143, .is_remote = true});
  CHECK(parsed("(1.000000) can0 143#R4").frame == CanFrame{.id = 0x143, .is_remote = true, .length = 4});
  CHECK(parsed("(1.000000) can0 143#R8_C").frame == CanFrame{.id = 0x143, .is_remote = true, .length = 8});
  const CanFrame error = parsed("(1.000000) can0 20000040#0000000000000000").frame;
  CHECK(error == CanFrame{.id = 0x40, .is_error = true, .length = 8});
  CHECK(parsed("(1.000000) can0 143#1122334455667788_F").frame.length == 8);
}

TEST_CASE("frames of CAN XL are known as such, and five digits alone are no identifier", "[unit][protocol][candump]") {
  const LogLine line = parsed("(1.000000) can0 45123#81:00:12345678#11223344.556677 R");
  CHECK(line.kind == LogLineKind::fd_frame);
  CHECK(line.frame.id == 0x123);
  CHECK(line.direction == Direction::received);
  CHECK(parsed("(1.000000) can0 00123#81:00:12345678#").kind == LogLineKind::fd_frame);
  CHECK(damage("(1.000000) can0 00123#81:00:12345678#1") == "39: data bytes of two hexadecimal digits");
  CHECK(damage("(1.000000) can0 00123#81:00:1234567#11") == "36: data bytes of two hexadecimal digits");
  CHECK(damage("(1.000000) can0 00123#81:0") == "27: data bytes of two hexadecimal digits");
  CHECK(damage("(1.000000) can0 00123#1122") == "22: an identifier of 3 or 8 hexadecimal digits");
}

TEST_CASE("directions, nanoseconds, carriage returns and trailing spaces are read", "[unit][protocol][candump]") {
  CHECK(parsed("(1.000000) can0 143#01 R").direction == Direction::received);
  CHECK(parsed("(1.000000) can0 143#01 T\r").direction == Direction::sent);
  CHECK(parsed("(1.000000) can0 143##1AABB T B E").direction == Direction::sent);
  CHECK(parsed("(1.000000) can0 143#01  ").frame.length == 1);
  CHECK(parsed("(1.123456789) can0 143#01").time_us == 1'123'456);
  CHECK(parsed("(000.000001) unix:demo 143#01").bus == "unix:demo");
}

TEST_CASE("any number of spaces stands between the fields", "[unit][protocol][candump]") {
  CHECK(printed(parsed("(1700000000.000000)   can0 143#8EA08E928EB22AB2")) ==
        "(1700000000.000000) can0 143#8EA08E928EB22AB2");
  CHECK(printed(parsed("(1.000000) can0     143#01   R")) == "(1.000000) can0 143#01 R");
  CHECK(printed(parsed("(1.000000)     unix:a-longer-name  18FF50E5#R2")) ==
        "(1.000000) unix:a-longer-name 18FF50E5#R2");
}

TEST_CASE("comments and blank lines say nothing", "[unit][protocol][candump]") {
  for (const std::string_view text : {"", "\r", "  \t", "# Name: drive", "#"}) {
    CHECK(parsed(text).kind == LogLineKind::nothing);
  }
}

TEST_CASE("CAN FD is recognised and not taken for damage", "[unit][protocol][candump]") {
  const LogLine line = parsed("(1.000000) can0 143##1" + std::string(128, 'A'));
  CHECK(line.kind == LogLineKind::fd_frame);
  CHECK(line.frame.id == 0x143);
  CHECK(damage("(1.000000) can0 143##") == "22: data bytes of two hexadecimal digits");
  CHECK(damage("(1.000000) can0 143##1A") == "24: data bytes of two hexadecimal digits");
  CHECK(damage("(1.000000) can0 143##1" + std::string(130, 'A')) == "151: at most 8 data bytes (64 after '##')");
}

TEST_CASE("what candump writes comes out as it went in", "[unit][protocol][candump]") {
  const std::string start = "(1700000000.123456) can0 ";
  std::vector<std::string> frames = {"143#",        "143#00",        "18FF50E5#0102",
                                     "143#R",       "143#R4",        "18FF50E5#R8",
                                     "143#R8_9",    "143#R8_F",      "20000040#0000000000000000",
                                     "00000123#11", "3FFFFFFF#0102", "45123#81:00:12345678#11223344.556677",
                                     "143##0",      "18FF50E5##3AA", "00123#81:00:12345678#"};
  for (std::size_t bytes = 0; bytes <= 8; ++bytes) frames.push_back("123#" + hex_bytes(bytes));
  for (const char code : {'9', 'A', 'B', 'C', 'D', 'E', 'F'}) frames.push_back("123#" + hex_bytes(8) + "_" + code);
  for (const unsigned bytes : {0U, 1U, 2U, 3U, 4U, 5U, 6U, 7U, 8U, 12U, 16U, 20U, 24U, 32U, 48U, 64U}) {
    for (const char flags : {'0', '1', '2', '3', '4', '7', 'F'}) {
      frames.push_back(std::string("123##") + flags + hex_bytes(bytes));
      frames.push_back(std::string("12345678##") + flags + hex_bytes(bytes));
    }
  }
  frames.push_back("7FF07#01:AB:00000000#" + hex_bytes(2'048));
  for (const std::string& frame : frames) {
    for (const char* direction : {"", " R", " T"}) {
      const std::string text = start + frame + direction;
      INFO(text);
      CHECK(printed(parsed(text)) == text);
    }
  }
}

TEST_CASE("CAN FD and XL give flags and bytes", "[unit][protocol][candump]") {
  const LogLine fd = parsed("(1.000000) can0 123##3aAbB R");
  CHECK(fd.long_frame == "123##3aAbB");
  CHECK_FALSE(long_frame_of(fd).is_xl);
  CHECK(long_frame_of(fd).flags == 3);
  CHECK(long_bytes(fd) == std::vector<std::uint8_t>{0xAA, 0xBB});
  CHECK(long_bytes(parsed("(1.000000) can0 12345678##0")).empty());
  const std::string longest = "(1.000000) can0 123##0" + hex_bytes(64);  // lines point into their text
  const LogLine whole = parsed(longest);
  CHECK(long_bytes(whole).size() == 64);
  CHECK(long_bytes(whole).back() == 63);
  const LogLine xl = parsed("(1.000000) can0 45123#81:00:12345678#1122.33.44. T");
  CHECK(long_frame_of(xl).is_xl);
  CHECK(long_bytes(xl) == std::vector<std::uint8_t>{0x11, 0x22, 0x33, 0x44});
  CHECK(long_bytes(parsed("(1.000000) can0 45123#81:00:12345678#" + hex_bytes(2'048))).size() == 2'048);
  CHECK(damage("(1.000000) can0 45123#81:00:12345678#" + hex_bytes(2'049)) == "4134: at most 2048 data bytes");
  CHECK(damage("(1.000000) can0 45123#81:00:12345678#11..22") == "41: the end of the line, or ' R' or ' T'");
}

TEST_CASE("a length code above 8 is kept beside the eight bytes it means", "[unit][protocol][candump]") {
  CHECK(parsed("(1.000000) can0 123#1122334455667788_9").length_code == 9);
  CHECK(parsed("(1.000000) can0 123#1122334455667788_f").length_code == 15);
  CHECK(parsed("(1.000000) can0 123#R8_C").length_code == 12);
  CHECK(parsed("(1.000000) can0 123#1122334455667788").length_code == 0);
}

TEST_CASE("damage is named with its column", "[unit][protocol][candump]") {
  CHECK(damage("vcan0  143   [8]  8E A0") == "1: '(' before the time");
  CHECK(damage("(") == "2: seconds of the time, 1 to 12 digits");
  CHECK(damage("(-1.000000) can0 143#") == "2: seconds of the time, 1 to 12 digits");
  CHECK(damage("(1700000000") == "12: '.' between seconds and fraction");
  CHECK(damage("(1234567890123.000000) can0 143#") == "14: '.' between seconds and fraction");
  CHECK(damage("(1.00000) can0 143#") == "9: 6 (or 9) digits of a second");
  CHECK(damage("(1.0000001) can0 143#") == "11: 6 (or 9) digits of a second");
  CHECK(damage("(1.000000 can0 143#") == "10: ')' after the time");
  CHECK(damage("(1.000000)can0 143#") == "11: a space");
  CHECK(damage("(1.000000)  ") == "13: a bus name of 1 to 63 characters");
  CHECK(damage("(1.000000) " + std::string(64, 'x') + " 143#") == "12: a bus name of 1 to 63 characters");
  CHECK(damage("(1.000000) can0") == "16: a space");
  CHECK(damage("(1.000000) can0 143 01") == "20: '#' after the identifier");
  CHECK(damage("(1.000000) can0 14#01") == "19: an identifier of 3 or 8 hexadecimal digits");
  CHECK(damage("(1.000000) can0 1434#01") == "21: an identifier of 3 or 8 hexadecimal digits");
  CHECK(damage("(1.000000) can0 800#01") == "17: an identifier up to 7FF (3 digits) or 3FFFFFFF (8 digits)");
  CHECK(damage("(1.000000) can0 40000000#01") == "17: an identifier up to 7FF (3 digits) or 3FFFFFFF (8 digits)");
  CHECK(damage("(1.000000) can0 143#0") == "21: data bytes of two hexadecimal digits");
  CHECK(damage("(1.000000) can0 143#0G") == "21: data bytes of two hexadecimal digits");
  CHECK(damage("(1.000000) can0 143#112233445566778899") == "37: at most 8 data bytes (64 after '##')");
  CHECK(damage("(1.000000) can0 143#R9") == "22: a length code");
  CHECK(damage("(1.000000) can0 143#R8_8") == "24: a length code");
  CHECK(damage("(1.000000) can0 143#01_C") == "24: a length code");
  CHECK(damage("(1.000000) can0 143#01 X") == "24: the end of the line, or ' R' or ' T'");
  CHECK(damage("(1.000000) can0 143#01;") == "23: the end of the line, or ' R' or ' T'");
  CHECK(damage(std::string_view("(1.000000) can0 143#01\0", 23)) == "23: the end of the line, or ' R' or ' T'");
  CHECK(damage(std::string_view("\0", 1)) == "1: '(' before the time");
}

TEST_CASE("every beginning of a line is either damaged or a shorter frame, never more", "[unit][protocol][candump]") {
  const std::string whole = "(1700000000.123456) vcan0 143#8EA08E928EB22AB2 R";
  for (std::size_t length = 1; length < whole.size(); ++length) {
    const auto line = parse_log_line(std::string_view(whole).substr(0, length));
    if (line.has_value()) {
      CHECK(line->frame.length <= 8);
    } else {
      CHECK(line.error().column <= length);
    }
  }
}

TEST_CASE("a line that is printed parses to itself, for random frames", "[unit][protocol][candump]") {
  Random random(3);
  for (int count = 0; count < 10'000; ++count) {
    LogLine line{.kind = LogLineKind::frame, .bus = "unix:a-bus"};
    line.time_us = random.between(0, 4'000'000'000'000'000);
    line.direction = static_cast<Direction>(random.below(3));
    CanFrame& frame = line.frame;
    frame.is_extended = random.below(2) == 1;
    frame.is_error = !frame.is_extended && random.below(8) == 0;
    frame.is_remote = !frame.is_error && random.below(8) == 0;
    frame.id = random.next() & (frame.is_extended || frame.is_error ? 0x1FFF'FFFFU : 0x7FFU);
    frame.length = static_cast<std::uint8_t>(random.below(9));
    for (std::size_t index = 0; index < frame.length && !frame.is_remote; ++index) {
      frame.data[index] = static_cast<std::uint8_t>(random.next());
    }
    const std::string text = printed(line);
    const LogLine again = parsed(text);
    REQUIRE(again.frame == line.frame);
    REQUIRE(again.time_us == line.time_us);
    REQUIRE(again.direction == line.direction);
    REQUIRE(again.bus == line.bus);
  }
}

TEST_CASE("a line read at once and the same read letter by letter say the same", "[unit][protocol][candump]") {
  // Lines with ten digits of seconds, a short name and eight bytes are read at once.
  const std::uint32_t seed = GENERATE(range(100U, 110U));
  Random random(seed);
  for (int count = 0; count < 2'000; ++count) {
    LogLine line{.kind = LogLineKind::frame, .bus = "can0", .frame = data_frame(random.next() & 0x7FFU, 8)};
    line.time_us = random.between(1'000'000'000'000'000, 9'999'999'999'999'999);
    for (std::uint8_t& byte : line.frame.data) byte = static_cast<std::uint8_t>(random.next());
    const std::string usual = printed(line);
    std::string unusual = usual.substr(0, usual.size() - 2);
    unusual.replace(unusual.find("can0"), 4, "a-longer-name");
    unusual.insert(1, "0");
    INFO("seed " << seed << ", line " << count << ": " << usual);
    REQUIRE(parsed(usual).frame == line.frame);
    REQUIRE(parsed(usual).time_us == line.time_us);
    REQUIRE(parsed(usual).bus == line.bus);
    line.frame.length = 7;
    line.frame.data[7] = 0;
    REQUIRE(parsed(unusual).frame == line.frame);
    REQUIRE(parsed(unusual).time_us == line.time_us);
    REQUIRE(parsed(unusual).bus == "a-longer-name");
  }
}

TEST_CASE("a damaged line is damaged at the same place, whichever way its time is read", "[unit][protocol][candump]") {
  static constexpr std::string_view letters = "09afAFgG:/@`.#() R\x7F\x80\xB5";
  const std::uint32_t seed = GENERATE(range(200U, 210U));
  Random random(seed);
  for (int count = 0; count < 5'000; ++count) {
    std::string usual = "(1700000000.123456) vcan0 143#8EA08E928EB22AB2 R";
    for (std::uint32_t change = random.below(4); change > 0; --change) {
      const std::size_t at = 2 + random.below(static_cast<std::uint32_t>(usual.size() - 2));
      if (at != 11) usual[at] = letters[random.below(static_cast<std::uint32_t>(letters.size()))];
    }
    std::string unusual = usual;
    unusual.insert(1, "0");  // eleven digits of seconds; the point stays after them, as more than twelve are invalid
    INFO("seed " << seed << ", line " << count << ": " << usual);
    const auto one = parse_log_line(usual);
    const auto other = parse_log_line(unusual);
    REQUIRE(one.has_value() == other.has_value());
    if (one.has_value()) {
      REQUIRE(one->frame == other->frame);
      REQUIRE(one->time_us == other->time_us);
      REQUIRE(one->bus == other->bus);
    } else {
      REQUIRE(one.error().wanted == other.error().wanted);
      REQUIRE(one.error().column + 1 == other.error().column);
    }
  }
}

TEST_CASE("random and mutated lines never crash the parser", "[unit][protocol][candump]") {
  Random random(4);
  const std::string_view good_lines[] = {"(1700000000.123456) vcan0 143#8EA08E928EB22AB2 R",
                                         "(1700000000.123456) vcan0 143#8EA08E928EB22AB2_9 R",
                                         "(1700000000.123456) vcan0 143##38EA08E928EB22AB2010203 T",
                                         "(1700000000.123456) vcan0 45123#81:00:12345678#1122.33 R"};
  for (int count = 0; count < 200'000; ++count) {
    std::string text(good_lines[random.below(std::size(good_lines))]);
    if (count % 4 == 0) {
      text.resize(random.below(80));
      for (char& letter : text) letter = static_cast<char>(random.next());
    }
    for (std::uint32_t change = random.below(4); change > 0 && !text.empty(); --change) {
      const std::size_t at = random.below(static_cast<std::uint32_t>(text.size()));
      switch (random.below(3)) {
        case 0: text[at] = static_cast<char>(random.next()); break;
        case 1: text.erase(at, 1); break;
        default: text.insert(at, 1, static_cast<char>(random.next())); break;
      }
    }
    const auto line = parse_log_line(text);
    if (!line.has_value()) {
      REQUIRE(line.error().column <= text.size());
    } else if (line->kind != LogLineKind::nothing) {
      const std::string text_again = printed(*line);
      REQUIRE(parsed(text_again).frame == line->frame);
      REQUIRE(parsed(text_again).long_frame == line->long_frame);
    }
  }
}

// Length of a frame on the bus: recorded lengths, the upper bound, and an independent slow calculation.
#include <algorithm>
#include <string>
#include <vector>

#include "protocol/can_bits.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/worked_frames.hpp"

namespace {

using namespace bmu;
using namespace bmu::test;

struct Length {
  std::uint32_t id;
  std::vector<std::uint8_t> data;
  std::int64_t bits;
  bool is_extended = false;
  bool is_remote = false;
};

CanFrame frame_of(const Length& row) {
  CanFrame frame{.id = row.id,
                 .is_extended = row.is_extended,
                 .is_remote = row.is_remote,
                 .length = static_cast<std::uint8_t>(row.data.size())};
  std::copy(row.data.begin(), row.data.end(), frame.data.begin());
  return frame;
}

std::vector<std::uint8_t> eight(std::uint8_t byte) {
  return std::vector<std::uint8_t>(8, byte);
}

/// Lengths from another calculator of frame lengths.
const std::vector<Length>& recorded_lengths() {
  static const std::vector<Length> rows{
      {0x620, eight(0x00), 126},
      {0x2AA, eight(0x55), 111},
      {0x000, eight(0x00), 127},
      {0x7FF, eight(0xFF), 126},
      {0x0F8, eight(0x78), 113},
      {0x078, eight(0x3C), 131},
      {0x123, {0xDE, 0xAD, 0xBE, 0xEF}, 81},
      {0x123, {}, 48},
      {0x000, {}, 53},
      {0x7FF, {}, 50, false, true},
      {0x080, {0x00, 0x8F, 0x00, 0x00, 0x00, 0x00, 0x2A, 0x1F}, 122},
      {0x143, {0x8E, 0xA0, 0x8E, 0x92, 0x8E, 0xB2, 0x2A, 0xB2}, 112},
      {0x103, {0x5C, 0x00, 0x00, 0x00, 0x10, 0x0C, 0x2A, 0xA1}, 118},
      {0x040, {0x06, 0xF9, 0x00, 0x00, 0x00, 0x00, 0x05, 0x75}, 122},
      {0x521, {0x00, 0x01, 0x00, 0x00, 0x27, 0x10}, 102},
      {0x622, {0x02, 0x0E, 0x8D, 0x04, 0x00, 0x00}, 103},
      {0x1FFFFFFF, eight(0xFF), 149, true},
      {0x00000000, eight(0x00), 150, true},
      {0x0F0F0F0F, eight(0x0F), 134, true},
      {0x18FF50E5, {1, 2, 3, 4, 5, 6, 7, 8}, 143, true},
      {0x18FF50E5, {}, 70, true, true},
  };
  return rows;
}

void append(std::string& text, std::uint64_t value, unsigned width) {
  for (unsigned left = width; left > 0; --left) text += ((value >> (left - 1)) & 1U) != 0 ? '1' : '0';
}

/// The CRC as a long division of text: the message and 15 zeros, by x^15+x^14+x^10+x^8+x^7+x^4+x^3+1.
std::string remainder_of(std::string message) {
  const std::string divisor = "1100010110011001";
  message += std::string(15, '0');
  for (std::size_t at = 0; at + divisor.size() <= message.size(); ++at) {
    if (message[at] == '0') continue;
    for (std::size_t bit = 0; bit < divisor.size(); ++bit)
      message[at + bit] = message[at + bit] == divisor[bit] ? '0' : '1';
  }
  return message.substr(message.size() - 15);
}

/// The stuffed part as the standard defines it: all fields as text, their CRC, then a search for every run of five.
std::string stuffed_by_definition(const CanFrame& frame) {
  std::string text = "0";
  const std::string remote = frame.is_remote ? "1" : "0";
  if (frame.is_extended) {
    append(text, frame.id >> 18, 11);
    text += "11";
    append(text, frame.id & 0x3FFFF, 18);
    text += remote + "00";
  } else {
    append(text, frame.id, 11);
    text += remote + "00";
  }
  append(text, frame.length, 4);
  for (std::size_t byte = 0; !frame.is_remote && byte < frame.length; ++byte) append(text, frame.data[byte], 8);
  text += remainder_of(text);
  for (std::size_t end = 5; end <= text.size(); ++end) {
    const std::string last = text.substr(end - 5, 5);
    if (last == "00000") text.insert(end, "1");
    if (last == "11111") text.insert(end, "0");
  }
  return text;
}

std::string text_of(const CanBits& bits) {
  std::string text;
  for (const bool bit : bits) text += bit ? '1' : '0';
  return text;
}

/// Frame with any bytes, or with few different ones with long runs of equal bits.
CanFrame any_frame(Random& random) {
  static constexpr std::uint8_t long_runs[] = {0x00, 0xFF, 0x0F, 0xF0, 0x78, 0x87, 0x3C, 0xC3, 0x1E, 0xE1, 0x07, 0xF8};
  const bool is_extended = random.below(2) == 0;
  CanFrame frame{.id = static_cast<std::uint32_t>(random.below(is_extended ? 1U << 29 : 1U << 11)),
                 .is_extended = is_extended,
                 .is_remote = random.below(8) == 0,
                 .length = static_cast<std::uint8_t>(random.below(9))};
  const bool has_runs = random.below(2) == 0;
  for (std::size_t byte = 0; byte < frame.length && !frame.is_remote; ++byte) {
    frame.data[byte] =
        has_runs ? long_runs[random.below(std::size(long_runs))] : static_cast<std::uint8_t>(random.next());
  }
  return frame;
}

constexpr CanFrame known_at_compile_time{.id = 0x620, .length = 8};
static_assert(bits_on_wire(known_at_compile_time) == 126);
static_assert(bits_on_wire_max(0) == 55 && bits_on_wire_max(6) == 115);
static_assert(bits_on_wire_max(0, true) == 80 && bits_on_wire_max(8, true) == 160);

}  // namespace

TEST_CASE("frames are as long as recorded", "[unit][protocol][can_bits]") {
  for (const Length& row : recorded_lengths()) {
    const CanFrame frame = frame_of(row);
    INFO(std::hex << row.id << " with " << row.data.size() << " bytes");
    CHECK(bits_on_wire(frame) == row.bits);
  }
}

TEST_CASE("a frame's bits agree with the slow way, and no frame is longer than the bound",
          "[unit][protocol][can_bits]") {
  Random random(15);
  for (int count = 0; count < 5'000; ++count) {
    const CanFrame frame = any_frame(random);
    INFO(std::hex << frame.id << (frame.is_extended ? " extended" : "") << (frame.is_remote ? " remote" : ""));
    const CanBits stuffed = stuffed_bits(frame);
    REQUIRE(text_of(stuffed) == stuffed_by_definition(frame));
    // bits_on_wire counts by tables, not from those bits.
    REQUIRE(bits_on_wire(frame) ==
            static_cast<std::int64_t>(stuffed.size()) + can_bits_of_trailer + can_bits_between_frames);
    REQUIRE(bits_on_wire(frame) <= bits_on_wire_max(frame));
    const std::int64_t bytes = frame.is_remote ? 0 : frame.length;
    REQUIRE(bits_on_wire(frame) >= (frame.is_extended ? 67 : 47) + 8 * bytes);
  }
}

TEST_CASE("the bound is no wild guess: of all frames without data the longest is two bits shorter",
          "[unit][protocol][can_bits]") {
  std::int64_t longest = 0;
  for (std::uint32_t id = 0; id < 1U << 11; ++id) longest = std::max(longest, bits_on_wire({.id = id, .length = 0}));
  CHECK(longest == bits_on_wire_max(0) - 2);
}

TEST_CASE("a remote frame carries its length and no data", "[unit][protocol][can_bits]") {
  CanFrame frame{.id = 0x123, .is_remote = true, .length = 8};
  frame.data.fill(0xFF);
  CHECK(bits_on_wire(frame) == 48);
  CHECK(bits_on_wire_max(frame) == 55);
}

TEST_CASE("the controller's own error frames are not on the wire", "[unit][protocol][can_bits]") {
  CHECK(bits_on_wire({.id = 0x40, .is_error = true, .length = 8}) == 0);
  CHECK(stuffed_bits({.id = 0x40, .is_error = true, .length = 8}).empty());
}

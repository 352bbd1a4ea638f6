// Checksum: its known values, and the detection of all errors that it guarantees to detect.
#include <string_view>

#include "protocol/bits.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/worked_frames.hpp"

namespace {

using namespace bmu;
using namespace bmu::test;

std::uint8_t crc_of(std::initializer_list<std::uint8_t> bytes) {
  Crc8H2F crc;
  for (const std::uint8_t one : bytes) crc.add(one);
  return crc.value();
}

/// The same checksum the slow way, bit by bit, from its definition.
std::uint8_t crc_by_definition(const std::vector<std::uint8_t>& bytes) {
  unsigned crc = 0xFF;
  for (const std::uint8_t one : bytes) {
    for (unsigned mask = 0x80; mask != 0; mask >>= 1) {
      const bool is_one = ((crc & 0x80) != 0) != ((one & mask) != 0);
      crc = ((crc << 1) ^ (is_one ? 0x2FU : 0U)) & 0xFF;
    }
  }
  return static_cast<std::uint8_t>(crc ^ 0xFF);
}

bool passes(const CanFrame& frame) {
  return frame.data[7] == frame_crc(frame);
}

/// Bit 0 to 10 are the identifier's, 11 to 74 the data's.
constexpr unsigned protected_bits = 11 + 64;
void flip(CanFrame& frame, unsigned bit) {
  if (bit < 11) {
    frame.id ^= 1U << bit;
  } else {
    frame.data[(bit - 11) / 8] = static_cast<std::uint8_t>(frame.data[(bit - 11) / 8] ^ (1U << ((bit - 11) % 8)));
  }
}

}  // namespace

TEST_CASE("the checksum has the published check values", "[unit][protocol]") {
  CHECK(crc_of({'1', '2', '3', '4', '5', '6', '7', '8', '9'}) == 0xDF);
  CHECK(crc_of({0x00, 0x00, 0x00, 0x00}) == 0x12);
  CHECK(crc_of({0xF2, 0x01, 0x83}) == 0xC2);
  CHECK(crc_of({0x0F, 0xAA, 0x00, 0x55}) == 0xC6);
  CHECK(crc_of({0x00, 0xFF, 0x55, 0x11}) == 0x77);
  CHECK(crc_of({0x33, 0x22, 0x55, 0xAA, 0xBB, 0xCC, 0xDD, 0xEE, 0xFF}) == 0x11);
  CHECK(crc_of({0x92, 0x6B, 0x55}) == 0x33);
  CHECK(crc_of({0xFF, 0xFF, 0xFF, 0xFF}) == 0x6C);
}

TEST_CASE("the checksum's table agrees with its definition", "[unit][protocol]") {
  Random random(2);
  for (int count = 0; count < 1'000; ++count) {
    std::vector<std::uint8_t> bytes(random.below(14));
    Crc8H2F crc;
    for (std::uint8_t& one : bytes) crc.add(one = static_cast<std::uint8_t>(random.next()));
    REQUIRE(crc.value() == crc_by_definition(bytes));
  }
}

TEST_CASE("a frame's checksum is that of its identifier and b0 to b6", "[unit][protocol]") {
  Random random(21);
  for (int count = 0; count < 10'000; ++count) {
    CanFrame frame{.id = random.next() & 0x1FFF'FFFF, .length = 8};
    std::vector<std::uint8_t> bytes{static_cast<std::uint8_t>(frame.id >> 8), static_cast<std::uint8_t>(frame.id)};
    for (std::size_t index = 0; index < 7; ++index) {
      bytes.push_back(frame.data[index] = static_cast<std::uint8_t>(random.next()));
    }
    INFO("frame " << count << " of seed 21");
    REQUIRE(frame_crc(frame) == crc_by_definition(bytes));
  }
}

TEST_CASE("every error of one, two and three bits in identifier and data is found", "[unit][protocol]") {
  for (const WorkedFrame& worked : internal_worked_frames()) {
    CanFrame frame = worked.frame();
    REQUIRE(passes(frame));
    bool is_missed = false;
    for (unsigned first = 0; first < protected_bits; ++first) {
      flip(frame, first);
      is_missed = is_missed || passes(frame);
      for (unsigned second = first + 1; second < protected_bits; ++second) {
        flip(frame, second);
        is_missed = is_missed || passes(frame);
        for (unsigned third = second + 1; third < protected_bits; ++third) {
          flip(frame, third);
          is_missed = is_missed || passes(frame);
          flip(frame, third);
        }
        flip(frame, second);
      }
      flip(frame, first);
    }
    CHECK_FALSE(is_missed);
  }
}

TEST_CASE("a frame that shows up under another identifier fails its checksum", "[unit][protocol]") {
  CanFrame frame = internal_worked_frames()[2].frame();
  int accepted = 0;
  for (frame.id = 0; frame.id < 2048; ++frame.id) accepted += passes(frame) ? 1 : 0;
  // One byte cannot distinguish 2048 identifiers, but those that it confuses differ in more than three bits.
  CHECK(accepted == 8);
}

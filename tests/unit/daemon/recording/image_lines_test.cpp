// State of a core as lines: zeros are counted, and the round trip is complete.
#include "daemon/recording/image_lines.hpp"

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/recording/record_line.hpp"
#include "tests/support/catch.hpp"

using namespace bmu;

namespace {

using Bytes = std::vector<std::uint8_t>;

/// Blocks of zeros and of numbers, each shorter than a line.
Bytes some_bytes(std::size_t size) {
  Bytes bytes(size);
  for (std::size_t at = 0; at < size; ++at) {
    const bool is_zero = at / 1000 % 2 == 1;
    bytes[at] = is_zero ? 0 : static_cast<std::uint8_t>(at * 7 + at / 256);
  }
  return bytes;
}

bool take_line(std::string_view line, std::size_t size_max, Bytes& to) {
  if (line.starts_with("# image ")) return append_image_bytes(line.substr(8), size_max, to);
  if (line.starts_with("# zeros ")) return append_image_zeros(line.substr(8), size_max, to);
  return false;
}

Bytes read_back(std::string_view text, std::size_t size_max) {
  Bytes bytes;
  while (!text.empty()) {
    const std::size_t end = text.find('\n');
    REQUIRE(end < record_line_max);
    REQUIRE(take_line(text.substr(0, end), size_max, bytes));
    text.remove_prefix(end + 1);
  }
  return bytes;
}

}  // namespace

TEST_CASE("whatever its size, an image comes back from its lines", "[unit][recording][image]") {
  for (const int size : {0, 1, 269, 270, 271, 539, 540, 1000, 2000, 5003, 12'345}) {
    const Bytes bytes = some_bytes(static_cast<std::size_t>(size));
    std::string text;
    append_image_lines(bytes, text);
    CAPTURE(size);
    CHECK(read_back(text, bytes.size()) == bytes);
  }
}

TEST_CASE("zeros are counted, and a run of them is one line", "[unit][recording][image]") {
  std::string text;
  append_image_lines(Bytes(100'000), text);
  CHECK(text == "# zeros 100000\n");
  Bytes one(3 * 270);
  one[270] = 1;
  text.clear();
  append_image_lines(one, text);
  CHECK(text.find("# zeros 270\n# image AQAA") == 0);
  CHECK(text.ends_with("\n# zeros 270\n"));
}

TEST_CASE("the checksum knows each byte and its place", "[unit][recording][image]") {
  const Bytes bytes = some_bytes(3000);
  const std::uint64_t sum = image_checksum(bytes);
  for (const int at : {0, 500, 999, 1500, 2999}) {
    Bytes other = bytes;
    other[static_cast<std::size_t>(at)] ^= 1;
    CAPTURE(at);
    CHECK(image_checksum(other) != sum);
  }
  Bytes early(2700);
  early[0] = 1;
  Bytes late(2700);
  late[270] = 1;
  CHECK(image_checksum(early) != image_checksum(late));
}

TEST_CASE("lines that are no image are refused, and never take more room than was said", "[unit][recording][F106]") {
  Bytes bytes;
  CHECK_FALSE(append_image_bytes("AAA-", 100, bytes));
  bytes.clear();
  CHECK_FALSE(append_image_bytes("AAAA", 2, bytes));
  bytes.clear();
  for (const char* wrong : {"", "-1", "x", "12 ", "101", "99999999999999999999", "18446744073709551615"}) {
    CAPTURE(wrong);
    CHECK_FALSE(append_image_zeros(wrong, 100, bytes));
    CHECK(bytes.empty());
  }
  CHECK(append_image_zeros("100", 100, bytes));
  CHECK_FALSE(append_image_zeros("1", 100, bytes));
}

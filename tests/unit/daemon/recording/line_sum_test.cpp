// Checksum over lines of a recording.
#include "daemon/recording/line_sum.hpp"

#include <string>

#include "tests/support/catch.hpp"

using namespace bmu;

namespace {

std::uint32_t sum_of(std::string_view lines) {
  LineSum sum;
  sum.add_lines(lines);
  return sum.value();
}

}  // namespace

TEST_CASE("lines that are others, in another order, fewer or cut otherwise have another sum",
          "[unit][recording][F106]") {
  const std::string lines = "(1.000000) can0 143#11\n(1.000100) can0 144#22\n";
  CHECK(sum_of(lines) == 0xF9D27786U);  // the same on every machine
  CHECK(sum_of("(1.000100) can0 144#22\n(1.000000) can0 143#11\n") != sum_of(lines));
  CHECK(sum_of("(1.000000) can0 143#11\n") != sum_of(lines));
  CHECK(sum_of("") != sum_of("\n"));
  CHECK(sum_of("ab\nc\n") != sum_of("a\nbc\n"));
  CHECK(sum_of("ab\n") != sum_of(std::string("ab\0\n", 4)));
  for (std::size_t at = 0; at + 1 < lines.size(); ++at) {
    std::string changed = lines;
    changed[at] ^= 1;
    CAPTURE(at);
    CHECK(sum_of(changed) != sum_of(lines));
  }
}

TEST_CASE("line ends of another system are none of the line", "[unit][recording]") {
  CHECK(sum_of("a\r\nb\r\n") == sum_of("a\nb\n"));
}

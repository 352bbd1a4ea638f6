// Integer conversions between units: rounded to the nearest, for every value.
#include "protocol/units.hpp"

#include <limits>

#include "tests/support/catch.hpp"

using namespace bmu;

TEST_CASE("a division goes to the nearest integer, ties away from zero", "[unit][units]") {
  CHECK(divide_to_nearest(0, 1'000) == 0);
  for (const std::int64_t sign : {1, -1}) {
    CHECK(divide_to_nearest(sign * 499, 1'000) == 0);
    CHECK(divide_to_nearest(sign * 500, 1'000) == sign);
    CHECK(divide_to_nearest(sign * 1'499, 1'000) == sign);
    CHECK(divide_to_nearest(sign * 1'500, 1'000) == sign * 2);
    // A division by three has no ties.
    CHECK(divide_to_nearest(sign * 4, 3) == sign);
    CHECK(divide_to_nearest(sign * 5, 3) == sign * 2);
    CHECK(divide_to_nearest(sign * 7, 1) == sign * 7);
    CHECK(divide_to_nearest(sign, 2) == sign);
  }
}

TEST_CASE("no value is too large to be divided", "[unit][units]") {
  constexpr std::int64_t least = std::numeric_limits<std::int64_t>::min();
  constexpr std::int64_t most = std::numeric_limits<std::int64_t>::max();
  CHECK(divide_to_nearest(least, 1) == least);
  CHECK(divide_to_nearest(most, 1) == most);
  CHECK(divide_to_nearest(least, 1'000) == -9'223'372'036'854'776);
  CHECK(divide_to_nearest(most, 1'000) == 9'223'372'036'854'776);
  CHECK(divide_to_nearest(least, most) == -1);
  CHECK(divide_to_nearest(most, most) == 1);
}

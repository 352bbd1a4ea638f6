// Patterns that exclude test cases that a host cannot run: tests/support/needs.hpp.
#include "tests/support/needs.hpp"

#include "tests/support/catch.hpp"

using bmu::test::MissingNeed;
using bmu::test::without;

TEST_CASE("what a machine cannot run is left out of each alternative of a pattern", "[unit][needs]") {
  const std::vector<MissingNeed> none;
  const std::vector<MissingNeed> bus{{"[bus]", "no room"}};
  const std::vector<MissingNeed> both{{"[pty]", "no terminal"}, {"[bus]", "no room"}};
  CHECK(without("a name", none) == "a name");
  CHECK(without("", bus) == "~[bus]");
  CHECK(without("[unit]", both) == "~[pty]~[bus][unit]");
  CHECK(without("one,[two]", bus) == "~[bus]one,~[bus][two]");
  // A comma of a name is escaped, an escaped backslash before a comma is not.
  CHECK(without("one\\, and more", bus) == "~[bus]one\\, and more");
  CHECK(without("one\\\\,two", bus) == "~[bus]one\\\\,~[bus]two");
}

// Foundation of properties over whole ranges: each case is tried, and of those that fail the plainest is reported, with
// the command that runs only that case.
#include "tests/support/whole_range.hpp"

#include <string>
#include <vector>

#include "tests/support/catch.hpp"

namespace bmu {
namespace {

using test::WholeRange;

/// Of 5 times 4 cases those fail that have numbers with a product of 6 or more.
std::vector<std::string> sweep(WholeRange& range) {
  std::vector<std::string> tried;
  for (std::size_t a = 0; a < 5; ++a) {
    for (std::size_t b = 0; b < 4; ++b) {
      const std::string text = std::to_string(a) + " times " + std::to_string(b);
      range.attempt(text, a + b, [&]() -> std::string {
        tried.push_back(text);
        return a * b < 6 ? "" : "it is " + std::to_string(a * b);
      });
    }
  }
  return tried;
}

}  // namespace

TEST_CASE("each case of a whole range is tried, and the plainest that fails is reported with its command",
          "[property][whole_range]") {
  WholeRange range("");
  CHECK(sweep(range).size() == 20);
  CHECK(range.tried().tried == 20);
  CHECK(range.tried().failed == 5);
  // Of those with as few steps the first: 2 times 3, not 3 times 2.
  CHECK(range.tried().plainest == "2 times 3");
  CHECK(test::report_of(range.tried(), "numbers, few") ==
        "5 of 20 cases fail, the plainest: 2 times 3: it is 6\n"
        "this case again: BMUD_CASE='2 times 3' build/bin/test_property \"numbers\\, few\"");
}

TEST_CASE("a case of a whole range is tried alone by its text", "[property][whole_range]") {
  WholeRange range("4 times 3");
  CHECK(sweep(range) == std::vector<std::string>{"4 times 3"});
  CHECK(range.tried().failed == 1);
  CHECK(range.tried().problem == "it is 12");
  WholeRange none("4 times 9");
  CHECK(sweep(none).empty());
  CHECK(none.tried().tried == 0);
}

}  // namespace bmu

// Foundation of the other properties: a property that does not hold is reported by a small case, with the command that
// draws that case again; one that holds is tried as often as required, on the same cases in each run.
#include "tests/support/drawn_cases.hpp"

#include <algorithm>
#include <string>
#include <vector>

#include <rapidcheck.h>

#include "tests/support/catch.hpp"

namespace bmu {
namespace {

using test::draw_cases;
using test::DrawnCases;

/// A list of numbers without one of 700 or more. It does not hold.
struct NoLargeNumber {
  std::vector<std::vector<int>>* tried;

  void operator()() const {
    const auto numbers =
        *rc::gen::resize(rc::kNominalSize, rc::gen::container<std::vector<int>>(rc::gen::inRange(0, 1'000)));
    tried->push_back(numbers);
    RC_ASSERT(std::all_of(numbers.begin(), numbers.end(), [](int number) { return number < 700; }));
  }
};

/// The text between RC_PARAMS=' and the next quote.
std::string repeat_in(const std::string& report) {
  const std::string begins = "RC_PARAMS='";
  const std::size_t at = report.find(begins);
  if (at == std::string::npos) return "";
  return report.substr(at + begins.size(), report.find('\'', at + begins.size()) - at - begins.size());
}

}  // namespace

TEST_CASE("a property that does not hold is reported by its smallest case, with the command that repeats that",
          "[property][drawn_cases]") {
  std::vector<std::vector<int>> tried;
  const DrawnCases drawn = draw_cases("numbers, few", 100, 5, "", NoLargeNumber{&tried});
  CHECK_FALSE(drawn.is_held);
  CHECK_FALSE(drawn.is_repeat);
  INFO(drawn.report);
  CHECK(drawn.report.find("[700]") != std::string::npos);
  CHECK(drawn.report.find("seed 5; all cases again: BMUD_SEED=5 build/bin/test_property \"numbers\\, few\"") !=
        std::string::npos);
  const std::string repeat = repeat_in(drawn.report);
  REQUIRE_FALSE(repeat.empty());
  std::vector<std::vector<int>> again;
  const DrawnCases repeated = draw_cases("numbers, few", 100, 77, repeat, NoLargeNumber{&again});
  CHECK_FALSE(repeated.is_held);
  CHECK(repeated.is_repeat);
  // Only the cases on the way to it are run.
  CHECK(again.back() == std::vector<int>{700});
  CHECK(again.size() < tried.size());
}

TEST_CASE("a property that holds is tried on as many cases as it should be, on others with another seed",
          "[property][drawn_cases]") {
  const auto drawn_with = [](std::uint64_t seed) {
    std::vector<int> numbers;
    const DrawnCases drawn = draw_cases("any number", 60, seed, "", [&numbers] {
      numbers.push_back(*rc::gen::resize(rc::kNominalSize, rc::gen::inRange(0, 1'000'000)));
    });
    CHECK(drawn.is_held);
    CHECK(drawn.report.empty());
    return numbers;
  };
  const std::vector<int> first = drawn_with(1);
  CHECK(first.size() == 60);
  CHECK(drawn_with(1) == first);
  CHECK(drawn_with(2) != first);
}

}  // namespace bmu

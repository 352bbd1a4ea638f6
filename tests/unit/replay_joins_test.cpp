// Whether parts are one recording.
#include <string>
#include <vector>

#include "tests/support/catch.hpp"
#include "tools/bmureplay/joins.hpp"

using namespace bmu::replay;

namespace {

constexpr std::int64_t s_us = 1'000'000;

/// A part of 30 s.
PartSpan part(const std::string& file, std::int64_t life, std::uint64_t number, std::int64_t from_s) {
  return {.file = file,
          .first_line = number * 100,
          .id = {.life = life, .part = number},
          .from_log_us = from_s * s_us,
          .until_log_us = (from_s + 30) * s_us};
}

std::vector<std::string> told(const std::vector<PartSpan>& parts) {
  Joins joins;
  for (const PartSpan& one : parts) joins.take(one);
  std::vector<std::string> texts;
  for (const Join& join : joins.found())
    texts.push_back(join.file + ":" + std::to_string(join.line) + ": " + join.text);
  return texts;
}

}  // namespace

TEST_CASE("of parts that follow each other nothing is said, whatever file they are in", "[unit][recording][F106]") {
  CHECK(told({part("a", 7, 1, 100), part("a", 7, 2, 130), part("b", 7, 3, 160)}).empty());
}

TEST_CASE("what is missing, twice, in another order or of another life is named", "[unit][recording][F106]") {
  CHECK(told({part("a", 7, 1, 100), part("b", 7, 3, 160)}) ==
        std::vector<std::string>{"b:300: 30.0 s are missing before this part"});
  CHECK(told({part("a", 7, 1, 100), part("a", 7, 1, 100)}) ==
        std::vector<std::string>{"a:100: this part comes once more"});
  CHECK(told({part("c", 7, 3, 160), part("a", 7, 1, 100), part("b", 7, 2, 130)}) ==
        std::vector<std::string>{"a:100: this part comes before the one ahead of it: not in their order"});
  CHECK(told({part("a", 7, 5, 100), part("b", 8, 1, 190)}) ==
        std::vector<std::string>{
            "b:100: another life of the daemon, which began 60.0 s after what is recorded of the one before ends"});
  CHECK(told({part("a", 7, 5, 100), part("b", 8, 1, 90)}) ==
        std::vector<std::string>{
            "b:100: another life of the daemon, which began 40.0 s before what stands ahead of it had ended"});
  CHECK(told({part("a", 7, 1, 100), part("a", 7, 3, 120)}) ==
        std::vector<std::string>{"a:300: lines are missing before this part, and the clock went back by 10.0 s"});
}

TEST_CASE("black boxes may overlap, but one of them has its order", "[unit][recording][F106]") {
  const auto box = [](PartSpan span) {
    span.is_black_box = true;
    return span;
  };
  CHECK(told({box(part("a", 7, 1, 100)), box(part("a", 7, 2, 130)), box(part("b", 7, 1, 100))}).empty());
  CHECK(told({part("a", 7, 1, 100), box(part("b", 7, 1, 100)), part("c", 7, 2, 130)}).empty());
  CHECK(told({box(part("a", 7, 1, 100)), box(part("a", 7, 3, 160))}).size() == 1);
}

TEST_CASE("of parts that nobody counted, and of those without a time, nothing is said", "[unit][recording]") {
  CHECK(told({part("a", 0, 1, 100), part("a", 0, 1, 100)}).empty());
  PartSpan empty = part("b", 7, 9, 0);
  CHECK(told({part("a", 7, 1, 100), empty, part("c", 7, 2, 130)}).empty());
}

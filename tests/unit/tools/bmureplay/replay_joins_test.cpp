// Check whether parts are one recording.
#include <chrono>
#include <string>
#include <vector>

#include "tests/support/catch.hpp"
#include "tools/bmureplay/joins.hpp"

using namespace bmu;
using namespace bmu::replay;

namespace {

constexpr std::int64_t s_us = 1'000'000;

/// A part of 30 s.
PartSpan part(const std::string& file, std::int64_t life, std::uint64_t number, std::int64_t from_s) {
  return {.file = file,
          .first_line = number * 100,
          .id = {.life = life, .part = number},
          .from_log_us = from_s * s_us,
          .until_log_us = (from_s + 30) * s_us,
          .from = TimePoint{std::chrono::seconds{from_s}},
          .until = TimePoint{std::chrono::seconds{from_s + 30}}};
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
  CHECK(told({part("a", 7, 1, 100), part("a", 7, 1, 100)}) == std::vector<std::string>{"a:100: duplicate part"});
  CHECK(told({part("c", 7, 3, 160), part("a", 7, 1, 100), part("b", 7, 2, 130)}) ==
        std::vector<std::string>{"a:100: parts out of order"});
  CHECK(told({part("a", 7, 5, 100), part("b", 8, 1, 190)}) ==
        std::vector<std::string>{"b:100: new session, started 60.0 s after the end of the previous one"});
  CHECK(told({part("a", 7, 5, 100), part("b", 8, 1, 90)}) ==
        std::vector<std::string>{"b:100: new session, started 40.0 s before the end of the previous one"});
}

TEST_CASE("a clock that was set between parts or within one is reported once, and is no time that is missing",
          "[unit][recording][clock]") {
  // 30 s later by the core's clock.
  const auto set = [](PartSpan span, std::int64_t by_s) {
    span.from_log_us += by_s * s_us;
    span.until_log_us += by_s * s_us;
    return span;
  };
  CHECK(told({part("a", 7, 1, 100), set(part("a", 7, 2, 130), -3'600)}) ==
        std::vector<std::string>{"a:200: the clock was set back by 3600.0 s before this part"});
  CHECK(told({part("a", 7, 1, 100), set(part("a", 7, 2, 130), 1'700'000'000)}) ==
        std::vector<std::string>{"a:200: the clock was set forward by 1700000000.0 s before this part"});
  CHECK(told({part("a", 7, 1, 100), set(part("a", 7, 3, 160), -3'600), set(part("a", 7, 4, 190), -3'600)}) ==
        std::vector<std::string>{"a:300: 30.0 s are missing before this part",
                                 "a:300: the clock was set back by 3600.0 s before this part"});
  PartSpan within = part("a", 7, 1, 100);
  within.until_log_us += 50 * s_us;
  within.clock_settings = {{.line = 123, .by_us = 50 * s_us}};
  CHECK(told({within, set(part("a", 7, 2, 130), 50)}) ==
        std::vector<std::string>{"a:123: the clock was set forward by 50.0 s"});
  // Between two sessions, of which one has no clock, no time is known.
  CHECK(told({set(part("a", 7, 1, 100), 1'700'000'000), part("b", 8, 1, 12)}) ==
        std::vector<std::string>{
            "b:100: new session; the clock of one session was not set, the time between them is unknown"});
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

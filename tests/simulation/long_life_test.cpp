// The start of the long run, and its overflows; bmud_simulation runs sixty days of it (docs/simulation.md).
#include "tests/simulation/long_life.hpp"

#include "tests/support/catch.hpp"

namespace bmu::test {
namespace {

void check_well(const LongResult& result) {
  INFO(to_text(result));
  CHECK(result.wrong.empty());
  CHECK(result.allocations == 0);
  CHECK(result.memory_last_kB <= result.memory_first_kB + 512);
}

}  // namespace

TEST_CASE("two hours with 49.7 days of milliseconds coming by in the middle: nothing wraps around, no memory is taken",
          "[simulation][long][time][slow]") {
  const Duration wrap = std::chrono::milliseconds{1LL << 32};
  const LongResult result = live_long({.length = 2h, .starts_at = TimePoint{wrap - 1h}});
  check_well(result);
  CHECK(result.times_closed == 2);
  CHECK(result.finely >= 12min);
}

TEST_CASE("65535 s since the start come by", "[slow][simulation][long][time]") {
  const LongResult result = live_long({.length = 18h + 30min});
  check_well(result);
  CHECK(result.lived > std::chrono::seconds{65'536});
}

TEST_CASE("a core that is called every 10 ms at night, too, lives the same", "[slow][simulation][long]") {
  const LongResult result = live_long({.length = 90min, .ticks_fully = true});
  check_well(result);
  CHECK(result.ticks >= 90 * 60 * 100);
}

TEST_CASE("a state of charge that steps by a hundredth after its first minutes is noticed",
          "[slow][simulation][long]") {
  const std::int32_t step_permille = GENERATE(10, -10);
  CAPTURE(step_permille);
  const auto steps = [step_permille](std::int32_t soc_permille, Duration lived) {
    return lived >= 15min && lived < 16min ? soc_permille + step_permille : soc_permille;
  };
  const LongResult result = live_long({.length = 20min, .told = steps});
  INFO(to_text(result));
  // There and back.
  CHECK(result.wrong == std::vector<std::string>{"after 0.250 h: the state of charge steps",
                                                 "after 0.267 h: the state of charge steps"});
}

}  // namespace bmu::test

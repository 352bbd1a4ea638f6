// Charge between two readings of the counter: the counted charge, and the time that was not counted.
#include "daemon/core/estimation/soc/current_spans.hpp"

#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

using namespace bmu;

namespace {

constexpr TimePoint start{10s};

/// Sensor with a sample every 10 ms, its counter, and the meter that reads it.
struct Counting {
  CoulombCounter counter;
  CurrentSpanMeter meter{200ms};
  TimePoint now = start;

  Counting() {
    counter.init(test::small_pack());
    sample(0);
    meter.begin(now, counter.state());
  }
  void sample(std::int32_t current_mA) {
    counter.observe({current_mA, now, Validity::valid}, {100'000, now, Validity::valid});
  }
  void flow(std::int32_t current_mA, Duration duration) {
    for (Duration passed{}; passed < duration; passed += 10ms) {
      now += 10ms;
      sample(current_mA);
    }
  }
  CurrentSpans look() { return meter.next(now, counter.state()); }
};

}  // namespace

TEST_CASE("a sensor that speaks all the time is counted over all the time", "[unit][estimators]") {
  Counting world;
  world.flow(2'000, 1s);
  world.look();
  world.flow(2'000, 500ms);
  const CurrentSpans spans = world.look();
  CHECK(spans.counted_s == Approx(0.5));
  CHECK(spans.mean_current_A == Approx(2.0));
  CHECK(spans.uncounted_s == 0.0);
}

TEST_CASE("time ends with the sensor's last sample while it speaks", "[unit][estimators]") {
  Counting world;
  world.flow(2'000, 100ms);
  world.look();
  world.flow(2'000, 100ms);
  world.now += 200ms;  // the longest time between two samples
  const CurrentSpans spans = world.look();
  CHECK(spans.counted_s == Approx(0.1));
  CHECK(spans.uncounted_s == 0.0);
  world.sample(2'000);
  const CurrentSpans after = world.look();
  CHECK(after.counted_s == Approx(0.2));
  CHECK(after.mean_current_A == Approx(2.0));
  CHECK(after.uncounted_s == 0.0);
}

TEST_CASE("a silence is told once, as long as it was, beside what was counted", "[unit][estimators]") {
  Counting world;
  world.flow(3'000, 100ms);
  world.look();
  world.flow(3'000, 100ms);
  world.now += 300ms;
  const CurrentSpans first = world.look();
  CHECK(first.counted_s == Approx(0.1));
  CHECK(first.mean_current_A == Approx(3.0));
  CHECK(first.uncounted_s == Approx(0.3));
  world.now += 1s;
  const CurrentSpans second = world.look();
  CHECK(second.counted_s == 0.0);
  CHECK(second.uncounted_s == Approx(1.0));
  world.now += 50ms;
  world.sample(3'000);
  world.flow(3'000, 200ms);
  const CurrentSpans third = world.look();
  CHECK(third.counted_s == Approx(0.2));
  CHECK(third.mean_current_A == Approx(3.0));
  CHECK(third.uncounted_s == Approx(0.05));
}

TEST_CASE("before the first sample nothing was counted", "[unit][estimators]") {
  CurrentSpanMeter meter(200ms);
  const ChargeState never;
  meter.begin(start, never);
  const CurrentSpans spans = meter.next(start + 2s, never);
  CHECK(spans.counted_s == 0.0);
  CHECK(spans.mean_current_A == 0.0);
  CHECK(spans.uncounted_s == Approx(2.0));
}

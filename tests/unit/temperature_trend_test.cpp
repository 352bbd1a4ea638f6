// How fast cells warm up: exact rates, edges of the times, and the fault that a runaway becomes.
#include "daemon/core/temperature_trend.hpp"

#include <vector>

#include "config/pack_fields.hpp"
#include "daemon/core/poll_pace.hpp"
#include "protocol/image.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"
#include "tests/support/module_feed.hpp"

using namespace bmu;
using test::ModuleFeed;

namespace {

/// A sensor's temperatures, one each 100 ms unless said otherwise.
class Warming {
 public:
  explicit Warming(const CoreConfig& config = test::small_pack()) : feed_(config) {}

  void sample(std::int32_t temperature_dC, Duration later = 100ms) {
    feed_.pass(later);
    feed_.temperatures(2, {known(250), known(temperature_dC)});
    trend_.update(feed_.modules());
  }
  /// Both sensors at the same temperature.
  void sample_both(std::int32_t temperature_dC, Duration later = 100ms) {
    feed_.pass(later);
    feed_.temperatures(2, {known(temperature_dC), known(temperature_dC)});
    trend_.update(feed_.modules());
  }
  void sample_unknown() {
    feed_.pass(100ms);
    feed_.temperatures(2, {known(250), not_known(Validity::open_circuit)});
    trend_.update(feed_.modules());
  }
  void sample_none() {
    feed_.pass(100ms);
    feed_.temperatures(2, {not_known(Validity::open_circuit), not_known(Validity::open_circuit)});
    trend_.update(feed_.modules());
  }
  [[nodiscard]] Reading fastest() const { return trend_.fastest_mK_per_s(feed_.modules()); }
  [[nodiscard]] TimePoint now() const { return feed_.now(); }
  void forget() { trend_.forget(); }

 private:
  ModuleFeed feed_;
  TemperatureTrend trend_;
};

}  // namespace

TEST_CASE("a rise is known after a second of samples, and not before", "[unit][temperature][F8]") {
  Warming warming;
  CHECK_FALSE(warming.fastest().is_known);
  warming.sample(250, 1ms);
  for (int sample = 0; sample < 9; ++sample) warming.sample(250);
  CHECK_FALSE(warming.fastest().is_known);
  warming.sample(251);
  REQUIRE(warming.fastest().is_known);
  CHECK(warming.fastest().value == 100);  // 0.1 K in exactly a second
  CHECK(warming.fastest().taken_at == warming.now());
  CHECK(warming.fastest().element == Element{.module_node = 2, .number = 2, .is_temperature_sensor = true});
}

TEST_CASE("a steady rise is read as what it is, within a step of the sensor over the window", "[unit][temperature]") {
  for (const std::int32_t rate_dC_per_s : {-20, 0, 1, 5, 10, 50}) {
    Warming warming;
    for (int sample = 0; sample <= 60; ++sample) {
      warming.sample(250 + rate_dC_per_s * sample / 10);
      if (sample < 30) continue;
      // The other sensor stands still, so that the fastest is at least 0.
      const std::int64_t expected_mK_per_s = std::int64_t{std::max(rate_dC_per_s, 0)} * 100;
      CHECK(warming.fastest().value >= expected_mK_per_s - 50);
      CHECK(warming.fastest().value <= expected_mK_per_s + 50);
    }
  }
}

TEST_CASE("one wrong sample is gone from the rise when the next one comes", "[unit][temperature]") {
  Warming warming;
  for (int sample = 0; sample < 30; ++sample) warming.sample(250);
  warming.sample(300);  // as far as is no jump yet
  CHECK(warming.fastest().value > 2'000);
  warming.sample(250);
  CHECK(warming.fastest().value == 0);
}

TEST_CASE("a sensor that was not measured begins anew", "[unit][temperature]") {
  Warming warming;
  for (int sample = 0; sample < 30; ++sample) warming.sample(250);
  warming.sample_unknown();
  warming.sample(300);
  CHECK(warming.fastest().value == 0);  // of the sensors that stayed
  for (int sample = 0; sample < 20; ++sample) warming.sample(300);
  CHECK(warming.fastest().value == 0);
}

TEST_CASE("a rise is that of the last two seconds, however often a sensor speaks", "[unit][temperature]") {
  for (const Duration period : {Duration{250ms}, Duration{125ms}, Duration{50ms}}) {
    Warming warming;
    for (Duration passed{}; passed < 10s; passed += period) warming.sample(250, period);
    warming.sample(300, period);
    REQUIRE(warming.fastest().is_known);
    // 5 K within the window: eight spaces of 250 ms, and the samples since the last of them.
    CHECK(warming.fastest().value <= 2'500);
    CHECK(warming.fastest().value > 5'000 * 1'000 / 2'250);
    warming.sample(300, period);
    warming.sample(300, 1s);
    CHECK(warming.fastest().value >= 5'000 * 1'000 / 3'250);
    for (int sample = 0; sample < 3; ++sample) warming.sample(300, 1s);
    CHECK(warming.fastest().value > 0);  // nine values reach back further where they come slowly
    for (Duration passed{}; passed < 10s; passed += period) warming.sample(300, period);
    CHECK(warming.fastest().value == 0);
  }
}

TEST_CASE("the first sensor of the first module is watched like any other", "[unit][temperature]") {
  ModuleFeed feed(test::small_pack());
  TemperatureTrend trend;
  for (int sample = 0; sample <= 20; ++sample) {
    feed.pass(100ms);
    feed.temperatures(1, {known(250 + sample), known(250)});
    trend.update(feed.modules());
  }
  CHECK(trend.fastest_mK_per_s(feed.modules()).value == 1'000);
  CHECK(trend.fastest_mK_per_s(feed.modules()).element ==
        Element{.module_node = 1, .number = 1, .is_temperature_sensor = true});
}

TEST_CASE("a sensor begins anew after a gap that is longer than a temperature counts as fresh at the slowest pace",
          "[unit][temperature][F8]") {
  const Duration fresh = ages_at(PollPace::parked, {}, {.parked_period = parked_period_max}).temperature;
  for (const auto& [hole, is_known] : {std::pair{fresh, true}, std::pair{fresh + 1ns, false}}) {
    Warming warming;
    warming.sample_both(250);
    warming.sample_both(271, hole);
    CHECK(warming.fastest().is_known == is_known);
    if (is_known) CHECK(warming.fastest().value == 2'000);  // 2.1 K in 1.05 s
  }
}

TEST_CASE("of a parked pack one lost answer does not hide a rise", "[unit][temperature][F8]") {
  Warming warming;
  for (int sample = 0; sample < 6; ++sample) warming.sample_both(250 + 5 * sample, 500ms);
  warming.sample_both(290, 2 * parked_period_max + 1ms);  // the answers come 1 ms later than before
  REQUIRE(warming.fastest().is_known);
  CHECK(warming.fastest().value == 40 * 100 * 1'000 / 3'501);
}

TEST_CASE("of sensors that cool the one that does so slowest is told, and of equal ones the first",
          "[unit][temperature]") {
  Warming warming;
  for (int sample = 0; sample < 30; ++sample) warming.sample_both(250 - sample);
  REQUIRE(warming.fastest().is_known);
  CHECK(warming.fastest().value == -1'000);
  CHECK(warming.fastest().element == Element{.module_node = 2, .number = 1, .is_temperature_sensor = true});
  warming.sample_none();
  CHECK_FALSE(warming.fastest().is_known);
}

TEST_CASE("nothing new changes nothing, and forgetting forgets everything", "[unit][temperature]") {
  Warming warming;
  for (int sample = 0; sample < 30; ++sample) warming.sample(250 + sample);
  const Reading before = warming.fastest();
  CHECK(before.value == 1'000);
  warming.forget();
  CHECK_FALSE(warming.fastest().is_known);
  for (int sample = 0; sample < 9; ++sample) warming.sample(500);
  CHECK_FALSE(warming.fastest().is_known);
}

TEST_CASE("a sensor silent for a minute does not hide a fast rise behind the minute", "[unit][temperature]") {
  Warming warming;
  for (int sample = 0; sample < 30; ++sample) warming.sample(250);
  warming.sample(250, 60s);
  for (int sample = 0; sample < 12; ++sample) warming.sample(250 + 2 * (sample + 1));  // 2 K/s
  CHECK(warming.fastest().value >= 1'800);
}

TEST_CASE("a runaway cell opens the pack, sun and load do not", "[unit][core][temperature]") {
  CoreConfig config = test::small_pack();
  config.limits.temperature_rise = LimitsConfig{}.temperature_rise;
  const auto warm = [](test::CoreBench& bench, std::int64_t rate_dC_per_s, Duration duration) {
    const TimePoint from = bench.now();
    bench.before_poll = [&bench, from, rate_dC_per_s] {
      const std::int64_t passed_ms = to_ms(bench.now() - from);
      bench.modules[1].cell_temperature_dC[1] = known(250 + rate_dC_per_s * passed_ms / 1'000);
    };
    return bench.run_until([&bench] { return bench.is_active(FaultId::temperature_rise); }, duration);
  };
  test::CoreBench hot(config);
  REQUIRE(hot.close());
  hot.run(3s);
  const TimePoint from = hot.now();
  REQUIRE(warm(hot, 12, 5s));
  CHECK(hot.now() - from <= 3'500ms);
  CHECK_FALSE(hot.commanded().any_contactor());
  CHECK(hot.core().last_opening().fault == FaultId::temperature_rise);
  CHECK(hot.core().last_opening().reading.element ==
        Element{.module_node = 2, .number = 2, .is_temperature_sensor = true});
  test::CoreBench warm_only(config);
  REQUIRE(warm_only.close());
  CHECK_FALSE(warm(warm_only, 1, 20s));  // a kelvin in ten seconds, far more than any load
  CHECK(warm_only.commanded().main_positive);
}

TEST_CASE("a jump counts once it is believed, from what was before it", "[unit][temperature][F2][F8]") {
  ModuleFeed feed(test::small_pack());
  TemperatureTrend trend;
  const auto sample = [&](std::int32_t temperature_dC) {
    feed.pass(100ms);
    feed.poll();
    feed.temperatures(2, {known(250), known(temperature_dC)});
    trend.update(feed.modules());
  };
  for (int count = 0; count < 20; ++count) sample(250);
  for (int count = 0; count < 6; ++count) sample(550);
  CHECK(trend.fastest_mK_per_s(feed.modules()).value == 0);
  sample(550);
  CHECK(trend.fastest_mK_per_s(feed.modules()).value > 10'000);
}

TEST_CASE("an image in which a ring reaches beyond its samples is refused", "[unit][temperature][image]") {
  const TemperatureTrend written;
  std::vector<std::uint8_t> bytes(image_size(written));
  REQUIRE(write_image(written, bytes) == bytes.size());
  // The first sensor's newest sample and its nine older ones, of 4 and 8 bytes, then how many there are, and where the
  // next goes.
  constexpr std::size_t count_at = 10 * 12;
  constexpr std::size_t head_at = count_at + 1;
  const auto problem_of = [&bytes](std::size_t at, std::uint8_t value) {
    std::vector<std::uint8_t> changed = bytes;
    changed[at] = value;
    TemperatureTrend trend;
    return read_image(std::span<const std::uint8_t>(changed), trend);
  };
  CHECK_FALSE(problem_of(count_at, 9));
  CHECK(problem_of(count_at, 10) == ImageProblem::no_state);
  CHECK_FALSE(problem_of(head_at, 8));
  CHECK(problem_of(head_at, 9) == ImageProblem::no_state);
}

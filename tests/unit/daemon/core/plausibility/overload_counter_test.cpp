// Overload counter: the count itself, the resulting fault, and the limit that falls before.
#include "daemon/core/plausibility/overload_counter.hpp"

#include <cmath>
#include <vector>

#include "daemon/core/faults/fault_readers.hpp"
#include "daemon/core/limits/limits.hpp"
#include "protocol/image.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

using namespace bmu;

namespace {

constexpr TimePoint start{10s};

/// The switch of BMS_NF.7: 25 A continuously, 50 A for 10 s; charging 10 A, 20 A for 5 s.
constexpr CurrentLimitConfig nf7{.discharge_continuous_mA = 25'000,
                                 .discharge_peak_mA = 50'000,
                                 .discharge_peak_for = 10s,
                                 .charge_continuous_mA = 10'000,
                                 .charge_peak_mA = 20'000,
                                 .charge_peak_for = 5s};

class Counted {
 public:
  explicit Counted(const CurrentLimitConfig& config = nf7) { counter_.init(config); }

  void sample(std::int32_t current_mA, Duration later = 20ms) {
    now_ += later;
    counter_.observe({current_mA, now_, Validity::valid});
  }
  /// A constant current from now on, sampled every 20 ms.
  void flow(std::int32_t current_mA, Duration duration) {
    const TimePoint end = now_ + duration;
    while (now_ < end) sample(current_mA);
  }
  /// Time from the first sample of this current until everything is used up; at most an hour.
  [[nodiscard]] Duration until_used_up(std::int32_t current_mA) {
    sample(current_mA);
    const TimePoint from = now_;
    while (discharge_permille() < 1'000 && charge_permille() < 1'000 && now_ - from < 1h) sample(current_mA);
    return now_ - from;
  }

  [[nodiscard]] std::int64_t discharge_permille() const { return counter_.discharge_used_permille(); }
  [[nodiscard]] std::int64_t charge_permille() const { return counter_.charge_used_permille(); }
  [[nodiscard]] TimePoint now() const { return now_; }
  [[nodiscard]] const OverloadCounter& counter() const { return counter_; }

 private:
  OverloadCounter counter_;
  TimePoint now_ = start;
};

/// (peak^2 - continuous^2) * time of the peak, divided by the excess of this current.
Duration by_formula(double current_A) {
  const double seconds = (50.0 * 50.0 - 25.0 * 25.0) * 10.0 / (current_A * current_A - 25.0 * 25.0);
  return std::chrono::duration_cast<Duration>(std::chrono::duration<double>(seconds));
}

}  // namespace

TEST_CASE("the peak current for its time uses everything up, exactly then", "[unit][current][BMS_NF.7]") {
  Counted counted;
  CHECK(counted.until_used_up(50'000) == 10s);
  CHECK(counted.discharge_permille() == 1'000);
  CHECK(counted.charge_permille() == 0);
}

TEST_CASE("other currents use it up as the square of them says", "[unit][current][BMS_NF.7]") {
  for (const double current_A : {30.0, 40.0, 49.0, 51.0, 60.0, 75.0, 100.0}) {
    Counted counted;
    const Duration took = counted.until_used_up(static_cast<std::int32_t>(std::lround(current_A * 1'000)));
    CHECK(took >= by_formula(current_A) - 20ms);
    CHECK(took <= by_formula(current_A) + 20ms);
  }
}

TEST_CASE("the continuous current may flow for ever, a little more may not", "[unit][current][BMS_NF.7]") {
  Counted at;
  at.flow(25'000, 1h);
  CHECK(at.discharge_permille() == 0);
  Counted above;
  above.flow(26'000, 1h);
  CHECK(above.discharge_permille() == 2'000);  // maximum of the count
}

TEST_CASE("what was used up comes back while less than the continuous current flows", "[unit][current][BMS_NF.7]") {
  Counted counted;
  CHECK(counted.until_used_up(50'000) == 10s);
  counted.sample(0);  // the smaller of the two samples counts from the last one at 50 A
  CHECK(counted.discharge_permille() < 1'000);
  counted.flow(0, 15s - 20ms);  // 625 A^2 s a second of 18750
  CHECK(counted.discharge_permille() == 500);
  counted.sample(25'000);
  const std::int64_t left_permille = counted.discharge_permille();
  counted.flow(25'000, 10min);
  CHECK(counted.discharge_permille() == left_permille);
  counted.flow(0, 15s);
  CHECK(counted.discharge_permille() == 0);
  counted.sample(50'000);
  CHECK(counted.until_used_up(50'000) == 10s - 20ms);  // recovered, and no credit below zero was accumulated
}

TEST_CASE("one absurd sample adds nothing, two add what lies between them", "[unit][current][BMS_NF.7]") {
  Counted counted;
  counted.flow(10'000, 1s);
  counted.sample(5'000'000);
  counted.sample(10'000);
  CHECK(counted.discharge_permille() == 0);
  counted.sample(75'000);
  counted.sample(75'000);
  CHECK(counted.discharge_permille() == (75 * 75 - 25 * 25) * 20 / 18'750);
}

TEST_CASE("a hole in the samples neither fills nor empties", "[unit][current][BMS_NF.7]") {
  for (const auto& [hole, is_counted] :
       {std::pair{Duration{1s}, true}, std::pair{1s + 1ns, false}, std::pair{Duration{1min}, false}}) {
    Counted filling;
    filling.sample(50'000);
    filling.sample(50'000, hole);
    CHECK(filling.discharge_permille() == (is_counted ? 100 : 0));
    Counted emptying;
    (void)emptying.until_used_up(50'000);
    emptying.sample(0, 20ms);
    const std::int64_t before = emptying.discharge_permille();
    emptying.sample(0, hole);
    CHECK((emptying.discharge_permille() < before) == is_counted);
  }
}

TEST_CASE("a sample told twice or out of order counts for nothing", "[unit][current]") {
  OverloadCounter counter;
  counter.init(nf7);
  const auto observe = [&](TimePoint at) { counter.observe({50'000, at, Validity::valid}); };
  observe(start + 1s);
  observe(start + 1s);
  observe(start);
  CHECK(counter.discharge_used_permille() == 0);
  observe(start + 1s);
  CHECK(counter.discharge_used_permille() == 100);
  CHECK(counter.counted_at() == start + 1s);
  observe(start);  // a time that runs backwards reduces nothing either
  CHECK(counter.discharge_used_permille() == 100);
}

TEST_CASE("each direction has a count of its own", "[unit][current][BMS_NF.7]") {
  Counted counted;
  CHECK(counted.until_used_up(-20'000) == 5s);
  CHECK(counted.charge_permille() == 1'000);
  CHECK(counted.discharge_permille() == 0);
  counted.sample(50'000);  // between opposite directions no current counts
  CHECK(counted.discharge_permille() == 0);
  CHECK(counted.charge_permille() < 1'000);
  counted.flow(-10'000, 1min);
  const std::int64_t left_permille = counted.charge_permille();
  CHECK(left_permille > 990);
  counted.flow(50'000, 10s + 20ms);
  CHECK(counted.discharge_permille() == 1'000);
  CHECK(counted.charge_permille() < left_permille);  // recovers while the other one fills
}

TEST_CASE("without a peak nothing is counted, and the largest configuration does not overflow", "[unit][current]") {
  Counted none(CurrentLimitConfig{.discharge_continuous_mA = 25'000});
  none.flow(5'000'000, 1min);
  CHECK(none.discharge_permille() == 0);
  Counted equal(CurrentLimitConfig{.discharge_continuous_mA = 25'000, .discharge_peak_mA = 25'000});
  equal.flow(5'000'000, 1min);
  CHECK(equal.discharge_permille() == 0);
  Counted large(
      CurrentLimitConfig{.discharge_continuous_mA = 1'000, .discharge_peak_mA = 1'500'000, .discharge_peak_for = 120s});
  CHECK(large.until_used_up(1'500'000) == 120s);
  large.sample(5'000'000, 1s);
  large.sample(5'000'000, 1s);
  large.flow(5'000'000, 1min);
  CHECK(large.discharge_permille() == 2'000);
}

TEST_CASE("a peak below the continuous current is none, and neither is one too small to share", "[unit][current]") {
  Counted below(CurrentLimitConfig{.discharge_continuous_mA = 25'000, .discharge_peak_mA = 24'000});
  below.flow(5'000'000, 1s);
  CHECK(below.discharge_permille() == 0);
  // 0.01 A * 0.01 A for 1 ms are 1000 of the counter's units: one per permille. Anything less cannot be divided.
  for (const auto& [peak_for, used_permille] : {std::pair{Duration{1ms}, 2'000}, std::pair{Duration{999us}, 0}}) {
    Counted smallest(CurrentLimitConfig{.discharge_peak_mA = 10, .discharge_peak_for = peak_for});
    CHECK(smallest.discharge_permille() == 0);
    smallest.sample(10);
    smallest.sample(10, 20ms);
    CHECK(smallest.discharge_permille() == used_permille);
  }
}

TEST_CASE("a current is rounded up to a centiampere, so that heat is never counted short", "[unit][current]") {
  const auto used_permille = [](std::int32_t current_mA) {
    Counted counted(CurrentLimitConfig{
        .discharge_peak_mA = 100, .discharge_peak_for = 1s, .charge_peak_mA = 100, .charge_peak_for = 1s});
    counted.sample(current_mA);
    counted.sample(current_mA, 1s);
    return current_mA > 0 ? counted.discharge_permille() : counted.charge_permille();
  };
  CHECK(used_permille(1) == 10);
  CHECK(used_permille(10) == 10);
  CHECK(used_permille(11) == 40);
  CHECK(used_permille(20) == 40);
  CHECK(used_permille(-11) == 40);
}

TEST_CASE("a count cools while the current flows the other way, even of the smallest peak", "[unit][current]") {
  const CurrentLimitConfig tiny{
      .discharge_continuous_mA = 10, .discharge_peak_mA = 20, .charge_continuous_mA = 10, .charge_peak_mA = 20};
  for (const std::int32_t sign : {1, -1}) {
    Counted counted(tiny);
    const auto used_permille = [&] { return sign > 0 ? counted.discharge_permille() : counted.charge_permille(); };
    (void)counted.until_used_up(sign * 20);
    counted.sample(-sign * 20);
    counted.sample(-sign * 20, 1s);
    CHECK(used_permille() == 966);  // of 30 cA^2 s one a second, for 1.02 s
  }
}

TEST_CASE("a count that is restored for a smaller peak is at most twice what that one allows",
          "[unit][current][image]") {
  Counted counted;
  counted.flow(50'000, 30s);
  REQUIRE(counted.discharge_permille() == 2'000);
  std::vector<std::uint8_t> bytes(image_size(counted.counter()));
  write_image(counted.counter(), bytes);
  CurrentLimitConfig smaller = nf7;
  smaller.discharge_peak_for = 1s;
  OverloadCounter other;
  other.init(smaller);
  REQUIRE_FALSE(read_image(bytes, other));
  CHECK(other.discharge_used_permille() == 2'000);
}

TEST_CASE("the published limit stays at the peak for half of it and sinks to the continuous current",
          "[unit][limits][BMS_NF.7][BMU_13]") {
  CoreConfig config = test::small_pack();
  config.current = nf7;
  PackState pack;
  pack.cell_voltage_uV = {.min = 3'700'000, .max = 3'700'000, .count = 8, .expected = 8};
  pack.cell_temperature_dC = {.min = 250, .max = 250, .count = 4, .expected = 4};
  const auto limits = [&](std::int64_t used_permille) {
    return evaluate_limits(pack, config,
                           {.is_connected = true,
                            .may_discharge = true,
                            .may_charge = true,
                            .discharge_used_permille = used_permille,
                            .charge_used_permille = used_permille});
  };
  CHECK(limits(0).discharge.limit_mA == 50'000);
  CHECK(limits(0).discharge.cause == LimitCause::peak);
  CHECK(limits(500).discharge.limit_mA == 50'000);
  CHECK(limits(501).discharge.limit_mA == 49'937);
  CHECK(limits(501).discharge.cause == LimitCause::overload);
  CHECK(limits(501).discharge.value == 501);
  CHECK(limits(501).discharge.threshold == 1'000);
  CHECK(limits(700).discharge.limit_mA == 37'500);
  CHECK(limits(700).charge.limit_mA == 15'000);
  CHECK(limits(899).discharge.limit_mA == 25'062);
  CHECK(limits(900).discharge.limit_mA == 25'000);
  CHECK(limits(1'000).discharge.limit_mA == 25'000);
  CHECK(limits(2'000).discharge.limit_mA == 25'000);
  CHECK(limits(2'000).charge.limit_mA == 10'000);
  pack.cell_temperature_dC.max = 550;  // half of the remaining limit, whatever it is
  CHECK(limits(0).discharge.limit_mA == 25'000);
  CHECK(limits(0).discharge.cause == LimitCause::cell_hot);
  CHECK(limits(1'000).discharge.limit_mA == 12'500);
}

TEST_CASE("a closed pack with 50 A instead of 25 A: the limit sinks, after 10 s it is a fault, and it opens",
          "[unit][core][BMS_NF.7][BMU_13]") {
  CoreConfig config = test::small_pack();
  config.current = nf7;
  config.limits.stuck_values = never_above;  // the cells of the bench do not follow a current
  test::CoreBench bench(config);
  REQUIRE(bench.close());
  CHECK(bench.core().limits().discharge.limit_mA == 50'000);
  bench.current_mA = 25'000;
  bench.run(60s);
  CHECK(bench.core().limits().discharge.limit_mA == 50'000);
  bench.current_mA = 50'000;
  const TimePoint from = bench.now();
  REQUIRE(bench.run_until([&] { return bench.core().limits().discharge.limit_mA < 50'000; }, 6s));
  CHECK(bench.now() - from >= 4'900ms);
  CHECK(bench.now() - from <= 5'100ms);
  REQUIRE(bench.run_until([&] { return bench.is_active(FaultId::discharge_overload); }, 6s));
  CHECK(bench.now() - from >= 9'900ms);
  CHECK(bench.now() - from <= 10'100ms);
  CHECK(bench.core().limits().discharge.limit_mA == 0);
  CHECK(bench.commanded().main_positive);  // zero current is requested first
  REQUIRE(bench.run_until([&] { return !bench.commanded().any_contactor(); }, 1s));
  CHECK(bench.now() - from <= 10'450ms);
}

TEST_CASE("who lowers the current when the limit falls keeps the pack closed", "[unit][core][BMS_NF.7][BMU_13]") {
  CoreConfig config = test::small_pack();
  config.current = nf7;
  config.limits.stuck_values = never_above;  // the cells of the bench do not follow a current
  test::CoreBench bench(config);
  REQUIRE(bench.close());
  bench.each_ms = [&bench] { bench.current_mA = bench.core().limits().discharge.limit_mA; };
  bench.run(10min);
  CHECK(bench.commanded().main_positive);
  CHECK_FALSE(bench.is_active(FaultId::discharge_overload));
  CHECK(bench.core().watchers().overload.discharge_used_permille() <= 905);
  CHECK(bench.current_mA >= 25'000);
  CHECK(bench.current_mA < 25'500);
}

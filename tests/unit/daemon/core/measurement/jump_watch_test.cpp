// Temperature jumps: accepted only if a later sample confirms them.
#include "daemon/core/measurement/jump_watch.hpp"

#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

using namespace bmu;

namespace {

constexpr TimePoint start{100s};
constexpr Duration answer_after = 4ms;

/// One sensor, received 4 ms after each POLL.
class Told {
 public:
  Measured<std::int32_t> tell(std::int32_t temperature_dC, Duration at) {
    return watch_.take({temperature_dC, start + at + answer_after, Validity::valid}, start + at);
  }
  Measured<std::int32_t> tell_none(Duration at) {
    return watch_.take({0, start + at + answer_after, Validity::open_circuit}, start + at);
  }
  [[nodiscard]] Validity validity(std::int32_t temperature_dC, Duration at) {
    return tell(temperature_dC, at).validity;
  }
  [[nodiscard]] bool is_worth_asking(Duration at) const { return watch_.is_worth_asking(start + at); }

 private:
  JumpWatch watch_;
};

}  // namespace

TEST_CASE("what moves by 5 K a sample is believed at once, what moves further is doubtful", "[unit][temperature][F2]") {
  for (const std::int32_t sign : {1, -1}) {
    Told sensor;
    CHECK(sensor.validity(250, 0ms) == Validity::valid);
    CHECK(sensor.validity(250 + sign * 50, 100ms) == Validity::valid);
    CHECK(sensor.validity(250 + sign * 101, 200ms) == Validity::doubtful);
    CHECK(sensor.validity(250 + sign * 100, 300ms) == Validity::valid);  // relative to the last accepted value
  }
}

TEST_CASE("a value keeps its number and its time in doubt", "[unit][temperature][F2]") {
  Told sensor;
  static_cast<void>(sensor.tell(250, 0ms));
  const Measured<std::int32_t> doubtful = sensor.tell(700, 100ms);
  CHECK(doubtful.value == 700);
  CHECK(doubtful.taken_at == start + 104ms);
  CHECK_FALSE(doubtful.is_valid());
}

TEST_CASE("a jump is believed from the first answer on that can only hold another sample", "[unit][temperature][F2]") {
  // First received at 104 ms; the next sample is taken up to 500 ms later, by a clock that may be 1 % slow.
  for (const auto& [asked_at, is_believed] :
       {std::pair{Duration{609ms - 1ns}, false}, std::pair{Duration{609ms}, true}}) {
    Told sensor;
    static_cast<void>(sensor.tell(250, 0ms));
    CHECK(sensor.validity(700, 100ms) == Validity::doubtful);
    CHECK(sensor.validity(700, 500ms) == Validity::doubtful);
    CHECK(sensor.is_worth_asking(asked_at) == is_believed);
    CHECK((sensor.validity(695, asked_at) == Validity::valid) == is_believed);
    CHECK_FALSE((sensor.is_worth_asking(asked_at) && is_believed));
  }
}

TEST_CASE("a module that does not answer is asked for half a second", "[unit][temperature][F2]") {
  Told sensor;
  static_cast<void>(sensor.tell(250, 0ms));
  static_cast<void>(sensor.tell(700, 100ms));
  CHECK(sensor.is_worth_asking(1'104ms - 1ns));
  CHECK_FALSE(sensor.is_worth_asking(1'104ms));
}

TEST_CASE("one wild sample is never believed, whenever it is told", "[unit][temperature][F2]") {
  for (Duration shift{}; shift < 100ms; shift += 1ms) {
    Told sensor;
    for (Duration at{}; at < 3s; at += 100ms) {
      const bool is_wild = at + answer_after >= 1s + shift && at + answer_after < 1500ms + shift;
      const Measured<std::int32_t> told = sensor.tell(is_wild ? 1'200 : 250, at);
      CHECK(told.validity == (is_wild ? Validity::doubtful : Validity::valid));
    }
  }
}

TEST_CASE("a jump the other way begins a doubt of its own", "[unit][temperature][F2]") {
  Told sensor;
  static_cast<void>(sensor.tell(250, 0ms));
  CHECK(sensor.validity(700, 100ms) == Validity::doubtful);
  CHECK(sensor.validity(-200, 600ms) == Validity::doubtful);
  CHECK(sensor.validity(-200, 700ms) == Validity::doubtful);  // one sampling period after the first jump, not its own
  CHECK_FALSE(sensor.is_worth_asking(700ms));
}

TEST_CASE("without a former value there is no jump", "[unit][temperature][F2]") {
  Told sensor;
  CHECK(sensor.validity(700, 0ms) == Validity::valid);
  CHECK(sensor.validity(250, 1s) == Validity::doubtful);
  Told silent;
  static_cast<void>(silent.tell(700, 0ms));
  CHECK(silent.validity(250, 1s + 1ns) == Validity::valid);  // cooled down while not measured
  CHECK_FALSE(silent.is_worth_asking(10s));
}

TEST_CASE("without a doubt nobody is asked, whatever the clock says", "[unit][temperature][F2]") {
  const JumpWatch fresh;
  for (const Duration since_boot : {0ms, 300ms, 504ms, 505ms, 700ms, 999ms, 1'000ms}) {
    CHECK_FALSE(fresh.is_worth_asking(TimePoint{since_boot}));
  }
}

TEST_CASE("behind a hole of a moment a jump is one, and its doubt begins anew", "[unit][temperature][F2]") {
  Told sensor;
  static_cast<void>(sensor.tell(250, 0ms));
  CHECK(sensor.tell_none(100ms).validity == Validity::open_circuit);
  CHECK(sensor.validity(700, 200ms) == Validity::doubtful);
  CHECK(sensor.tell_none(300ms).validity == Validity::open_circuit);
  CHECK_FALSE(sensor.is_worth_asking(900ms));
  CHECK(sensor.validity(700, 400ms) == Validity::doubtful);
  CHECK(sensor.validity(700, 900ms) == Validity::doubtful);
}

namespace {

/// Time after which a sensor with this pattern of absurd and valid samples of 500 ms counts as not measured; zero:
/// never.
Duration given_up_after(int wild, int sound) {
  Told sensor;
  for (Duration at{}; at < 60s; at += 100ms) {
    const bool is_wild = at >= 1s && at / 500ms % (wild + sound) < wild;
    const std::int32_t nonsense_dC = at / 500ms % 2 == 0 ? 900 : -300;
    if (sensor.tell(is_wild ? nonsense_dC : 250, at).validity == Validity::unknown) return at;
  }
  return {};
}

}  // namespace

TEST_CASE("a sensor that jumps back and forth is no longer measured, one that does so now and then is",
          "[unit][temperature][F9]") {
  CHECK(given_up_after(1, 1) == 4300ms);
  CHECK(given_up_after(1, 2) == 0ms);
  CHECK(given_up_after(1, 20) == 0ms);
}

TEST_CASE("a wild temperature for one sample of a module leaves a closed pack closed", "[unit][core][F2]") {
  for (const std::int32_t wild_dC : {900, -400}) {
    test::CoreBench bench(test::small_pack());
    REQUIRE(bench.close());
    bench.run(500ms);
    bench.modules[1].cell_temperature_dC[1] = known(wild_dC);
    bench.run(500ms);
    CHECK_FALSE(bench.core().pack().is_complete());
    CHECK_FALSE(bench.core().permission().may_close);
    bench.modules[1].cell_temperature_dC[1] = known(250);
    bench.run(2s);
    CHECK(bench.core().sequence().phase == Phase::closed);
    CHECK(bench.core().pack().is_complete());
    for (const FaultRow& row : fault_table()) CHECK(bench.core().faults().state(row.id).count == 0);
  }
}

TEST_CASE("a module whose temperature jumped is asked again when it has another sample, and a real jump opens",
          "[unit][core][F6]") {
  CoreConfig config = test::small_pack();
  config.poll.temperature_every = 5;  // the next regular poll of it is after 500 ms
  config.ages.temperature = 1100ms;
  test::CoreBench bench(config);
  REQUIRE(bench.close());
  bench.run(500ms);
  const TimePoint began_at = bench.now();
  bench.modules[1].cell_temperature_dC[1] = known(900);
  CHECK(bench.run_until([&] { return bench.core().sequence().phase == Phase::open; }, 3s));
  CHECK(bench.is_active(FaultId::cell_overtemperature));
  CHECK(bench.now() - began_at <= 500ms + 520ms + 170ms);
}

// Reasons to reject a result or a pulse, and the counters of each reason.
#include "daemon/core/measurement/refused_values.hpp"

#include <utility>

#include "protocol/tables/internal_bus.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

using namespace bmu;

namespace {

constexpr TimePoint start{100s};

/// Signal with a period that has just ended.
ir155::Pwm pwm_of(std::int32_t frequency_mHz, std::int32_t duty_permille) {
  return {.frequency_mHz = frequency_mHz, .duty_permille = duty_permille};
}

}  // namespace

TEST_CASE("a result that is not valid has one reason", "[unit][sensor_table]") {
  CHECK(refusal_of(Validity::sensor_fault) == ResultRefusal::sensor_fault);
  CHECK(refusal_of(Validity::open_circuit) == ResultRefusal::sensor_fault);
  CHECK(refusal_of(Validity::short_circuit) == ResultRefusal::sensor_fault);
  CHECK(refusal_of(Validity::out_of_range) == ResultRefusal::out_of_range);
  CHECK(refusal_of(Validity::above_range) == ResultRefusal::out_of_range);
  CHECK(refusal_of(Validity::unknown) == ResultRefusal::not_known);
  CHECK(refusal_of(Validity::not_fitted) == ResultRefusal::not_known);
  for (std::size_t one = 0; one < result_refusal_count; ++one) {
    for (std::size_t other = 0; other < one; ++other) {
      CHECK(to_text(static_cast<ResultRefusal>(one)) != to_text(static_cast<ResultRefusal>(other)));
    }
  }
}

TEST_CASE("an insulation monitor's pulses outside their bands are counted by what is in none", "[unit][ir155][F96]") {
  const std::pair<std::int32_t, std::int32_t> undefined_duties[] = {{10'000, 39},  {20'000, 961}, {30'000, 111},
                                                                    {30'000, 500}, {40'000, 464}, {50'000, 536}};
  for (const auto& [frequency_mHz, duty_permille] : undefined_duties) {
    INFO(frequency_mHz << " mHz, " << duty_permille << " permille");
    RefusedPulses pulses;
    pulses.observe(pwm_of(frequency_mHz, duty_permille), start);
    CHECK(pulses.of(ir155::Misfit::duty_cycle) == 1);
    CHECK(pulses.of(ir155::Misfit::frequency) == 0);
  }
  for (const std::int32_t frequency_mHz : {6'000, 8'999, 11'001, 25'000, 51'001, 1'000'000}) {
    INFO(frequency_mHz << " mHz");
    RefusedPulses pulses;
    pulses.observe(pwm_of(frequency_mHz, 500), start);
    CHECK(pulses.of(ir155::Misfit::frequency) == 1);
    CHECK(pulses.of(ir155::Misfit::duty_cycle) == 0);
  }
  RefusedPulses sound;
  TimePoint at = start;
  for (const ir155::Row& row : ir155::rows) {
    for (const std::int32_t duty_permille : {row.duty_min_permille, row.duty_max_permille}) {
      sound.observe(pwm_of(row.frequency_mHz, duty_permille), at += 100ms);
    }
  }
  CHECK(sound.by_reason == decltype(sound.by_reason){});
  CHECK(ir155::to_text(ir155::Misfit::frequency) != ir155::to_text(ir155::Misfit::duty_cycle));
}

TEST_CASE("a period of pulses is counted once, however often it is told, and silence is no pulse", "[unit][ir155]") {
  RefusedPulses pulses;
  ir155::Pwm pwm = pwm_of(25'000, 500);
  pulses.observe(pwm, start);
  pwm.since_edge = 10ms;  // another falling edge; the period is still the previous one
  pulses.observe(pwm, start + 10ms);
  pwm.since_edge = 10ms + 1us;  // ages are rounded up
  pulses.observe(pwm, start + 10ms);
  CHECK(pulses.of(ir155::Misfit::frequency) == 1);
  pwm.since_edge = {};
  pulses.observe(pwm, start + 40ms);
  CHECK(pulses.of(ir155::Misfit::frequency) == 2);
  pwm.since_edge = ir155::edge_silence_max + 1ns;
  pulses.observe(pwm, start + 10s);
  pulses.observe({}, start + 20s);
  CHECK(pulses.of(ir155::Misfit::frequency) == 2);
}

TEST_CASE("the core counts pulses of no state, and the sensor's frames that are not whole", "[unit][core][sensors]") {
  CoreConfig config = test::small_pack();
  config.insulation.has_pulse_line = true;
  test::CoreBench bench(config);
  bench.observe(PulsesSeen{.pwm = pwm_of(25'000, 500)});
  bench.run(100ms);
  bench.observe(PulsesSeen{.pwm = pwm_of(10'000, 990)});
  const SensorTable& sensors = bench.core().sensors();
  CHECK(sensors.refused_pulses.of(ir155::Misfit::frequency) == 1);
  CHECK(sensors.refused_pulses.of(ir155::Misfit::duty_cycle) == 1);
  CanFrame shorter = make_frame(internal_bus::sensor_current);
  shorter.length = 5;
  bench.observe(FrameReceived{Port::internal, shorter});
  CHECK(sensors.refused.frames[static_cast<std::size_t>(RejectReason::wrong_length)] == 1);
  CHECK(sensors.refused.count() == 0);
}

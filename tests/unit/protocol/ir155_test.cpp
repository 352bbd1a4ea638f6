// Pulse-width signal of the insulation monitor: every limit of every band, the vendor's table, and the inverse.
#include "protocol/ir155.hpp"

#include <algorithm>

#include "tests/support/catch.hpp"

namespace bmu::ir155 {
namespace {

constexpr Pwm pwm_of(std::int32_t frequency_mHz, std::int32_t duty_permille) {
  return {.frequency_mHz = frequency_mHz, .duty_permille = duty_permille};
}
State state_of(std::int32_t frequency_mHz, std::int32_t duty_permille) {
  return decode(pwm_of(frequency_mHz, duty_permille)).state;
}

/// The table a second time, as ranges with both ends, so that a wrong row or tolerance is detected.
State expected_state(std::int32_t frequency_mHz, std::int32_t duty_permille) {
  const auto within = [](std::int32_t value, std::int32_t low, std::int32_t high) {
    return value >= low && value <= high;
  };
  const std::int32_t duty = duty_permille;
  if (within(frequency_mHz, 9'000, 11'000) && within(duty, 40, 960)) return State::normal;
  if (within(frequency_mHz, 19'000, 21'000) && within(duty, 40, 960)) return State::undervoltage;
  if (within(frequency_mHz, 29'000, 31'000) && within(duty, 40, 110)) return State::speed_start_good;
  if (within(frequency_mHz, 29'000, 31'000) && within(duty, 890, 960)) return State::speed_start_bad;
  if (within(frequency_mHz, 39'000, 41'000) && within(duty, 465, 535)) return State::device_error;
  if (within(frequency_mHz, 49'000, 51'000) && within(duty, 465, 535)) return State::earth_fault;
  return State::undefined;
}

TEST_CASE("each state holds from edge to edge of its band, both ends included", "[unit][protocol][ir155][FS_3]") {
  for (const std::int32_t nominal_mHz : {10'000, 20'000, 30'000, 40'000, 50'000}) {
    for (const std::int32_t edge_mHz : {nominal_mHz - 1'000, nominal_mHz, nominal_mHz + 1'000}) {
      for (std::int32_t frequency_mHz = edge_mHz - 2; frequency_mHz <= edge_mHz + 2; ++frequency_mHz) {
        for (std::int32_t duty_permille = 0; duty_permille <= 1'000; ++duty_permille) {
          INFO(frequency_mHz << " mHz " << duty_permille << " permille");
          REQUIRE(state_of(frequency_mHz, duty_permille) == expected_state(frequency_mHz, duty_permille));
        }
      }
    }
  }
}

TEST_CASE("a frequency of no state is undefined, with whatever duty cycle", "[unit][protocol][ir155]") {
  for (const std::int32_t frequency_mHz :
       {1, 5'000, 8'999, 11'001, 15'000, 25'000, 35'000, 45'000, 51'001, 60'000, 1'000'000, INT32_MAX}) {
    for (const std::int32_t duty_permille : {-1, 0, 50, 500, 950, 1'000, 2'000}) {
      CHECK(decode(pwm_of(frequency_mHz, duty_permille)) == Reading{State::undefined, not_known()});
    }
  }
}

TEST_CASE("200 ms without an edge, and no later, is no signal: low or high by its level", "[unit][protocol][ir155]") {
  Pwm pwm = pwm_of(10'000, 500);
  for (const bool is_high : {false, true}) {
    pwm.is_high = is_high;
    const State silent = is_high ? State::no_signal_high : State::no_signal_low;
    pwm.since_edge = 200ms;
    CHECK(decode(pwm).state == State::normal);
    pwm.since_edge = 200ms + 1ns;
    CHECK(decode(pwm) == Reading{silent, not_known()});
    pwm.since_edge = 24h;
    CHECK(decode(pwm).state == silent);
    CHECK(decode({.is_high = is_high}).state == silent);
    CHECK(decode({.frequency_mHz = -1, .duty_permille = 500, .is_high = is_high}).state == silent);
  }
}

TEST_CASE("the resistance is that of the vendor's table, in both states that measure", "[unit][protocol][ir155]") {
  struct Case {
    std::int32_t duty_permille;
    SignalValue resistance_Ohm;
  };
  const Case cases[] = {
      {40, not_known(Validity::above_range)},
      {50, not_known(Validity::above_range)},
      {51, not_known(Validity::above_range)},
      {60, not_known(Validity::above_range)},  // 106.8 MOhm by the formula
      {71, not_known(Validity::above_range)},  // 50.2 MOhm
      {72, known(47'890'909)},
      {230, known(4'800'000)},
      {500, known(1'200'000)},
      {770, known(300'000)},
      {900, known(70'588)},
      {949, known(1'335)},
      {950, known(0)},
      {951, known(0)},
      {960, known(0)},
  };
  for (const Case& one : cases) {
    INFO(one.duty_permille);
    CHECK(decode(pwm_of(10'000, one.duty_permille)) == Reading{State::normal, one.resistance_Ohm});
    CHECK(decode(pwm_of(20'000, one.duty_permille)) == Reading{State::undervoltage, one.resistance_Ohm});
  }
}

TEST_CASE("states that do not measure have no resistance", "[unit][protocol][ir155]") {
  for (const auto& [frequency_mHz, duty_permille] :
       {std::pair{30'000, 75}, {30'000, 925}, {40'000, 500}, {50'000, 500}, {10'000, 39}, {10'000, 961}}) {
    CHECK(decode(pwm_of(frequency_mHz, duty_permille)).resistance_Ohm == not_known());
  }
}

TEST_CASE("more duty is never more resistance", "[unit][protocol][ir155]") {
  std::int64_t last_Ohm = resistance_limit_Ohm;
  for (std::int32_t duty_permille = 72; duty_permille <= 960; ++duty_permille) {
    const SignalValue resistance_Ohm = decode(pwm_of(10'000, duty_permille)).resistance_Ohm;
    REQUIRE(resistance_Ohm.is_valid());
    CHECK(resistance_Ohm.value <= last_Ohm);
    last_Ohm = resistance_Ohm.value;
  }
}

TEST_CASE("every state survives the way over the wire", "[unit][protocol][ir155]") {
  for (unsigned raw = 0; raw <= static_cast<unsigned>(State::undefined); ++raw) {
    const auto state = static_cast<State>(raw);
    INFO(to_text(state));
    CHECK(decode(encode({state, known(300'000)})).state == state);
  }
}

TEST_CASE("a duty cycle read and sent again is the same, a resistance comes back to half a permille of duty",
          "[unit][protocol][ir155]") {
  for (const State state : {State::normal, State::undervoltage}) {
    for (std::int32_t duty_permille = 72; duty_permille <= 950; ++duty_permille) {
      const Reading reading = decode(encode({state, decode(pwm_of(10'000, duty_permille)).resistance_Ohm}));
      REQUIRE(reading == Reading{state, decode(pwm_of(10'000, duty_permille)).resistance_Ohm});
    }
    for (std::int64_t sent_Ohm = 0; sent_Ohm < 45'000'000; sent_Ohm += 1 + sent_Ohm / 100) {
      const Reading reading = decode(encode({state, known(sent_Ohm)}));
      REQUIRE(reading.resistance_Ohm.is_valid());
      const double total_Ohm = static_cast<double>(sent_Ohm) + 1.2e6;
      const double half_step_Ohm = 0.5 * total_Ohm * total_Ohm / 1.08e9;
      INFO(sent_Ohm);
      CHECK(std::abs(static_cast<double>(reading.resistance_Ohm.value - sent_Ohm)) <= half_step_Ohm * 1.03 + 1.0);
    }
  }
  CHECK(decode(encode({State::normal, known(-5)})).resistance_Ohm == known(0));
  CHECK(decode(encode({State::normal, known(50'000'000)})).resistance_Ohm.validity == Validity::above_range);
  CHECK(decode(encode({State::normal, known(INT64_MAX)})).resistance_Ohm.validity == Validity::above_range);
  CHECK(decode(encode({State::normal, not_known()})).resistance_Ohm.validity == Validity::above_range);
}

}  // namespace
}  // namespace bmu::ir155

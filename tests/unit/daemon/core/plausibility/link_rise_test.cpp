// Rise of the DC link in a precharge, and the values that the keys of the precharge would need.
#include "daemon/core/plausibility/link_rise.hpp"

#include <cmath>
#include <functional>
#include <optional>

#include "daemon/core/contactors/contactor_sequence.hpp"
#include "tests/support/catch.hpp"

using namespace bmu;

namespace {

constexpr TimePoint began_at{10s};
constexpr std::int32_t pack_mV = 700'000;

ContactorConfig contactors() {
  return {.precharge_min = 150ms, .precharge_resistance_Ohm = 100, .precharge_energy_J = 2'000};
}

SequenceInputs sample(TimePoint at, std::int32_t link_mV) {
  return {.now = at,
          .is_measured = true,
          .cells_mV = pack_mV,
          .pack_mV = pack_mV,
          .pack_at = at,
          .link_mV = link_mV,
          .link_at = at};
}

/// Precharge in which the DC link has the voltage `link_V` after a time in seconds since the command, sampled every 60
/// ms from `first` on.
LinkRise risen(const std::function<double(double)>& link_V, Duration first, Duration until, bool is_hot = false) {
  LinkRise rise;
  const SequenceState state{.phase = Phase::precharge, .entered_at = began_at};
  for (Duration at = first; at <= until; at += 60ms) {
    SequenceInputs in = sample(
        began_at + at, static_cast<std::int32_t>(std::lround(1e3 * link_V(std::chrono::duration<double>(at).count()))));
    in.resistor_is_hot = is_hot;
    rise.update(state, in, contactors());
  }
  return rise;
}

/// Charging through the resistor, from the closing of the contactor.
std::function<double(double)> charging(double time_constant_s, double towards_V = pack_mV / 1e3) {
  return [=](double since_s) {
    constexpr double closes_after_s = 0.015;
    return since_s < closes_after_s ? 0.0 : towards_V * (1.0 - std::exp(-(since_s - closes_after_s) / time_constant_s));
  };
}

double seconds(Duration span) {
  return std::chrono::duration<double>(span).count();
}

}  // namespace

TEST_CASE("the time constant of a link that charges slowly is measured, wherever its samples lie",
          "[unit][contactors]") {
  for (const double time_constant_s : {0.8, 3.0, 20.0}) {
    for (const Duration first : {1ms, 20ms, 45ms}) {
      CAPTURE(time_constant_s, to_ms(first));
      const auto rise = risen(charging(time_constant_s), first, 2s).slow_rise();
      REQUIRE(rise);
      CHECK(std::abs(seconds(rise->time_constant) - time_constant_s) < 0.01 * time_constant_s);
      CHECK(rise->pack_mV == pack_mV);
      CHECK(rise->began_after >= contactors().settle);
      CHECK_FALSE(rise->is_ended_by_heat);
    }
  }
  CHECK(risen(charging(3.0), 20ms, 480ms, true).slow_rise()->is_ended_by_heat);
}

TEST_CASE("a link that does not rise, or not as one that charges, has no time constant", "[unit][contactors]") {
  CHECK_FALSE(risen([](double) { return 0.0; }, 20ms, 2s).slow_rise());  // a short, an open resistor
  CHECK_FALSE(risen(charging(200.0), 20ms, 2s).slow_rise());             // 1 % may be the sensor
  CHECK_FALSE(risen(charging(0.4, 350.0), 20ms, 2s).slow_rise());        // a load takes half of the voltage
  CHECK_FALSE(risen(charging(0.4, 650.0), 20ms, 2s).slow_rise());        // or a little
  CHECK_FALSE(risen(charging(0.2), 20ms, 2s).slow_rise());               // it matched the pack
  CHECK_FALSE(risen(charging(3.0), 20ms, 260ms).slow_rise());            // too early
  CHECK_FALSE(risen([](double since_s) { return 400.0 - 50.0 * since_s; }, 20ms, 2s).slow_rise());  // it falls
  CHECK_FALSE(risen([](double since_s) { return 800.0 + since_s; }, 20ms, 2s).slow_rise());         // above the pack
}

TEST_CASE("when a fast link followed lies between the voltages around it, and one that is none was not seen",
          "[unit][contactors]") {
  for (const double time_constant_s : {0.015, 0.030, 0.040}) {
    for (Duration first = 1ms; first <= 60ms; first += 1ms) {
      const double after_s = 0.015 + time_constant_s * std::log(20.0);
      CAPTURE(time_constant_s, to_ms(first));
      const auto found = risen(charging(time_constant_s), first, 240ms).followed_after();
      const double first_s = seconds(first);
      double before_s = first_s;
      while (before_s + 0.06 < after_s) before_s += 0.06;
      const bool is_seen = before_s < after_s && charging(time_constant_s)(before_s) > 0.05 * pack_mV / 1e3;
      REQUIRE(found.has_value() == is_seen);
      if (!is_seen) continue;
      CHECK(seconds(*found) >= before_s);
      CHECK(seconds(*found) < before_s + 0.06);
      if (time_constant_s >= 0.030) CHECK(std::abs(seconds(*found) - after_s) < 0.015);
    }
  }
  const auto at_once = [](double since_s) { return since_s < 0.015 ? 0.0 : 699.0; };
  for (Duration first = 1ms; first <= 60ms; first += 1ms) CHECK_FALSE(risen(at_once, first, 240ms).followed_after());
  CHECK_FALSE(risen(charging(3.0), 20ms, 2s).followed_after());  // not matched yet
}

TEST_CASE("of a link that was charged before, what it rose by shows it on its way", "[unit][contactors]") {
  LinkRise rise;
  const SequenceState state{.phase = Phase::precharge, .entered_at = began_at, .link_at_start_mV = 400'000};
  rise.update(state, sample(began_at + 20ms, 405'000), contactors());
  rise.update(state, sample(began_at + 80ms, 690'000), contactors());
  CHECK_FALSE(rise.followed_after());  // 5 V of 300 V
  LinkRise other;
  other.update(state, sample(began_at + 20ms, 420'000), contactors());
  other.update(state, sample(began_at + 80ms, 690'000), contactors());
  CHECK(other.followed_after());
}

TEST_CASE("what was seen stays until the next precharge, and voltages that are not measured change nothing",
          "[unit][contactors]") {
  LinkRise rise = risen(charging(3.0), 20ms, 2s);
  const SequenceState open{.phase = Phase::open, .entered_at = began_at + 2s};
  rise.update(open, sample(began_at + 3s, 699'000), contactors());
  CHECK(rise.slow_rise());
  const SequenceState next{.phase = Phase::precharge, .entered_at = began_at + 12s};
  SequenceInputs unmeasured = sample(began_at + 12s + 60ms, 690'000);
  unmeasured.is_measured = false;
  rise.update(next, unmeasured, contactors());
  CHECK_FALSE(rise.slow_rise());
  CHECK_FALSE(rise.followed_after());
}

TEST_CASE("the keys of the precharge that would do leave a margin, and say what a pack file does not take",
          "[unit][contactors]") {
  CHECK(precharge_min_that_would_do(300ms) == 200ms);
  CHECK(precharge_min_that_would_do(134ms) == 80ms);  // 89 ms
  CHECK(precharge_min_that_would_do(105ms) == 80ms);  // 70 ms, and 80 ms leaves enough
  CHECK(precharge_min_that_would_do(88ms) == 80ms);
  CHECK(precharge_min_that_would_do(87ms) == 50ms);  // no pack file accepts it
  const SlowRise rise{.time_constant = 3s, .began_after = 100ms, .pack_mV = pack_mV};
  ContactorConfig config = contactors();
  config.precharge_current_max_mA = 1'000;
  CHECK(precharge_timeout_that_would_do(rise, config) == 13'700ms);  // (0.1 s + 3 s x ln 20) x 1.5 = 13.63 s
  config.precharge_current_max_mA = 100;                             // 10 V across the resistor
  CHECK(precharge_timeout_that_would_do(rise, config) == 19'300ms);  // (0.1 s + 3 s x ln 70) x 1.5 = 19.27 s
  config.precharge_resistance_Ohm = 0;
  CHECK(precharge_timeout_that_would_do(rise, config) == 13'700ms);
  CHECK(precharge_energy_that_would_do_J(rise, config) == 0);
  config.precharge_resistance_Ohm = 100;
  CHECK(precharge_energy_that_would_do_J(rise, config) == 8'820);  // 700^2 / 100 x 3 / 2 = 7350, and a fifth
}

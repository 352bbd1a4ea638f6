// Rates of change of limits, and causes without a ramp; and a charger that follows a limit with a delay up to the end
// of a charge.
#include "daemon/core/limits/limit_ramp.hpp"

#include "tests/support/catch.hpp"

using namespace bmu;

namespace {

constexpr RampRates rates{.fall_mA_per_s = 40'000, .rise_mA_per_s = 2'000};

CurrentLimit limit(std::int32_t limit_mA, LimitCause cause = LimitCause::cell_voltage_high) {
  return {.limit_mA = limit_mA, .cause = cause, .value = 7};
}

/// Ramp at 20 A.
LimitRamp at_20_A() {
  LimitRamp ramp;
  CHECK(ramp.follow(limit(20'000), 10ms, rates).limit_mA == 20'000);
  return ramp;
}

}  // namespace

TEST_CASE("a limit falls and rises as fast as it may, and tells why", "[unit][limits][ramp]") {
  LimitRamp ramp = at_20_A();
  CurrentLimit now = ramp.follow(limit(10'000), 10ms, rates);
  CHECK(now.limit_mA == 19'600);
  CHECK(now.cause == LimitCause::cell_voltage_high);
  CHECK(now.value == 7);
  CHECK(ramp.follow(limit(10'000), 100ms, rates).limit_mA == 15'600);
  CHECK(ramp.follow(limit(10'000), 139ms, rates).limit_mA == 10'040);
  CHECK(ramp.follow(limit(10'000), 2ms, rates).limit_mA == 10'000);
  now = ramp.follow(limit(20'000), 990ms, rates);
  CHECK(now.limit_mA == 10'000);
  CHECK(now.cause == LimitCause::cell_voltage_high);
  now = ramp.follow(limit(20'000), 10ms, rates);
  CHECK(now.limit_mA == 10'020);
  CHECK(now.cause == LimitCause::rising);
  CHECK(now.unhindered_mA == 20'000);
  CHECK(now.value == 0);
  now = ramp.follow(limit(10'025), 10ms, rates);
  CHECK(now.limit_mA == 10'025);
  CHECK(now.cause == LimitCause::cell_voltage_high);
}

TEST_CASE("a pause to measure is a step, not a ramp", "[unit][limits][ramp][charge_pause]") {
  LimitRamp ramp = at_20_A();
  CHECK(ramp.follow(limit(0, LimitCause::full), 10ms, rates).limit_mA == 19'600);
  CHECK(ramp.follow(limit(0, LimitCause::measuring), 10ms, rates).limit_mA == 0);
}

TEST_CASE("what a tick is too short for is not lost", "[unit][limits][ramp]") {
  LimitRamp ramp = at_20_A();
  for (int tick = 0; tick < 20'000; ++tick) static_cast<void>(ramp.follow(limit(30'000), 100us, rates));
  CHECK(ramp.follow(limit(30'000), 0ms, rates).limit_mA == 22'000);  // one second of waiting, one of rising
}

TEST_CASE("a limit begins to rise when that is worth it for a second, and then goes all the way",
          "[unit][limits][ramp]") {
  LimitRamp ramp;
  const auto follow = [&ramp](std::int32_t target_mA, Duration passed, LimitCause cause) {
    CurrentLimit target = limit(target_mA, cause);
    target.unhindered_mA = 40'000;
    return ramp.follow(target, passed, rates).limit_mA;
  };
  constexpr LimitCause noisy = LimitCause::voltage_would_rise;
  CHECK(follow(10'000, 10ms, noisy) == 10'000);
  CHECK(follow(12'000, 1s, noisy) == 10'000);  // a twentieth of 40 A: not exceeded
  CHECK(follow(12'000, 1s, noisy) == 10'000);
  CHECK(follow(12'001, 900ms, noisy) == 10'000);
  CHECK(follow(11'999, 1ms, noisy) == 10'000);  // an interruption
  CHECK(follow(12'001, 999ms, noisy) == 10'000);
  CHECK(follow(12'001, 1ms, noisy) == 10'002);
  CHECK(follow(12'001, 500ms, noisy) == 11'002);  // no band while it rises
  CHECK(follow(12'001, 499ms, noisy) == 12'000);
  CHECK(follow(12'001, 1ms, noisy) == 12'001);
  CHECK(follow(12'500, 1s, noisy) == 12'001);  // starts again from the beginning
  SECTION("without a band for what is not measured") {
    for (const LimitCause cause : {LimitCause::continuous, LimitCause::peak, LimitCause::component, LimitCause::user,
                                   LimitCause::limp_home, LimitCause::overload, LimitCause::charge_not_known}) {
      CAPTURE(to_text(cause));
      LimitRamp other = ramp;
      CurrentLimit target = limit(12'100, cause);
      target.unhindered_mA = 40'000;
      CHECK(other.follow(target, 900ms, rates).limit_mA == 12'001);
      CHECK(other.follow(target, 100ms, rates).limit_mA == 12'100);
    }
  }
  SECTION("with one for all that is") {
    for (const LimitCause cause :
         {LimitCause::cell_voltage_low, LimitCause::cell_voltage_high, LimitCause::cell_imbalance, LimitCause::cell_hot,
          LimitCause::cell_cold, LimitCause::too_hot_to_charge, LimitCause::too_cold_to_charge,
          LimitCause::temperature_spread, LimitCause::board_hot, LimitCause::drawn_too_much,
          LimitCause::charged_too_much, LimitCause::voltage_would_fall, LimitCause::voltage_would_rise,
          LimitCause::cold, LimitCause::hot, LimitCause::empty, LimitCause::full}) {
      CAPTURE(to_text(cause));
      CHECK(follow(14'001, 1s, cause) == 12'001);
    }
  }
}

TEST_CASE("the last thousandth of a milliampere is risen, too", "[unit][limits][ramp]") {
  constexpr RampRates slow{.fall_mA_per_s = 1, .rise_mA_per_s = 1};
  const LimitRamp below = [&] {
    LimitRamp ramp = at_20_A();
    CHECK(ramp.follow(limit(10'000, LimitCause::continuous), 1ms, slow).limit_mA == 19'999);  // and 999 uA
    return ramp;
  }();
  SECTION("of what is not measured") {
    LimitRamp ramp = below;
    CHECK(ramp.follow(limit(20'000, LimitCause::continuous), 999ms, slow).limit_mA == 19'999);
    CHECK(ramp.follow(limit(20'000, LimitCause::continuous), 1ms, slow).limit_mA == 20'000);
  }
  SECTION("at the end of a rise") {
    LimitRamp ramp = below;
    CHECK(ramp.follow(limit(20'001, LimitCause::continuous), 999ms, slow).limit_mA == 19'999);
    CHECK(ramp.follow(limit(20'001, LimitCause::continuous), 1s, slow).limit_mA == 20'000);  // and 999 uA again
    CHECK(ramp.follow(limit(20'001, LimitCause::continuous), 1ms, slow).limit_mA == 20'001);
  }
  SECTION("without a rate") {
    LimitRamp ramp = below;
    CHECK(ramp.follow(limit(20'000, LimitCause::continuous), 1ms, {.fall_mA_per_s = 1}).limit_mA == 20'000);
  }
}

TEST_CASE("time that stands still or runs backwards moves nothing, and a gap no more than a second",
          "[unit][limits][ramp]") {
  LimitRamp ramp = at_20_A();
  CHECK(ramp.follow(limit(0, LimitCause::cold), Duration{}, rates).limit_mA == 20'000);
  CHECK(ramp.follow(limit(0, LimitCause::cold), -1s, rates).limit_mA == 20'000);
  CHECK(ramp.follow(limit(30'000), -1s, rates).limit_mA == 20'000);
  CHECK(ramp.follow(limit(30'000), 1h, rates).limit_mA == 22'000);
  CHECK(ramp.follow(limit(30'000), 1s, rates).limit_mA == 24'000);
  CHECK(ramp.follow(limit(0, LimitCause::cold), 1h, {.fall_mA_per_s = 10'000}).limit_mA == 14'000);
}

TEST_CASE("without rates a limit is where its target is", "[unit][limits][ramp]") {
  LimitRamp ramp = at_20_A();
  CHECK(ramp.follow(limit(5'000), 1ms, {}).limit_mA == 5'000);
  CHECK(ramp.follow(limit(9'000), 1ms, {}).limit_mA == 9'000);
  CHECK(ramp.follow(limit(9'000), 1ms, {}).cause == LimitCause::cell_voltage_high);
}

TEST_CASE("what protects does not wait", "[unit][limits][ramp][BMU_13]") {
  for (const LimitCause cause :
       {LimitCause::not_connected, LimitCause::fault, LimitCause::cell_voltage_high, LimitCause::cell_voltage_low,
        LimitCause::cell_imbalance, LimitCause::cell_hot, LimitCause::cell_cold, LimitCause::too_hot_to_charge,
        LimitCause::too_cold_to_charge, LimitCause::temperature_spread, LimitCause::board_hot,
        LimitCause::drawn_too_much, LimitCause::charged_too_much}) {
    CAPTURE(to_text(cause));
    LimitRamp ramp = at_20_A();
    const CurrentLimit now = ramp.follow(limit(0, cause), 1ms, rates);
    CHECK(now.limit_mA == 0);
    CHECK(now.cause == cause);
    if (cause != LimitCause::not_connected && cause != LimitCause::fault) {
      LimitRamp other = at_20_A();
      CHECK(other.follow(limit(1, cause), 1ms, rates).limit_mA == 19'960);  // an unreached threshold uses the ramp
    }
  }
  for (const LimitCause cause :
       {LimitCause::cold, LimitCause::hot, LimitCause::empty, LimitCause::full, LimitCause::voltage_would_fall,
        LimitCause::voltage_would_rise, LimitCause::charge_not_known, LimitCause::continuous}) {
    CAPTURE(to_text(cause));
    LimitRamp ramp = at_20_A();
    CHECK(ramp.follow(limit(0, cause), 1ms, rates).limit_mA == 19'960);
  }
}

TEST_CASE("after a fault a limit rises slowly, after closing it begins where it may be", "[unit][limits][ramp]") {
  LimitRamp ramp = at_20_A();
  static_cast<void>(ramp.follow(limit(0, LimitCause::fault), 1ms, rates));
  CHECK(ramp.follow(limit(20'000), 999ms, rates).limit_mA == 0);
  CHECK(ramp.follow(limit(20'000), 100ms, rates).limit_mA == 200);
  static_cast<void>(ramp.follow(limit(0, LimitCause::not_connected), 1ms, rates));
  CHECK(ramp.follow(limit(0, LimitCause::not_connected), 1ms, rates).cause == LimitCause::not_connected);
  CHECK(ramp.follow(limit(15'000), 1ms, rates).limit_mA == 15'000);
}

TEST_CASE("the four limits of a pack move each by its own rates", "[unit][limits][ramp]") {
  const LimitRampConfig config{.discharge_fall_mA_per_s = 1'000,
                               .discharge_rise_mA_per_s = 100,
                               .charge_fall_mA_per_s = 2'000,
                               .charge_rise_mA_per_s = 200};
  LimitRamps ramps;
  const CurrentLimits high{limit(20'000), limit(20'000), limit(20'000), limit(20'000)};
  const CurrentLimits low{limit(10'000), limit(10'000), limit(10'000), limit(10'000)};
  const TimePoint start{100s};
  static_cast<void>(ramps.follow(high, start, config));
  CurrentLimits now = ramps.follow(low, start + 1s, config);
  CHECK(now.discharge.limit_mA == 19'000);
  CHECK(now.discharge_continuous.limit_mA == 19'000);
  CHECK(now.charge.limit_mA == 18'000);
  CHECK(now.charge_continuous.limit_mA == 18'000);
  now = ramps.follow(high, start + 2s, config);
  CHECK(now.discharge.limit_mA == 19'100);
  CHECK(now.discharge_continuous.limit_mA == 19'100);
  CHECK(now.charge.limit_mA == 18'200);
  CHECK(now.charge_continuous.limit_mA == 18'200);
}

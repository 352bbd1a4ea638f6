// Validity of a prediction: until the next sample set, and no longer than its inputs are fresh.
#include "daemon/core/limits/pack_forecaster.hpp"

#include <cmath>
#include <memory>
#include <utility>

#include "tests/support/catch.hpp"
#include "tests/support/living_pack.hpp"

using namespace bmu;
using test::LivingPack;

namespace {

CoreConfig sloped_pack() {
  CoreConfig config = test::small_pack();
  config.dynamics = test::sloped_cell();
  config.cell.capacity_uAs = std::llround(config.dynamics->capacity_As * 1e6);
  return config;
}

/// Pack without cell estimates: the lowest and the highest cell measured a second after the start of the clock, the
/// current received at given distances from that.
struct Unestimated {
  static constexpr TimePoint taken_at = TimePoint{} + 1s;

  Unestimated() { estimate->init(config); }

  void tell_current(TimePoint before, TimePoint after) {
    sensors.current_window.add(0, before);
    sensors.current_window.add(0, after);
  }
  void picture(TimePoint at, std::int32_t max_uV) {
    pack.cell_voltage_uV = {
        .min = 3'500'000, .max = max_uV, .min_taken_at = at, .max_taken_at = at, .count = 8, .expected = 8};
  }
  const PredictedLimits& ask(TimePoint now) {
    forecaster.update({.now = now, .estimate = estimate.get(), .pack = &pack, .sensors = &sensors}, config);
    return forecaster.limits();
  }

  CoreConfig config = sloped_pack();
  std::unique_ptr<PackEstimate> estimate = std::make_unique<PackEstimate>();
  PackState pack{.cell_temperature_dC = {.min = 250, .max = 250, .count = 4, .expected = 4}};
  SensorTable sensors;
  PackForecaster forecaster;
};

}  // namespace

TEST_CASE("a forecast from estimates is incomplete once its picture is too old", "[unit][limits][prediction]") {
  const CoreConfig config = sloped_pack();
  LivingPack living(config, 0.6);
  living.run(3s);
  REQUIRE(living.estimate().pack().is_known);
  const TimePoint pictured_at = living.estimate().pictured_at();
  PackForecaster forecaster;
  const auto ask = [&](TimePoint now) {
    forecaster.update({.now = now,
                       .estimate = &living.estimate(),
                       .pack = &living.core().pack(),
                       .sensors = &living.core().sensors()},
                      config);
    return forecaster.limits();
  };
  CHECK(ask(pictured_at).is_complete);
  CHECK(ask(pictured_at).discharge.is_known);
  CHECK(ask(pictured_at + config.ages.cell_voltage).is_complete);
  CHECK_FALSE(ask(pictured_at + config.ages.cell_voltage + 1ns).is_complete);
  CHECK_FALSE(ask(pictured_at + 1h).is_complete);
  // The same for a sample set that was stale from the start.
  forecaster = {};
  CHECK_FALSE(ask(pictured_at + config.ages.cell_voltage + 1ns).is_complete);
}

TEST_CASE("before cells are estimated the lowest and the highest are asked, with the current of that moment",
          "[unit][limits][prediction]") {
  Unestimated world;
  world.picture(Unestimated::taken_at, 3'900'000);
  world.tell_current(Unestimated::taken_at - 100ms, Unestimated::taken_at + 100ms);
  const PredictedLimits& limits = world.ask(Unestimated::taken_at + 100ms);
  CHECK(limits.is_complete);
  CHECK(limits.discharge.is_known);
  CHECK(limits.charge.is_known);
}

TEST_CASE("a current further away than a tenth of a second is not that of a picture", "[unit][limits][prediction]") {
  for (const auto& [before, after] : {std::pair<Duration, Duration>{101ms, 100ms}, {100ms, 101ms}}) {
    Unestimated world;
    world.picture(Unestimated::taken_at, 3'900'000);
    world.tell_current(Unestimated::taken_at - before, Unestimated::taken_at + after);
    CHECK_FALSE(world.ask(Unestimated::taken_at + 101ms).is_complete);
  }
}

TEST_CASE("until the current of a new picture is known the forecast before it holds, and no longer than it is fresh",
          "[unit][limits][prediction]") {
  Unestimated world;
  world.picture(Unestimated::taken_at, 3'900'000);
  world.tell_current(Unestimated::taken_at - 5ms, Unestimated::taken_at + 5ms);
  const TimePoint asked_at = Unestimated::taken_at + 5ms;
  REQUIRE(world.ask(asked_at).is_complete);
  const std::int32_t charge_mA = world.forecaster.limits().charge.limit_mA;
  world.picture(Unestimated::taken_at + 50ms, 4'190'000);
  CHECK(world.ask(asked_at + 50ms).is_complete);
  CHECK(world.forecaster.limits().charge.limit_mA == charge_mA);
  CHECK(world.ask(asked_at + world.config.ages.cell_voltage).is_complete);
  CHECK_FALSE(world.ask(asked_at + world.config.ages.cell_voltage + 1ns).is_complete);
  world.sensors.current_window.add(0, Unestimated::taken_at + 60ms);
  CHECK(world.ask(asked_at + 300ms).is_complete);
  CHECK(world.forecaster.limits().charge.limit_mA < charge_mA);
}

TEST_CASE("without a voltage or a temperature there is no forecast", "[unit][limits][prediction]") {
  Unestimated world;
  world.picture(Unestimated::taken_at, 3'900'000);
  world.tell_current(Unestimated::taken_at - 5ms, Unestimated::taken_at + 5ms);
  SECTION("no voltage") {
    world.pack.cell_voltage_uV.count = 0;
  }
  SECTION("no temperature") {
    world.pack.cell_temperature_dC.count = 0;
  }
  CHECK_FALSE(world.ask(Unestimated::taken_at + 5ms).is_complete);
  CHECK_FALSE(world.forecaster.limits().discharge.is_known);
}

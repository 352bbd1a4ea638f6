// Fan, heater and motor controller output: thresholds, maximum run times, and forbidden states.
#include "daemon/core/contactors/auxiliary.hpp"

#include "protocol/tables/internal_bus.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

using namespace bmu;

namespace {

constexpr TimePoint start{100s};
constexpr AuxiliaryConfig config{.fan_on_dC = 400,
                                 .fan_off_dC = 350,
                                 .fan_run_max = 60s,
                                 .heater_on_dC = 50,
                                 .heater_off_dC = 100,
                                 .heater_hot_dC = 300,
                                 .heater_run_max = 30s,
                                 .pause = 20s,
                                 .throttle_on_permille = 50,
                                 .throttle_off_permille = 20};

struct Runs {
  explicit Runs(const AuxiliaryConfig& given = config) { auxiliary.init(given); }

  AuxiliaryOutputs at(std::int32_t coldest_dC, std::int32_t hottest_dC, Duration since = 0s) {
    in.now = start + since;
    in.cell_temperature_dC.min = coldest_dC;
    in.cell_temperature_dC.max = hottest_dC;
    return auxiliary.step(in);
  }
  bool enables(std::int32_t throttle_permille) {
    in.throttle_permille = known(throttle_permille);
    return at(200, 200).motor_enable;
  }

  Auxiliary auxiliary;
  AuxiliaryInputs in{.may_drive = true, .may_run = true, .cell_temperature_dC = {.count = 8, .expected = 8}};
};

}  // namespace

TEST_CASE("the fan runs from the hottest cell's upper threshold to its lower one", "[unit][auxiliary][BMU_15]") {
  Runs runs;
  CHECK_FALSE(runs.at(200, 399).fan);
  CHECK(runs.at(200, 400).fan);
  CHECK(runs.at(200, 351).fan);
  CHECK_FALSE(runs.at(200, 350).fan);
  CHECK_FALSE(runs.at(200, 399).fan);
  runs.in.cell_temperature_dC.count = 7;  // a single hot sensor is enough to cool
  CHECK(runs.at(200, 400).fan);
  runs.in.cell_temperature_dC.count = 0;
  CHECK_FALSE(runs.at(200, 400).fan);
}

TEST_CASE("the heater runs from the coldest cell's lower threshold to its upper one",
          "[unit][auxiliary][BMU_15][BMU_6]") {
  Runs runs;
  CHECK_FALSE(runs.at(51, 60).heater);
  CHECK(runs.at(50, 60).heater);
  CHECK(runs.at(99, 110).heater);
  CHECK_FALSE(runs.at(100, 110).heater);
  CHECK_FALSE(runs.at(51, 60).heater);
}

TEST_CASE("a pack with a hot cell, or one that does not know all its temperatures, is not heated",
          "[unit][auxiliary][BMU_15]") {
  Runs runs;
  CHECK_FALSE(runs.at(0, 300).heater);
  CHECK(runs.at(0, 299).heater);
  CHECK_FALSE(runs.at(0, 300).heater);
  CHECK(runs.at(0, 100).heater);
  runs.in.cell_temperature_dC.count = 7;
  CHECK_FALSE(runs.at(0, 100).heater);
}

TEST_CASE("what has run for its longest time stays off for a pause", "[unit][auxiliary][BMU_15]") {
  Runs runs;
  CHECK(runs.at(0, 100).heater);
  CHECK(runs.at(0, 100, 30s - 1ns).heater);
  CHECK_FALSE(runs.at(0, 100, 30s).heater);
  CHECK_FALSE(runs.at(0, 100, 50s - 1ns).heater);
  CHECK(runs.at(0, 100, 50s).heater);
  CHECK(runs.at(0, 100, 80s - 1ns).heater);
  CHECK_FALSE(runs.at(0, 100, 80s).heater);
  Runs fan;
  CHECK(fan.at(200, 400).fan);
  CHECK(fan.at(200, 400, 60s - 1ns).fan);
  CHECK_FALSE(fan.at(200, 400, 60s).fan);
  CHECK(fan.at(200, 400, 80s).fan);
  Runs done;  // reaching the target temperature requires no pause
  CHECK(done.at(200, 400).fan);
  CHECK_FALSE(done.at(200, 350, 10s).fan);
  CHECK(done.at(200, 400, 11s).fan);
}

TEST_CASE("a run that is interrupted again and again counts as one, and a gap gives back its share of the pause",
          "[unit][auxiliary][BMU_15]") {
  // A module's temperatures are missing for 400 ms of every 5 s: 30 s are used up in the eighth run.
  Runs flickering;
  const auto heats_at = [&flickering](Duration since) {
    flickering.in.cell_temperature_dC.count = since % 5s < 4'600ms ? 8 : 7;
    return flickering.at(0, 100, since).heater;
  };
  Duration ran{};
  Duration stopped_at{};
  for (Duration since{}; since < 60s; since += 100ms) {
    const bool heats = heats_at(since);
    if (heats && stopped_at == Duration{}) ran += 100ms;
    if (!heats && since % 5s < 4'600ms && stopped_at == Duration{}) stopped_at = since;
    if (stopped_at != Duration{}) CHECK(heats == (since >= stopped_at + 20s && since % 5s < 4'600ms));
  }
  // Each gap of 0.4 s restores 0.6 s: the pause of 20 s restores 30.
  CHECK(stopped_at > 30s);
  CHECK(stopped_at < 40s);
  CHECK(ran >= 30s);
  // Equal times on and off restore more than they use, so the output can continue permanently.
  Runs resting;
  for (Duration since{}; since < 600s; since += 1s) {
    const bool is_wanted = since % 40s < 20s;
    CHECK(resting.at(is_wanted ? 0 : 100, 110, since).heater == is_wanted);
  }
  // An output that was off for one pause has its full run time again.
  Runs rested;
  CHECK(rested.at(0, 100).heater);
  CHECK(rested.at(0, 100, 29s).heater);
  CHECK_FALSE(rested.at(100, 110, 29s).heater);
  CHECK(rested.at(0, 100, 49s).heater);
  CHECK(rested.at(0, 100, 79s - 1ns).heater);
  CHECK_FALSE(rested.at(0, 100, 79s).heater);
}

TEST_CASE("nothing runs while the daemon ends, rests, or does not know its lines", "[unit][auxiliary][BMU_15]") {
  Runs runs;
  CHECK(runs.at(0, 100).heater);
  runs.in.may_run = false;
  CHECK_FALSE(runs.at(0, 100, 1s).heater);
  CHECK_FALSE(runs.at(0, 400, 2s).fan);
  runs.in.may_run = true;
  CHECK(runs.at(0, 100, 3s).heater);  // no pause is due
}

TEST_CASE("without thresholds there is neither fan nor heater", "[unit][auxiliary][BMU_15]") {
  Runs runs(AuxiliaryConfig{});
  for (const std::int32_t temperature_dC : {-500, 0, 500, 2'000}) {
    const AuxiliaryOutputs outputs = runs.at(temperature_dC, temperature_dC);
    CHECK_FALSE(outputs.fan);
    CHECK_FALSE(outputs.heater);
  }
}

TEST_CASE("the motor controller works from the throttle's upper share until it is below the lower one",
          "[unit][auxiliary][RR_4]") {
  Runs runs;
  CHECK_FALSE(runs.enables(49));
  CHECK(runs.enables(50));
  CHECK(runs.enables(20));
  CHECK_FALSE(runs.enables(19));
  CHECK_FALSE(runs.enables(49));
  CHECK(runs.enables(1'000));
  runs.in.throttle_permille = not_known();
  CHECK_FALSE(runs.at(200, 200).motor_enable);  // an unknown throttle does not enable the motor
  CHECK(runs.enables(50));
  runs.in.may_drive = false;
  CHECK_FALSE(runs.enables(1'000));
}

TEST_CASE("without a throttle the motor controller works while the pack may be discharged", "[unit][auxiliary][RR_4]") {
  AuxiliaryConfig without = config;
  without.throttle_on_permille = 0;
  Runs runs(without);
  runs.in.throttle_permille = not_known();
  CHECK(runs.at(200, 200).motor_enable);
  runs.in.may_drive = false;
  CHECK_FALSE(runs.at(200, 200).motor_enable);
}

TEST_CASE("the fan is commanded by the pack's temperature, the motor controller only while closed",
          "[unit][core][auxiliary][BMU_15][RR_4][BMU_6]") {
  CoreConfig pack = test::small_pack();
  pack.auxiliary.fan_on_dC = 400;
  pack.auxiliary.fan_off_dC = 350;
  test::CoreBench bench(pack);
  REQUIRE(bench.close());
  bench.run(200ms);
  CHECK(bench.commanded() == ContactorOutputs{.main_positive = true, .main_negative = true, .auxiliary = true});
  bench.modules[1].cell_temperature_dC[0] = known(400);
  bench.run(800ms);  // passes the temperature jump filter
  CHECK(bench.commanded().fan);
  bench.inputs.vehicle_on = false;
  bench.run(1s);
  CHECK(bench.commanded() == ContactorOutputs{.fan = true});
  bench.modules[1].cell_temperature_dC[0] = known(350);
  bench.run(500ms);
  CHECK(bench.commanded() == ContactorOutputs{});
}

TEST_CASE("the throttle in PDU_STATUS switches the auxiliary output of CONTACTOR_COMMAND, with its hysteresis",
          "[unit][core][auxiliary][RR_4]") {
  CoreConfig pack = test::small_pack();
  pack.auxiliary.throttle_on_permille = 50;
  pack.auxiliary.throttle_off_permille = 20;
  test::CoreBench bench(pack);
  bench.inputs.throttle_permille = known(0);
  REQUIRE(bench.close());
  const auto commands_at = [&](SignalValue throttle_permille) {
    bench.inputs.throttle_permille = throttle_permille;
    bench.run(200ms);
    return bench.commanded().auxiliary;
  };
  CHECK_FALSE(commands_at(known(45)));  // the frame's step is 5 permille
  CHECK(commands_at(known(50)));
  CHECK(commands_at(known(20)));
  CHECK_FALSE(commands_at(known(15)));
  CHECK_FALSE(commands_at(known(45)));
  CHECK(commands_at(known(1'000)));
  CHECK_FALSE(commands_at(not_known()));
  CHECK(commands_at(known(50)));
  bench.inputs.vehicle_on = false;
  REQUIRE(bench.run_until([&] { return !bench.commanded().any_contactor(); }, 1s));
  CHECK_FALSE(commands_at(known(1'000)));
}

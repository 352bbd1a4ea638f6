// A wrong key of the pack file is named by the event of the resulting fault, with a value that would do. That value is
// then tried.
#include <string>

#include "config/pack_config.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/folders.hpp"
#include "tests/support/patched_pack.hpp"
#include "tests/support/sim_run.hpp"

using namespace bmu;
using test::SimRun;

namespace {

CoreConfig shipped(const std::string& name) {
  const auto pack = load_pack_config(test::in_source("config/packs/" + name + ".json"));
  REQUIRE(pack.has_value());
  return pack->core;
}

/// All events of that kind, one a line.
std::string text_of(const SimRun& run, EventId id) {
  std::string text;
  for (const Event& event : run.events()) {
    if (event.id == id) text += to_text(event) + "\n";
  }
  return text;
}

bool has(const std::string& text, std::string_view words) {
  return text.find(words) != std::string::npos;
}

bool is_present(const SimRun& run, FaultId fault) {
  return run.core().faults().state(fault).is_present();
}

void run_until_present(SimRun& run, FaultId fault, double until_s) {
  while (!is_present(run, fault) && run.seconds() < until_s) run.run_to(run.seconds() + 0.01);
}

/// The text of `bmuctl why`, now.
std::string cause_text(const SimRun& run, FaultId fault) {
  const TimePoint now = SimRun::start + std::chrono::milliseconds{static_cast<std::int64_t>(run.seconds() * 1e3)};
  return to_text(run.core().likely_cause(fault, now));
}

/// A pack with a cell that has run empty, and then a charger: closed only for charging.
SimRun charged_after_undervoltage(const std::string& sensor, const std::string& charger) {
  SimRun run(shipped("demo-48s"));
  run.apply(sensor);
  run.apply("pack soc_permille 300");
  run.run_to(2.5);
  run.apply("vehicle on");
  run.run_to(5);
  run.apply("cell 2.7 voltage_mV 2700");
  run.run_to(6);
  run.apply("vehicle off");
  run.run_to(17);
  run.apply(charger);
  run.apply("charger connected");
  return run;
}

/// The key is turned at 2 s, with a DC link of this capacitance.
SimRun with_link(const CoreConfig& config, int capacitance_uF) {
  SimRun run(config);
  run.apply("pack soc_permille 600");
  run.apply("link capacitance_uF " + std::to_string(capacitance_uF));
  run.run_to(2);
  run.apply("vehicle on");
  return run;
}

}  // namespace

TEST_CASE("the first drive with the sensor the wrong way round names its key", "[scenario][faults][F18]") {
  for (const std::string_view fault : {"sensor current inverted on", "sensor current stuck on"}) {
    CAPTURE(fault);
    SimRun run(shipped("demo-48s"));
    run.apply(fault);
    run.run_to(2);
    run.apply("vehicle on");
    run.run_to(6);
    REQUIRE(run.core().sequence().phase == Phase::closed);
    run.apply("load profile drive");
    run_until_present(run, FaultId::current_contradicts_voltage, 66);
    REQUIRE(is_present(run, FaultId::current_contradicts_voltage));
    CHECK(has(text_of(run, EventId::fault_confirmed), "sensor/invert_current") ==
          (fault == "sensor current inverted on"));
    // And later, with the pack open.
    run.run_to(run.seconds() + 5);
    const LikelyCause cause = run.core().likely_cause(FaultId::current_contradicts_voltage, SimRun::start + 66s);
    CHECK((cause.key == WrongKey::invert_current_by_cells) == (fault == "sensor current inverted on"));
  }
}

TEST_CASE("a link that charges before precharge_min names that key and a value with which it closes",
          "[scenario][contactors][faults]") {
  CoreConfig config = shipped("traction-16x12");
  for (const int capacitance_uF : {300, 250}) {
    CAPTURE(capacitance_uF);
    SimRun run = with_link(config, capacitance_uF);
    run_until_present(run, FaultId::precharge_too_fast, 20);
    REQUIRE(is_present(run, FaultId::precharge_too_fast));
    CHECK(has(text_of(run, EventId::fault_confirmed), "contactors/precharge_min_ms 80 would be sufficient, found 150"));
    CoreConfig shorter = config;
    shorter.contactors.precharge_min = 80ms;
    SimRun again = with_link(shorter, capacitance_uF);
    again.run_to(20);
    CHECK(again.core().sequence().phase == Phase::closed);
  }
}

TEST_CASE("a link that is none names no key: it is not seen on its way", "[scenario][contactors][faults]") {
  SimRun run = with_link(shipped("traction-16x12"), 1);
  run_until_present(run, FaultId::precharge_too_fast, 20);
  REQUIRE(is_present(run, FaultId::precharge_too_fast));
  CHECK_FALSE(has(text_of(run, EventId::fault_confirmed), "contactors/"));
}

TEST_CASE("a link that charges for longer than precharge_timeout names that key and a value with which it closes",
          "[scenario][contactors][faults][F86]") {
  CoreConfig config = shipped("demo-48s");  // 100 ohm
  config.contactors.precharge_energy_J = 0;
  config.contactors.precharge_tries = 1;  // the DC link keeps the charge of each attempt
  SimRun run = with_link(config, 8'000);
  run_until_present(run, FaultId::precharge_failed, 60);
  REQUIRE(is_present(run, FaultId::precharge_failed));
  const std::string text = text_of(run, EventId::fault_confirmed);
  INFO(text);
  CHECK(has(text,
            "DC link voltage rises with a time constant of 0.8 s: contactors/precharge_timeout_ms 4000 would be "
            "sufficient, found 2000"));
  CHECK(has(text_of(run, EventId::precharge_gave_up), "precharge: aborted after 2000 ms: DC link 1"));
  CHECK(has(text_of(run, EventId::precharge_gave_up), " V, pack 1"));
  const LikelyCause cause = run.core().likely_cause(FaultId::precharge_failed, SimRun::start + 60s);
  config.contactors.precharge_timeout = cause.would_do;
  SimRun again = with_link(config, 8'000);
  again.run_to(15);
  CHECK(again.core().sequence().phase == Phase::closed);
}

TEST_CASE("a link whose charge the resistor does not bear names both keys", "[scenario][contactors][faults][F86]") {
  CoreConfig config = shipped("traction-16x12");
  SimRun run = with_link(config, 30'000);
  run_until_present(run, FaultId::precharge_failed, 90);
  REQUIRE(is_present(run, FaultId::precharge_failed));
  const std::string text = text_of(run, EventId::fault_confirmed);
  INFO(text);
  CHECK(has(text, "with a time constant of 3.0 s, until the pulse energy of the resistor is used up"));
  CHECK(has(text, "contactors/precharge_energy_J "));
  CHECK(has(text, " would be sufficient, found 2000, with a resistor of this rating"));
  CHECK(has(text, "contactors/precharge_timeout_ms would have to be "));
  CHECK(has(text, ", maximum 10000; required: a resistor of lower resistance"));
}

TEST_CASE("a load, a short or an open resistor behind a precharge that fails names no key",
          "[scenario][contactors][faults][F86]") {
  CoreConfig config = shipped("demo-48s");
  for (const std::string_view event :
       {"link bleed_Ohm 100", "link bleed_Ohm 1000", "precharge resistance_Ohm 100000"}) {
    CAPTURE(event);
    SimRun run(config);
    run.apply("pack soc_permille 600");
    run.apply(event);
    run.run_to(2);
    run.apply("vehicle on");
    run_until_present(run, FaultId::precharge_failed, 60);
    REQUIRE(is_present(run, FaultId::precharge_failed));
    CHECK_FALSE(has(text_of(run, EventId::fault_confirmed), "would be sufficient"));
  }
}

TEST_CASE(
    "a charge that the sensor counts the wrong way round names its key in a pack that is closed for charging only",
    "[scenario][faults][charge][F18]") {
  for (const int current_A : {4, 15, 25}) {
    CAPTURE(current_A);
    SimRun run =
        charged_after_undervoltage("sensor current inverted on", "charger current_A " + std::to_string(current_A));
    run_until_present(run, FaultId::discharge_not_allowed, 60);
    REQUIRE(is_present(run, FaultId::discharge_not_allowed));
    CHECK(has(text_of(run, EventId::fault_confirmed), "sensor/invert_current"));
    run.apply("charger disconnected");
    run.run_to(run.seconds() + 30);
    CHECK(has(cause_text(run, FaultId::discharge_not_allowed), "sensor/invert_current is wrong"));
  }
}

TEST_CASE("a load at a pack that is closed for charging only is a discharge, and names no key",
          "[scenario][faults][charge]") {
  for (const int current_A : {3, 10, 30}) {
    CAPTURE(current_A);
    SimRun run = charged_after_undervoltage("sensor current inverted off", "charger current_A 1");
    run.run_to(24);
    REQUIRE(run.core().sequence().phase == Phase::closed);
    run.apply("load current_A " + std::to_string(current_A));
    run_until_present(run, FaultId::discharge_not_allowed, 60);
    REQUIRE(is_present(run, FaultId::discharge_not_allowed));
    CHECK_FALSE(has(text_of(run, EventId::fault_confirmed), "is wrong"));
    run.run_to(run.seconds() + 30);
    CHECK_FALSE(has(cause_text(run, FaultId::discharge_not_allowed), "is wrong"));
  }
}

TEST_CASE("too much current of a charger that is counted the wrong way round names the sensor's key",
          "[scenario][faults][charge]") {
  CoreConfig config = shipped("demo-48s");
  config.limits.discharge_overcurrent.open = 20'000;
  config.limits.discharge_overcurrent.confirm = 100ms;  // sooner than the contradiction to the cells
  for (const bool is_inverted : {true, false}) {
    CAPTURE(is_inverted);
    SimRun run(config);
    run.apply(std::string("sensor current inverted ") + (is_inverted ? "on" : "off"));
    run.apply("pack soc_permille 300");
    run.run_to(3);
    run.apply(is_inverted ? "charger current_A 25" : "charger current_A 1");
    run.apply("charger connected");
    run.run_to(10);
    if (!is_inverted) run.apply("load current_A 40");
    run_until_present(run, FaultId::discharge_overcurrent, 30);
    REQUIRE(is_present(run, FaultId::discharge_overcurrent));
    run.run_to(run.seconds() + 5);
    CHECK(has(text_of(run, EventId::fault_confirmed), "sensor/invert_current is wrong") == is_inverted);
    CHECK(has(cause_text(run, FaultId::discharge_overcurrent), "sensor/invert_current is wrong") == is_inverted);
  }
}

TEST_CASE("a charger and a current sensor that see the same current with opposite signs name the sensor's key",
          "[scenario][faults][charge]") {
  const CoreConfig config = test::patched_pack(R"({"charger": {"protocol": "elcon_tc", "current_max_mA": 4000}})");
  for (const bool is_inverted : {true, false}) {
    CAPTURE(is_inverted);
    SimRun run(config);
    if (is_inverted) run.apply("sensor current inverted on");
    run.apply("pack soc_permille 300");
    run.run_to(3);
    run.apply("charger current_A 4");
    run.apply("charger connected");
    run.run_to(20);
    REQUIRE(run.core().sequence().phase == Phase::closed);
    if (!is_inverted) run.apply("load current_A 8");  // twice the charger's current
    run_until_present(run, FaultId::charger_contradicts, 60);
    REQUIRE(is_present(run, FaultId::charger_contradicts));
    CHECK(has(text_of(run, EventId::fault_confirmed), "sensor/invert_current is wrong") == is_inverted);
  }
}

TEST_CASE("two current sensors that see one current with opposite signs name the key of the one that is reversed",
          "[scenario][faults]") {
  const CoreConfig config = test::patched_pack(R"({"sensor": {"has_second_current": true}})");
  for (const std::string_view fault :
       {"sensor current_2 inverted on", "sensor current inverted on", "sensor current_2 stuck on"}) {
    // With a large load the cells contradict the first sensor before the second sensor does.
    const bool is_first = fault == "sensor current inverted on";
    CAPTURE(fault);
    SimRun run(config);
    run.apply("pack soc_permille 600");
    run.apply(fault);
    run.run_to(2);
    run.apply("vehicle on");
    run.run_to(8);
    REQUIRE(run.core().sequence().phase == Phase::closed);
    run.apply(is_first ? "load current_A 3" : "load current_A 20");
    run_until_present(run, FaultId::current_sensors_disagree, 30);
    REQUIRE(is_present(run, FaultId::current_sensors_disagree));
    run.run_to(run.seconds() + 30);
    for (const std::string& text :
         {text_of(run, EventId::fault_confirmed), cause_text(run, FaultId::current_sensors_disagree)}) {
      INFO(text);
      CHECK(has(text, "sensor/second_is_reversed") == (fault != "sensor current_2 stuck on"));
      CHECK(has(text, "sensor/invert_current and sensor/second_is_reversed are both wrong") == is_first);
    }
  }
}

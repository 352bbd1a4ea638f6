// Sensors of other makers on a whole emulated pack: their messages, the effect of scripts, and the causes of opening.
#include <algorithm>
#include <string>
#include <string_view>

#include "tests/support/catch.hpp"
#include "tests/support/patched_pack.hpp"
#include "tests/support/sim_run.hpp"

using namespace bmu;

namespace {

/// The demonstration pack with these keys in place of its sensor's.
CoreConfig pack_with_sensor(const std::string& keys) {
  return test::patched_pack(R"({"sensor": {"little_endian": null, "invert_current": null, )" + keys + "}}");
}
CoreConfig ivt_pack(const std::string& more = "") {
  return pack_with_sensor(R"("protocol": "ivt_s")" + more);
}
CoreConfig two_ivts(const std::string& more = "") {
  return ivt_pack(R"(, "has_second_current": true, "second_command_id": "413", "second_response_id": "513")" + more);
}
CoreConfig iso_pack() {
  return test::patched_pack(R"({"insulation": {"protocol": "iso165c", "monitoring": "measured"}})");
}

/// The key is turned after two seconds.
void close(test::SimRun& run, double at = 2.0) {
  run.run_to(at);
  run.apply("vehicle on");
  run.run_to(at + 4.0);
  REQUIRE(run.core().sequence().phase == Phase::closed);
}

bool is_present(const test::SimRun& run, FaultId id) {
  return run.core().faults().state(id).is_present();
}

bool is_refused(Simulator& simulator, std::string_view event, std::string_view words) {
  const auto applied = simulator.apply(event);
  return !applied && applied.error().wanted.find(words) != std::string::npos;
}

}  // namespace

TEST_CASE("an emulated IVT-S is verified, and the pack closes", "[scenario][sensors]") {
  test::SimRun run(ivt_pack());
  close(run);
  CHECK(run.core().sensor_setup().stage() == SensorSetupStage::done);
  CHECK(run.core().gate_refusals() == 0);
  CHECK(run.first(EventId::sensor_set_up) < 1.0);
}

TEST_CASE("two emulated IVT-S are verified, each by its own identifiers", "[scenario][sensors]") {
  test::SimRun run(two_ivts());
  run.run_to(0.5);
  CHECK(run.core().second_sensor_setup().stage() == SensorSetupStage::done);
  close(run);
  CHECK(run.core().sensor_setup().stage() == SensorSetupStage::done);
  CHECK(run.core().sensors().current_2_mA.is_valid());
  CHECK(run.core().gate_refusals() == 0);
}

TEST_CASE("a second IVT-S that somebody set up otherwise is not used", "[scenario][sensors][F20]") {
  test::SimRun run(two_ivts(R"(, "set_up": "configure")"));
  SensorUnit& second = run.simulator().world().second_sensor_unit;
  SensorSetting reversed = second.setting(0);
  reversed.is_inverted = true;
  second.give(0, reversed);
  second.restart(run.simulator().now());  // its settings have been read already
  run.run_to(4.0);
  CHECK(is_present(run, FaultId::sensor_not_set_up));
  CHECK(is_present(run, FaultId::current_sensor_lost));
  CHECK_FALSE(run.core().sensors().current_2_mA.is_valid());
  CHECK(second.setting(0).is_inverted);  // unchanged
  run.apply("vehicle on");
  run.run_to(6.0);
  CHECK(run.core().sequence().phase == Phase::open);
}

TEST_CASE("whoever else commands a second IVT-S is a second master", "[scenario][sensors][F39]") {
  test::SimRun run(two_ivts());
  close(run);
  run.observe(FrameReceived{Port::internal, {.id = 0x413, .length = 2, .data = {0x34}}});
  run.run_to(run.seconds() + 0.2);
  CHECK(is_present(run, FaultId::foreign_master));
  CHECK(run.core().sequence().phase == Phase::open);
}

TEST_CASE("whoever else commands an IVT-S is a second master, whatever the command", "[scenario][sensors][F39]") {
  const int command = GENERATE(0x34, 0x10, 0x30, 0x32, 0x3A, 0xFF);  // the mode, and others that the core never sends
  CAPTURE(command);
  test::SimRun run(ivt_pack());
  close(run);
  CHECK_FALSE(is_present(run, FaultId::foreign_master));
  CanFrame frame{.id = 0x411, .length = 8, .data = {static_cast<std::uint8_t>(command)}};
  run.observe(FrameReceived{Port::vehicle, frame});  // on another bus
  run.run_to(run.seconds() + 0.2);
  CHECK_FALSE(is_present(run, FaultId::foreign_master));
  frame.id = 0x412;
  run.observe(FrameReceived{Port::internal, frame});
  run.run_to(run.seconds() + 0.2);
  CHECK_FALSE(is_present(run, FaultId::foreign_master));
  frame.id = 0x411;
  for (bool CanFrame::*const kind : {&CanFrame::is_remote, &CanFrame::is_extended, &CanFrame::is_error}) {
    CanFrame other = frame;
    other.*kind = true;
    run.observe(FrameReceived{Port::internal, other});
  }
  run.observe(FrameEchoed{Port::internal, frame});  // echo of the core
  run.run_to(run.seconds() + 0.2);
  CHECK_FALSE(is_present(run, FaultId::foreign_master));
  const auto rejected = [&run] {
    return run.core().receive_counts().rejected[static_cast<std::size_t>(RejectReason::foreign_master)];
  };
  const auto before = rejected();
  const auto accepted = run.core().receive_counts().accepted;
  run.observe(FrameReceived{Port::internal, frame});
  run.run_to(run.seconds() + 0.2);
  CHECK(is_present(run, FaultId::foreign_master));
  CHECK(run.core().sequence().phase == Phase::open);
  CHECK(rejected() == before + 1);
  CHECK(run.core().receive_counts().accepted >= accepted);
}

TEST_CASE("what looks like a command to an IVT-S is none where the pack has no such sensor", "[scenario][sensors]") {
  test::SimRun run(test::patched_pack("{}"));
  close(run);
  run.observe(FrameReceived{Port::internal, {.id = 0x411, .length = 8, .data = {0x34}}});
  run.run_to(run.seconds() + 0.2);
  CHECK_FALSE(is_present(run, FaultId::foreign_master));
  CHECK(run.core().sequence().phase == Phase::closed);
}

TEST_CASE("an IVT-S that somebody set up otherwise is not used, configured, it is", "[scenario][sensors]") {
  const std::string_view change = GENERATE("sensor_unit byte_order little", "sensor_unit current_sign inverted",
                                           "sensor_unit current_period_ms 100");
  CAPTURE(change);
  test::SimRun verified(ivt_pack());
  verified.apply(change);
  verified.apply("sensor_unit restart");  // its settings have been read already
  verified.run_to(4.0);
  CHECK(is_present(verified, FaultId::sensor_not_set_up));
  CHECK(is_present(verified, FaultId::current_sensor_lost));
  CHECK_FALSE(verified.core().pack().current_mA.is_valid());

  test::SimRun configured(ivt_pack(R"(, "set_up": "configure")"));
  configured.apply(change);
  configured.apply("sensor_unit restart");
  close(configured);
  CHECK_FALSE(is_present(configured, FaultId::sensor_not_set_up));
}

TEST_CASE("what is configured and not stored is gone when the sensor starts anew, and a closed pack opens for it",
          "[scenario][sensors]") {
  const bool is_stored = GENERATE(false, true);
  test::SimRun run(ivt_pack(R"(, "set_up": "configure", "store": )" + std::string(is_stored ? "true" : "false")));
  run.apply("sensor_unit byte_order little");
  close(run);
  run.apply("load current_A 5");
  run.run_to(7.0);
  run.apply("sensor_unit restart");
  run.run_to(9.0);
  CHECK((run.core().sequence().phase == Phase::closed) == is_stored);
  CHECK(run.core().sensor_setup().restarts() == 1);
  run.run_to(20.0);
  CHECK(run.core().sensor_setup().stage() == SensorSetupStage::done);  // configured again with the pack open
}

TEST_CASE("a sensor that starts anew in a drive and is as it was opens nothing", "[scenario][sensors]") {
  test::SimRun run(ivt_pack());
  close(run);
  run.apply("load current_A 20");
  run.run_to(8.0);
  run.apply("sensor_unit restart");
  run.run_to(12.0);
  CHECK(run.core().sequence().phase == Phase::closed);
  CHECK(run.first(EventId::sensor_restarted) > 8.0);
  CHECK(run.core().sensor_setup().stage() == SensorSetupStage::done);
}

TEST_CASE("a sensor that does not answer is not used", "[scenario][sensors]") {
  test::SimRun run(ivt_pack());
  run.apply("sensor_unit answers off");
  run.run_to(4.0);
  CHECK(run.core().sensor_setup().problem().trouble == SensorSetupTrouble::no_answer);
  CHECK_FALSE(run.core().pack().current_mA.is_valid());
}

TEST_CASE("an emulated LEM CAB is the first current, or the second", "[scenario][sensors]") {
  const bool is_first = GENERATE(true, false);
  test::SimRun run(pack_with_sensor(is_first ? R"("current_protocol": "lem_cab")"
                                             : R"("has_second_current": true, "second_protocol": "lem_cab")"));
  close(run);
  run.apply("load current_A 20");
  run.run_to(8.0);
  CHECK(run.core().pack().current_mA.is_valid());
  CHECK(run.core().pack().current_mA.value > 19'000);
  CHECK(run.core().sequence().phase == Phase::closed);
  run.apply(is_first ? "sensor current silent" : "sensor current_2 silent");
  run.run_to(9.0);
  CHECK(run.core().sequence().phase == Phase::open);
  CHECK(is_present(run, FaultId::current_sensor_lost));
}

TEST_CASE("a LEM CAB that stands still, is off or marks itself is noticed beside another sensor",
          "[scenario][sensors]") {
  const auto [event, fault] = GENERATE(std::pair{"sensor current_2 stuck on", FaultId::current_sensors_disagree},
                                       std::pair{"sensor current_2 offset_mA 30000", FaultId::current_sensors_disagree},
                                       std::pair{"sensor current_2 error on", FaultId::current_sensor_lost});
  CAPTURE(event);
  test::SimRun run(
      pack_with_sensor(R"("has_second_current": true, "second_protocol": "lem_cab", "second_is_reversed": true)"));
  close(run);
  run.apply(event);
  run.apply("load current_A 30");
  run.run_to(9.0);
  CHECK(run.core().sequence().phase == Phase::open);
  CHECK(is_present(run, fault));
}

TEST_CASE("an emulated iso165C lets the pack close, and opens it", "[scenario][insulation]") {
  const auto [event, fault] = GENERATE(std::pair{"insulation resistance_kOhm 5", FaultId::insulation_fault},
                                       std::pair{"insulation monitor earth_fault", FaultId::insulation_monitor_lost},
                                       std::pair{"insulation monitor device_error", FaultId::insulation_monitor_lost},
                                       std::pair{"insulation monitor no_signal", FaultId::insulation_monitor_lost});
  CAPTURE(event);
  test::SimRun run(iso_pack());
  close(run);
  CHECK(run.core().sensors().pdu.value.insulation_resistance_Ohm == known(1'200'000));
  run.apply(event);
  run.run_to(12.0);
  CHECK(run.core().sequence().phase == Phase::open);
  CHECK(is_present(run, fault));
}

TEST_CASE("an iso165C whose self-test is to come does not keep a pack open for ever", "[scenario][insulation]") {
  test::SimRun run(iso_pack());
  run.apply("insulation self_test pending");
  run.run_to(24.0);
  CHECK(is_present(run, FaultId::insulation_monitor_untested));
  close(run, 24.0);
  run.apply("insulation self_test running");
  run.run_to(34.0);
  CHECK(run.core().sequence().phase == Phase::closed);
  run.apply("insulation self_test done");
  run.run_to(60.0);
  CHECK(run.core().sequence().phase == Phase::closed);
  CHECK_FALSE(is_present(run, FaultId::insulation_monitor_untested));
}

TEST_CASE("a word of a script that the pack has nothing for is an error", "[scenario][sensors]") {
  Simulator plain(simulator_config(test::patched_pack("{}")), {}, test::SimRun::start);
  for (const std::string_view event : {"sensor_unit restart", "sensor_unit answers off", "sensor_unit byte_order big",
                                       "sensor_unit current_sign inverted", "sensor_unit current_period_ms 50"}) {
    CAPTURE(event);
    CHECK(is_refused(plain, event, "a sensor that can be configured"));
  }
  CHECK(is_refused(plain, "insulation self_test running", "an insulation monitor on a bus"));
  CHECK(plain.apply("insulation wire open"));
  Simulator iso(simulator_config(iso_pack()), {}, test::SimRun::start);
  for (const std::string_view event : {"insulation wire open", "insulation pwm_frequency_Hz 10",
                                       "insulation pwm_duty_permille 500", "insulation monitor undervoltage"}) {
    CAPTURE(event);
    CHECK(is_refused(iso, event, "the monitor is on a bus"));
  }
  CHECK(iso.apply("insulation monitor normal"));
}

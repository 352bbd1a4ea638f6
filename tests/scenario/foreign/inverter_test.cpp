// A stationary pack with an inverter: normal operation, an inverter without messages, and one that ignores its limits.
#include <optional>
#include <string>

#include "tests/support/catch.hpp"
#include "tests/support/patched_pack.hpp"
#include "tests/support/sim_run.hpp"

using namespace bmu;

namespace {

/// The shipped pack with these keys in its section.
CoreConfig storage(const std::string& keys = "") {
  return test::patched_pack(R"({"inverter": {)" + keys + "}}", "storage-16s-48v.json");
}

void close(test::SimRun& run) {
  run.apply("pack soc_permille 600");
  run.run_to(3.0);
  run.apply("vehicle on");
  run.run_to(10.0);
  REQUIRE(run.core().sequence().phase == Phase::closed);
}

bool is_present(const test::SimRun& run, FaultId id) {
  return run.core().faults().state(id).is_present();
}

const BatteryReport& told(const test::SimRun& run) {
  return run.simulator().world().inverter.told();
}

}  // namespace

TEST_CASE("an inverter draws and charges as it is told, and is told nothing may flow while the pack is open",
          "[scenario][inverter]") {
  const std::string protocol = GENERATE("discover", "orion", "pylontech", "sma", "victron");
  CAPTURE(protocol);
  test::SimRun run(storage(R"("protocol": ")" + protocol + "\""));
  run.apply("pack soc_permille 600");
  run.apply("inverter current_A 40");
  run.run_to(3.0);
  CHECK(told(run).charge_limit_mA == 0);
  CHECK(told(run).discharge_limit_mA == 0);
  CHECK_FALSE(told(run).may_charge);
  CHECK(told(run).charge_voltage_limit_mV == 55'200);
  CHECK(run.simulator().world().inverter.current_A() == 0.0);
  run.apply("vehicle on");
  run.run_to(30.0);
  REQUIRE(run.core().sequence().phase == Phase::closed);
  CHECK(run.core().pack().current_mA.value > 39'000);
  CHECK(run.core().pack().current_mA.value < 41'000);
  CHECK(told(run).discharge_limit_mA > 90'000);
  run.apply("inverter current_A -200");
  run.run_to(60.0);
  CHECK(run.core().pack().current_mA.value < -45'000);
  CHECK(-run.core().pack().current_mA.value <= run.core().limits().charge.limit_mA + 500);
  CHECK_FALSE(run.core().is_inverter_silent());
  CHECK(run.core().gate_refusals() == 0);
  run.apply("vehicle off");
  run.run_to(62.0);
  CHECK(run.core().sequence().phase == Phase::open);
  CHECK(told(run).charge_limit_mA == 0);
  CHECK(told(run).discharge_limit_mA == 0);
  CHECK_FALSE(told(run).may_discharge);
  for (const FaultRow& row : fault_table()) {
    INFO(row.name);
    CHECK_FALSE(is_present(run, row.id));
  }
}

TEST_CASE("the voltage in 356h is the sum of the cells, in the step of its form", "[scenario][inverter]") {
  struct Form {
    const char* name;
    double step_V;
  };
  const Form form = GENERATE(Form{"pylontech", 0.01}, Form{"sma", 0.01}, Form{"victron", 0.01}, Form{"discover", 0.1},
                             Form{"orion", 0.1});
  // 52 V, and 316 V, which just fits in hundredths.
  const char* const file = GENERATE("storage-16s-48v.json", "lfp-96s.json");
  CAPTURE(form.name, file);
  const CoreConfig config = test::patched_pack(
      R"({"buses": {"inverter": "can9"}, "inverter": {"protocol": ")" + std::string(form.name) + R"("}})", file);
  // From the wire, because the emulated inverter reads it with the same table.
  class Told final : public CoreTap {
   public:
    void observed(const Observation&) override {}
    void decided(TimePoint, const Decisions& decisions) override {
      for (const OutgoingFrame& sent : decisions.frames) {
        if (sent.port == Port::inverter && sent.frame.id == 0x356) frame = sent.frame;
      }
    }
    std::optional<CanFrame> frame;
  } told;
  VirtualRun run(config, simulator_config(config), {});
  run.set_tap(&told);
  REQUIRE(run.simulator().apply("pack soc_permille 600"));
  while (run.elapsed() < 5s) run.step();
  REQUIRE(told.frame);
  double sum_V = 0.0;
  for (std::size_t cell = 0; cell < cell_count(config); ++cell) sum_V += run.simulator().plant().cell(cell).voltage_V;
  const int raw = told.frame->data[0] + told.frame->data[1] * 256;
  CHECK(raw * form.step_V == Approx(sum_V).epsilon(0.005));
}

TEST_CASE(
    "a pack that is too cold to be charged goes on discharging, and its inverter, which stops at an alarm, with it",
    "[scenario][inverter]") {
  test::SimRun run(storage(R"("protocol": "sma")"));
  close(run);
  run.apply("inverter current_A 20");
  run.apply("pack ambient_dC -30");
  run.apply("pack temperature_dC -30");
  run.run_to(60.0);
  REQUIRE(is_present(run, FaultId::charge_undertemperature));
  CHECK(run.core().sequence().phase == Phase::closed);
  CHECK(told(run).alarms == 0);
  CHECK(told(run).warnings == bit_of(BatteryAlarm::cold_to_charge));
  CHECK(told(run).charge_limit_mA == 0);
  CHECK(run.simulator().world().inverter.current_A() > 19.0);
}

TEST_CASE("an inverter that falls silent opens the pack, and one that does so while it is open opens nothing",
          "[scenario][inverter]") {
  test::SimRun run(storage());
  close(run);
  run.apply("inverter current_A 20");
  run.run_to(20.0);
  run.apply("inverter silent");
  run.run_to(24.0);
  CHECK_FALSE(is_present(run, FaultId::inverter_lost));
  run.run_to(25.05);
  CHECK(is_present(run, FaultId::inverter_lost));
  run.run_to(25.3);
  CHECK(told(run).discharge_limit_mA == 0);
  run.run_to(27.0);  // without current there is nothing to wait for
  CHECK(run.core().sequence().phase == Phase::open);
  CHECK(run.core().last_opening().fault == FaultId::inverter_lost);
  run.run_to(40.0);
  CHECK_FALSE(is_present(run, FaultId::inverter_lost));
  CHECK(run.core().sequence().phase == Phase::open);  // until a new request
  run.apply("inverter talking");
  run.apply("vehicle off");
  run.run_to(45.0);
  run.apply("vehicle on");
  run.run_to(60.0);
  CHECK(run.core().sequence().phase == Phase::closed);
}

TEST_CASE("where the pack file wants it so, a silent inverter is told that nothing may flow, until it is back",
          "[scenario][inverter]") {
  test::SimRun run(storage(R"("when_silent": "stop")"));
  close(run);
  run.apply("inverter current_A 20");
  run.run_to(20.0);
  run.apply("inverter silent");
  run.run_to(28.0);
  CHECK(is_present(run, FaultId::inverter_silent));
  CHECK(run.core().sequence().phase == Phase::closed);
  CHECK(told(run).discharge_limit_mA == 0);
  CHECK(std::abs(run.core().pack().current_mA.value) < 500);
  run.apply("inverter talking");
  run.run_to(40.0);
  CHECK_FALSE(is_present(run, FaultId::inverter_silent));
  CHECK(run.core().pack().current_mA.value > 19'000);
}

TEST_CASE("a silent inverter may be worth a warning alone", "[scenario][inverter]") {
  test::SimRun run(storage(R"("when_silent": "warn")"));
  close(run);
  run.apply("inverter current_A 20");
  run.apply("inverter silent");
  run.run_to(30.0);
  CHECK(is_present(run, FaultId::inverter_silent));
  CHECK(run.core().sequence().phase == Phase::closed);
  CHECK(run.core().pack().current_mA.value > 19'000);
}

TEST_CASE("an inverter that was never heard has its time, and then the pack opens", "[scenario][inverter]") {
  test::SimRun run(storage(R"("first_word_max_ms": 20000)"));
  run.apply("inverter silent");
  close(run);
  while (run.seconds() < 22.0) {
    run.run_to(run.seconds() + 0.1);
    REQUIRE(told(run).charge_limit_mA == 0);  // no current is permitted in that time
    REQUIRE(told(run).discharge_limit_mA == 0);
  }
  CHECK(run.core().sequence().phase == Phase::closed);
  CHECK_FALSE(is_present(run, FaultId::inverter_lost));
  run.run_to(40.0);
  CHECK(run.core().sequence().phase == Phase::open);
  CHECK(run.core().last_opening().fault == FaultId::inverter_lost);
}

TEST_CASE("an inverter from which nobody expects a word is told what may flow without one", "[scenario][inverter]") {
  test::SimRun run(storage(R"("silence_max_ms": 0)"));
  run.apply("inverter silent");
  close(run);
  run.run_to(22.0);
  CHECK(run.core().sequence().phase == Phase::closed);
  CHECK(told(run).charge_limit_mA > 0);
  CHECK(told(run).discharge_limit_mA > 0);
}

TEST_CASE("an inverter that ignores its limits is opened for what flows", "[scenario][inverter]") {
  test::SimRun run(storage());
  close(run);
  run.apply("inverter obeys nobody");
  run.apply("inverter current_A 180");
  run.run_to(40.0);
  CHECK(run.core().sequence().phase == Phase::open);
  CHECK(run.core().last_opening().fault == FaultId::discharge_overcurrent);
}

TEST_CASE(
    "an inverter that takes longer to stop than the current has is cut off under load when the switch is turned off",
    "[scenario][inverter]") {
  const bool is_stopped_first = GENERATE(false, true);
  CAPTURE(is_stopped_first);
  test::SimRun run(storage());
  run.apply("inverter current_A 40");
  close(run);
  run.run_to(30.0);
  REQUIRE(run.core().pack().current_mA.value > 39'000);
  run.apply("inverter obeys nobody");
  if (is_stopped_first) run.apply("inverter current_A 0");
  run.run_to(32.0);
  run.apply("vehicle off");
  run.run_to(32.0 + to_s(run.core().config().contactors.zero_current_grace) + 0.2);
  CHECK(run.core().sequence().phase == Phase::open);
  CHECK(run.core().last_opening().cause == OpeningCause::request_over);
  CHECK((run.core().last_opening().current_mA.value > 39'000) != is_stopped_first);
}

TEST_CASE("a fault that wants no current is told at once, and what is wrong as an alarm", "[scenario][inverter]") {
  test::SimRun run(storage());
  close(run);
  run.apply("inverter current_A 30");
  run.run_to(20.0);
  REQUIRE(told(run).discharge_limit_mA > 90'000);
  run.apply("cell 1.3 voltage_mV 2600");
  run.run_to(21.0);
  CHECK(told(run).discharge_limit_mA == 0);
  CHECK(told(run).charge_limit_mA == 0);
  CHECK((run.core().inverter_report().alarms & bit_of(BatteryAlarm::low_voltage)) != 0);
}

TEST_CASE("somebody else's battery on the inverter's bus opens a closed pack, which takes a clear command after it",
          "[scenario][inverter][F39]") {
  test::SimRun run(storage());
  close(run);
  run.apply("inverter current_A 30");
  run.run_to(20.0);
  REQUIRE(told(run).discharge_limit_mA > 90'000);
  run.observe(FrameReceived{Port::vehicle, data_frame(0x351, 8)});
  run.run_to(20.3);
  CHECK(is_present(run, FaultId::foreign_battery));
  CHECK(told(run).discharge_limit_mA == 0);  // this master permits no current; the limits of the other are unknown
  // After 5 s at the latest, with any current.
  run.run_to(20.0 + 5.2);
  CHECK(run.core().sequence().phase == Phase::open);
  CHECK(run.core().last_opening().cause == OpeningCause::fault);
  CHECK(run.core().last_opening().fault == FaultId::foreign_battery);
  run.run_to(30.0);
  CHECK(is_present(run, FaultId::foreign_battery));
  run.observe(CommandGiven{.command = Command::clear_faults});
  run.run_to(30.1);
  CHECK_FALSE(is_present(run, FaultId::foreign_battery));
}

TEST_CASE("an inverter that follows somebody else's battery is cut off after the grace", "[scenario][inverter][F39]") {
  test::SimRun run(storage());
  close(run);
  run.apply("inverter obeys nobody");
  run.apply("inverter current_A 30");
  run.run_to(20.0);
  run.observe(FrameReceived{Port::vehicle, data_frame(0x351, 3)});  // of any length
  run.run_to(20.0 + 4.9);
  CHECK(run.core().sequence().phase == Phase::closed);
  run.run_to(20.0 + 5.2);
  CHECK(run.core().sequence().phase == Phase::open);
}

TEST_CASE("somebody else's battery on the inverter's bus keeps an open pack open, and closes none",
          "[scenario][inverter]") {
  test::SimRun run(storage());
  run.apply("pack soc_permille 600");
  run.run_to(3.0);
  run.observe(FrameReceived{Port::vehicle, data_frame(0x351, 8)});
  run.run_to(3.1);
  CHECK(is_present(run, FaultId::foreign_battery));
  run.apply("vehicle on");
  run.run_to(5.0);
  CHECK(run.core().sequence().phase == Phase::open);
}

TEST_CASE("a failure that an SMA inverter tells is a warning with its number", "[scenario][inverter]") {
  test::SimRun run(storage(R"("protocol": "sma")"));
  close(run);
  run.apply("inverter failed on");
  run.run_to(15.0);
  CHECK(is_present(run, FaultId::inverter_trouble));
  CHECK(run.core().sequence().phase == Phase::closed);
  run.apply("inverter failed off");
  run.run_to(20.0);
  CHECK_FALSE(is_present(run, FaultId::inverter_trouble));
}

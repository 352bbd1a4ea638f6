// Chargers that are controlled over a bus: a whole charge, and the faults of a charger.
#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/core/estimation/cell_charge.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/patched_pack.hpp"
#include "tests/support/sim_run.hpp"

using namespace bmu;

namespace {

constexpr double minute = 60.0;
constexpr double hour = 3'600.0;

/// A pack of the demonstration's cells, in `modules` modules of twelve, with chargers.
CoreConfig charged_pack(const std::string& charger, std::size_t modules = 4) {
  std::string nodes = "1";
  for (std::size_t node = 2; node <= modules; ++node) nodes += ", " + std::to_string(node);
  const std::string changes = R"("modules": [{"nodes": [)" + nodes + R"(], "cells": 12, "temperature_sensors": 4}],
    "contactors": {"precharge_overcurrent_mA": 6000, "precharge_energy_J": 5000},
    "limits": {"pack_voltage_mismatch": {"warn_mV": )" +
                              std::to_string(1'000 * modules) + R"(, "open_mV": )" + std::to_string(2'000 * modules) +
                              "}}";
  return test::patched_pack("{" + changes + R"(, "charger": {)" + charger + "}}");
}

std::string elcon(int units = 1, const std::string& more = "") {
  return R"("protocol": "elcon_tc", "current_max_mA": 20000, "units": )" + std::to_string(units) + more;
}

struct Extremes {
  double min_V = 9.0;
  double max_V = 0.0;
};
Extremes voltages(const Plant& plant) {
  Extremes found;
  for (std::size_t cell = 0; cell < plant.cell_count(); ++cell) {
    found.min_V = std::min(found.min_V, plant.cell(cell).voltage_V);
    found.max_V = std::max(found.max_V, plant.cell(cell).voltage_V);
  }
  return found;
}

bool has_fault(const Core& core) {
  return std::any_of(fault_table().begin(), fault_table().end(),
                     [&](const FaultRow& row) { return core.faults().state(row.id).is_present(); });
}

/// Plugs the charger in after three seconds, and runs until closed.
void plug_in(test::SimRun& run) {
  run.run_to(3.0);
  run.apply("charger current_A 25");
  run.apply("charger connected");
  run.run_to(15.0);
  REQUIRE(run.core().sequence().phase == Phase::closed);
}

}  // namespace

TEST_CASE("a pack of 96 cells is charged from 20 % to full, and every cell ends in its window",
          "[scenario][charge][BMU_11][slow][hours]") {
  CoreConfig config = charged_pack(elcon(4), 8);
  config.balancing.bleed_resistance_Ohm = 17;  // the least that the pack file may have: 0.25 A
  test::SimRun run(config);
  run.apply("pack soc_permille 200");
  run.apply("cell 2.7 soc_permille 212");
  run.apply("cell 6.3 soc_permille 208");
  run.apply("cell 5.1 soc_permille 196");
  plug_in(run);
  const Core& core = run.core();
  double highest_V = 0.0;
  bool has_balanced = false;
  for (double at = run.seconds(); at < 12 * hour && core.charge_control().stage() != ChargeStage::full; at += minute) {
    run.run_to(at);
    highest_V = std::max(highest_V, voltages(run.simulator().plant()).max_V);
    has_balanced = has_balanced || core.charge_control().stage() == ChargeStage::balancing;
  }
  REQUIRE(core.charge_control().stage() == ChargeStage::full);
  CHECK(has_balanced);
  const double full_V = core.charge_control().cell_full_uV() * 1e-6;
  const Extremes end = voltages(run.simulator().plant());
  CAPTURE(run.seconds() / hour, end.min_V, end.max_V, highest_V, full_V);
  CHECK(highest_V < full_V + 0.003);
  // Voltage of the cells at rest; with one further below the charge continues after balancing.
  CHECK(end.max_V > full_V - 0.010);
  // Within the window of docs/charging.md, and a digit of the wire.
  const double window_V = core.config().charger.balance_window_uV * 1e-6;
  CHECK(window_V == Approx(0.013));
  CHECK(end.max_V - end.min_V <= window_V + 0.0001);
  CHECK_FALSE(has_fault(core));
  run.run_to(run.seconds() + 5.0);
  CHECK(core.sequence().phase == Phase::open);  // the request has ended
  CHECK(core.last_opening().cause == OpeningCause::request_over);
}

namespace {

/// Number and longest duration of the pauses for balancing, of a charge from 96 % to its end.
struct Pauses {
  int count = 0;
  double longest_s = 0.0;
  bool has_bled = false;
};
Pauses pauses_of(test::SimRun& run, const std::vector<std::string>& cells) {
  run.apply("pack soc_permille 960");
  for (const std::string& cell : cells) run.apply(cell);
  plug_in(run);
  const Core& core = run.core();
  Pauses found;
  double paused_s = 0.0;
  while (run.seconds() < 12 * hour && core.charge_control().stage() != ChargeStage::full) {
    run.run_to(run.seconds() + 1.0);
    const bool is_pause = core.charge_control().stage() == ChargeStage::balancing;
    if (is_pause && paused_s == 0.0) ++found.count;
    paused_s = is_pause ? paused_s + 1.0 : 0.0;
    found.longest_s = std::max(found.longest_s, paused_s);
    found.has_bled = found.has_bled || (is_pause && core.balancing().state() == BalancingState::bleeding);
  }
  CHECK(core.charge_control().stage() == ChargeStage::full);
  CHECK_FALSE(has_fault(core));
  return found;
}

}  // namespace

TEST_CASE("cells that cannot be balanced hold a charge up once", "[scenario][charge][BMU_11][slow]") {
  SECTION("their charge is not known, which is what the plan goes by") {
    CoreConfig config = charged_pack(elcon());
    config.balancing.method = BalancingMethod::charge;
    test::SimRun run(config);
    const Pauses found = pauses_of(run, {"cell 1.7 soc_permille 980"});
    CAPTURE(found.count, found.longest_s);
    CHECK(found.count == 1);
    CHECK(found.longest_s < 330.0);
    CHECK_FALSE(found.has_bled);
  }
  SECTION("they differ by their resistance") {
    const std::string resistance_mOhm = GENERATE("8", "12", "20");
    test::SimRun run(charged_pack(elcon()));
    const Pauses found = pauses_of(run, {"cell 1.7 resistance_mOhm " + resistance_mOhm});
    CAPTURE(resistance_mOhm, found.count, found.longest_s);
    CHECK(found.count <= 1);
    CHECK(found.longest_s < 330.0);
    CHECK_FALSE(found.has_bled);
  }
}

TEST_CASE("a charge goes on after bleeding, and not for what a cell's resistance takes from its voltage",
          "[scenario][charge][BMU_11][slow][hours]") {
  CoreConfig config = charged_pack(elcon());
  config.balancing.bleed_resistance_Ohm = 17;
  test::SimRun run(config);
  const Pauses found = pauses_of(run, {"cell 1.7 resistance_mOhm 12", "cell 2.3 soc_permille 975"});
  CAPTURE(found.count, found.longest_s);
  CHECK(found.has_bled);
  CHECK(found.count <= 4);
  CHECK(found.longest_s > 600.0);
}

TEST_CASE("the highest cell is held at its full voltage, and then the pack is full and opens",
          "[scenario][charge][BMU_11]") {
  const std::string protocol = GENERATE("elcon_tc", "brusa_nlg5");
  CAPTURE(protocol);
  test::SimRun run(charged_pack(R"("end_for_ms": 20000, "protocol": ")" + protocol + "\"", 1));
  run.apply("pack soc_permille 930");
  run.apply("cell 1.7 soc_permille 936");
  plug_in(run);
  const Core& core = run.core();
  const double full_V = core.charge_control().cell_full_uV() * 1e-6;
  double highest_V = 0.0;
  bool was_held = false;
  while (run.seconds() < 2 * hour && core.charge_control().stage() != ChargeStage::full) {
    run.run_to(run.seconds() + 1.0);
    highest_V = std::max(highest_V, voltages(run.simulator().plant()).max_V);
    was_held = was_held || core.charge_control().is_held();
    CHECK(-core.pack().current_mA.value < 25'500);
  }
  CAPTURE(run.seconds(), highest_V, full_V);
  REQUIRE(core.charge_control().stage() == ChargeStage::full);
  CHECK(was_held);
  CHECK(highest_V > full_V - 0.005);
  CHECK(highest_V < full_V + 0.003);
  CHECK(core.gate_refusals() == 0);
  run.run_to(run.seconds() + 8.0);
  CHECK(core.sequence().phase == Phase::open);
  CHECK(core.last_opening().cause == OpeningCause::request_over);
  CHECK_FALSE(has_fault(core));
}

TEST_CASE("a charger that falls silent while it charges opens the way, and charges on when it is back",
          "[scenario][charge][F98]") {
  test::SimRun run(charged_pack(elcon()));
  plug_in(run);
  run.run_to(40.0);
  const Core& core = run.core();
  REQUIRE(-core.pack().current_mA.value > 15'000);
  run.apply("charger mains off");
  run.run_to(40.0 + to_s(core.chargers().silence_max()) + 1.0 + 0.2);
  CHECK(core.faults().state(FaultId::charger_silent).is_present());
  CHECK(core.sequence().phase == Phase::open);
  CHECK_FALSE(core.charge_control().is_enabled());
  run.run_to(60.0);
  run.apply("charger mains on");
  run.run_to(64.0);
  CHECK(core.sequence().phase == Phase::open);  // it has to be steady first
  run.run_to(90.0);
  CHECK(core.sequence().phase == Phase::closed);
  CHECK(-core.pack().current_mA.value > 15'000);
  CHECK_FALSE(has_fault(core));
}

TEST_CASE("behind a charging post a Brusa charges if the pack file lets it ask for mains, and only then",
          "[scenario][charge][BMU_11]") {
  const bool is_asked = GENERATE(false, true);
  const std::string asked = is_asked ? "true" : "false";
  test::SimRun run(charged_pack(R"("protocol": "brusa_nlg5", "requests_mains": )" + asked, 1));
  run.apply("charger post on");
  plug_in(run);
  run.run_to(40.0);
  const Core& core = run.core();
  CHECK(core.charge_control().is_enabled());
  CHECK((-core.pack().current_mA.value > 5'000) == is_asked);
  CHECK(core.chargers().unit(0).report.mains_voltage_mV == known(is_asked ? 230'000 : 0));
  CHECK(core.gate_refusals() == 0);
  CHECK_FALSE(has_fault(core));
  run.apply("charger disconnected");
  run.run_to(42.0);
  CHECK(core.sequence().phase == Phase::open);
  CHECK(core.chargers().unit(0).report.mains_voltage_mV == known(0));  // no request for mains remains
}

TEST_CASE("a charger that gives more than it is asked for is cut off, and stays so", "[scenario][charge][F97]") {
  CoreConfig config = charged_pack(R"("protocol": "elcon_tc", "current_max_mA": 8000)");
  test::SimRun run(config);
  plug_in(run);
  run.run_to(40.0);
  const Core& core = run.core();
  REQUIRE(-core.pack().current_mA.value < 8'500);
  run.apply("charger obeys nobody");
  run.run_to(43.0);
  CHECK(core.faults().state(FaultId::charger_runaway).is_present());
  CHECK(core.sequence().phase == Phase::open);
  run.run_to(100.0);
  CHECK(core.faults().state(FaultId::charger_runaway).is_present());  // latched
  CHECK(core.sequence().phase == Phase::open);
  // The key would connect the charger again; it closes the pack once the charger is unplugged.
  run.apply("vehicle on");
  while (run.seconds() < 130.0) {
    run.run_to(run.seconds() + 0.1);
    REQUIRE(core.sequence().phase == Phase::open);
  }
  run.apply("charger disconnected");
  run.apply("vehicle off");
  run.run_to(132.0);
  run.apply("vehicle on");
  run.run_to(145.0);
  CHECK(core.sequence().phase == Phase::closed);
}

TEST_CASE("a sensor that is reversed or stands still does not hide a charger that gives more than it is asked for",
          "[scenario][charge][F97]") {
  for (const std::string sensor : {"sensor current inverted on", "sensor current stuck on"}) {
    CAPTURE(sensor);
    CoreConfig config = charged_pack(R"("protocol": "elcon_tc", "current_max_mA": 8000)");
    test::SimRun run(config);
    plug_in(run);
    run.run_to(40.0);
    const Core& core = run.core();
    REQUIRE(core.sequence().phase == Phase::closed);
    run.apply(sensor);
    run.apply("charger obeys nobody");
    run.run_to(46.0);
    CHECK(core.faults().state(FaultId::charger_runaway).is_present());
    CHECK(core.sequence().phase == Phase::open);
  }
}

TEST_CASE("a charger that goes on after it was told to stop opens the pack", "[scenario][charge][F99]") {
  const std::string end = R"(, "opens_when_full": false, "end_for_ms": 5000, "end_current_mA": 6000)";
  test::SimRun run(charged_pack(elcon(1, end), 1));
  run.apply("pack soc_permille 985");
  plug_in(run);
  const Core& core = run.core();
  while (run.seconds() < hour && core.charge_control().current_mA() > 6'000) run.run_to(run.seconds() + 0.1);
  run.apply("charger unstoppable on");
  while (run.seconds() < hour && core.charge_control().stage() != ChargeStage::full) run.run_to(run.seconds() + 0.1);
  const double stopped_s = run.seconds();
  REQUIRE(core.sequence().phase == Phase::closed);
  run.run_to(stopped_s + to_s(core.chargers().driver().settle) + 1.0);
  CHECK(core.faults().state(FaultId::charger_keeps_on).is_present());
  CHECK(core.sequence().phase == Phase::open);
  CHECK(core.last_opening().fault == FaultId::charger_keeps_on);
}

TEST_CASE("a plug that is pulled under load opens at once, and asks for nothing more", "[scenario][charge][F100]") {
  test::SimRun run(charged_pack(elcon()));
  plug_in(run);
  run.run_to(40.0);
  const Core& core = run.core();
  REQUIRE(-core.pack().current_mA.value > 15'000);
  run.apply("charger disconnected");
  run.run_to(40.2);
  CHECK(core.charge_control().stage() == ChargeStage::off);
  CHECK(core.charge_control().current_mA() == 0);
  run.run_to(41.0);
  CHECK(core.sequence().phase == Phase::open);
}

TEST_CASE("nothing is asked of a charger while cells are not known, or charging is forbidden", "[scenario][charge]") {
  test::SimRun run(charged_pack(elcon()));
  plug_in(run);
  run.run_to(40.0);
  const Core& core = run.core();
  REQUIRE(core.charge_control().current_mA() > 15'000);
  SECTION("a module falls silent") {
    run.apply("module 2 silent");
    run.run_to(40.5);
    CHECK(core.charge_control().current_mA() == 0);
  }
  SECTION("the cells freeze") {
    run.apply("pack temperature_dC -50");
    run.run_to(42.0);
    CHECK(core.charge_control().current_mA() == 0);
    CHECK_FALSE(core.charge_control().is_enabled());
  }
  SECTION("the daemon ends") {
    run.give(Command::shut_down);
    run.run_to(40.3);
    CHECK(core.charge_control().current_mA() == 0);
  }
}

TEST_CASE("a charge that goes on in a pack that stayed closed is not waited for any more", "[scenario][charge][F98]") {
  test::SimRun run(charged_pack(elcon()));
  plug_in(run);
  run.apply("vehicle on");
  run.run_to(40.0);
  const Core& core = run.core();
  REQUIRE(-core.pack().current_mA.value > 15'000);
  run.apply("charger mains off");
  run.run_to(50.0);
  CHECK(core.faults().state(FaultId::charger_silent).is_present());
  CHECK(core.sequence().phase == Phase::closed);
  CHECK(core.is_resume_pending());
  run.apply("charger mains on");
  run.run_to(70.0);
  CHECK(-core.pack().current_mA.value > 15'000);
  CHECK_FALSE(core.is_resume_pending());
}

TEST_CASE("an interrupted charge does not go on by itself once somebody, or something else, has had a say",
          "[scenario][charge][F98]") {
  test::SimRun run(charged_pack(elcon()));
  plug_in(run);
  run.run_to(40.0);
  run.apply("charger mains off");
  run.run_to(50.0);
  const Core& core = run.core();
  REQUIRE(core.sequence().phase == Phase::open);
  REQUIRE(core.is_resume_pending());
  SECTION("an emergency stop") {
    run.apply("estop 1 pressed");
    run.run_to(52.0);
    run.apply("estop 1 released");
    run.run_to(55.0);
    run.give(Command::clear_faults);
  }
  SECTION("a clear command") {
    run.give(Command::clear_faults);
  }
  SECTION("unplugged, and plugged in elsewhere: that asks by itself") {
    run.apply("charger disconnected");
    run.run_to(52.0);
    CHECK_FALSE(core.is_resume_pending());
    return;
  }
  run.run_to(60.0);
  CHECK_FALSE(core.is_resume_pending());
  run.apply("charger mains on");
  run.run_to(120.0);
  CHECK(core.sequence().phase == Phase::open);
  run.apply("charger disconnected");
  run.run_to(125.0);
  run.apply("charger connected");
  run.run_to(140.0);
  CHECK(core.sequence().phase == Phase::closed);  // by a new request
}

TEST_CASE("a frame of a charger that is not plugged in opens nothing, however the pack brakes",
          "[scenario][charge][F97]") {
  test::SimRun run(charged_pack(elcon()));
  run.run_to(3.0);
  run.apply("vehicle on");
  run.run_to(15.0);
  const Core& core = run.core();
  REQUIRE(core.sequence().phase == Phase::closed);
  const ChargerDriver& driver = core.chargers().driver();
  run.observe(FrameReceived{Port::internal, driver.command(0, {})});
  for (const CanFrame& frame : driver.reports(0, {.voltage_mV = known(250'000), .current_mA = known(40'000)})) {
    run.observe(FrameReceived{Port::internal, frame});
  }
  run.apply("load current_A -10");
  run.run_to(30.0);
  CHECK(core.sequence().phase == Phase::closed);
  CHECK_FALSE(has_fault(core));
}

TEST_CASE("one report that tells too much opens nothing that the pack's sensor does not see",
          "[scenario][charge][F97]") {
  test::SimRun run(charged_pack(elcon()));
  plug_in(run);
  run.run_to(40.0);
  const Core& core = run.core();
  const ChargerReport wild{.voltage_mV = known(180'000), .current_mA = known(60'000)};
  for (const CanFrame& frame : core.chargers().driver().reports(0, wild)) {
    run.observe(FrameReceived{Port::internal, frame});
  }
  run.run_to(50.0);
  CHECK(core.sequence().phase == Phase::closed);
  CHECK_FALSE(has_fault(core));
}

TEST_CASE("a charger that goes on is found out with the key on, too", "[scenario][charge][F99]") {
  test::SimRun run(charged_pack(elcon()));
  run.run_to(3.0);
  run.apply("vehicle on");
  plug_in(run);
  run.run_to(40.0);
  const Core& core = run.core();
  REQUIRE(-core.pack().current_mA.value > 15'000);
  run.apply("charger obeys nobody");
  run.apply("charger unstoppable on");
  run.apply("charger disconnected");
  run.run_to(40.0 + to_s(core.chargers().driver().settle) + 5.0);
  CHECK(core.faults().state(FaultId::charger_keeps_on).is_present());
  CHECK(core.sequence().phase == Phase::open);
}

TEST_CASE("less is told at once", "[scenario][charge]") {
  test::SimRun run(charged_pack(elcon(2)));
  plug_in(run);
  run.run_to(40.0);
  const Core& core = run.core();
  CHECK(core.ordered_mA(0) == core.ordered_mA(1));
  const std::int32_t before_mA = core.ordered_mA(0);
  REQUIRE(before_mA > 8'000);
  run.apply("cell 1.1 voltage_mV 4195");  // nearly full: the hold voltage reduces the current
  run.run_to(40.4);
  CHECK(core.ordered_mA(0) < before_mA);
  CHECK(core.gate_refusals() == 0);
}

TEST_CASE("a unit that comes late waits for the others to come down, and shares with them then",
          "[scenario][charge][BMU_11]") {
  test::SimRun run(charged_pack(elcon(4)));
  run.apply("charger units 3");
  plug_in(run);
  run.run_to(60.0);
  const Core& core = run.core();
  const auto ordered_mA = [&core] {
    std::int32_t sum_mA = 0;
    for (std::size_t unit = 0; unit < core.chargers().unit_count(); ++unit) sum_mA += core.ordered_mA(unit);
    return sum_mA;
  };
  const std::int32_t asked_mA = core.charge_control().current_mA();
  REQUIRE(asked_mA > 15'000);
  CHECK(core.ordered_mA(0) == asked_mA / 3);
  CHECK(core.ordered_mA(3) == 0);
  REQUIRE(core.chargers().unit(3).values_at == TimePoint{});
  run.apply("charger units 4");
  // The others receive their smaller share with the next command, and then have the settling time to come down to it.
  double told_s = 0.0;
  while (run.seconds() < 80.0 && core.ordered_mA(3) == 0) {
    run.run_to(run.seconds() + 0.01);
    CHECK(ordered_mA() <= core.charge_control().current_mA());
    CHECK(-core.pack().current_mA.value < asked_mA + 500);
    if (told_s == 0.0 && core.ordered_mA(0) == asked_mA / 4) told_s = run.seconds();
  }
  const Duration settle = core.chargers().driver().settle;
  REQUIRE(told_s > 0.0);
  CHECK(run.seconds() - told_s >= to_s(settle) - 0.02);
  CHECK(run.seconds() - told_s < to_s(settle + core.chargers().driver().command_period));
  CHECK(core.ordered_mA(3) == core.ordered_mA(0));
  CHECK(core.sequence().phase == Phase::closed);
  CHECK_FALSE(has_fault(core));
  CHECK(core.gate_refusals() == 0);
}

TEST_CASE("a full pack opens although something is drawn from it", "[scenario][charge]") {
  test::SimRun run(charged_pack(elcon(1, R"(, "end_for_ms": 5000, "end_current_mA": 6000)"), 1));
  run.apply("pack soc_permille 985");
  plug_in(run);
  run.apply("load current_A 3");
  const Core& core = run.core();
  while (run.seconds() < hour && core.charge_control().stage() != ChargeStage::full) run.run_to(run.seconds() + 0.1);
  REQUIRE(core.charge_control().stage() == ChargeStage::full);
  run.run_to(run.seconds() + 8.0);
  CHECK(core.sequence().phase == Phase::open);
  CHECK(core.last_opening().cause == OpeningCause::request_over);
}

TEST_CASE("a charger that comes and goes is followed ten times and no more", "[scenario][charge][F98]") {
  test::SimRun run(charged_pack(elcon(), 1));
  plug_in(run);
  const Core& core = run.core();
  int resumed = 0;
  for (int cut = 0; cut < 12; ++cut) {
    run.run_to(run.seconds() + 3.0);
    run.apply("charger mains off");
    run.run_to(run.seconds() + 15.0);
    REQUIRE(core.sequence().phase == Phase::open);
    run.apply("charger mains on");
    run.run_to(run.seconds() + 12.0);
    if (core.sequence().phase == Phase::closed) ++resumed;
  }
  CHECK(resumed == 10);
}

TEST_CASE("a charge of the packs of six cells pauses at half of the charge, a few times at most",
          "[scenario][charge][RES_1]") {
  const std::string name = GENERATE("lipo-6s-24v", "shell-eco-6s");
  CAPTURE(name);
  test::SimRun run(test::patched_pack("{}", name + ".json"));
  run.apply("pack soc_permille 440");
  run.run_to(3.0);
  run.apply("charger connected");
  run.run_to(8.0);
  REQUIRE(run.core().sequence().phase == Phase::closed);
  const Core& core = run.core();
  int pauses = 0;
  bool was_pausing = false;
  // A charger that follows the limit it is given.
  while (run.seconds() < 15 * minute && *core.soc_permille() < 560) {
    const double charge_A = std::min(5.0, core.limits().charge.limit_mA / 1e3);
    run.apply("charger current_A " + std::to_string(charge_A));
    run.run_to(run.seconds() + 0.1);
    const bool is_pausing = core.charge_pause().is_pausing();
    if (is_pausing && !was_pausing) {
      ++pauses;
      CHECK(*core.soc_permille() >= 497);
      CHECK(*core.soc_permille() < 500 + pause_span_permille);
      CHECK(core.limits().charge.cause == LimitCause::measuring);
    }
    was_pausing = is_pausing;
  }
  CHECK(pauses >= 1);
  CHECK(pauses <= pauses_max);
  CHECK(core.sequence().phase == Phase::closed);
}

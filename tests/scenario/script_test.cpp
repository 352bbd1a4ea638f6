// Execution of scripts: events, conditions and their verdict, with the emulated pack alone and with the core.
#include <fstream>
#include <memory>
#include <sstream>

#include "config/pack_config.hpp"
#include "tests/support/allocation_count.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/folders.hpp"
#include "tests/support/mmu_bench.hpp"
#include "tools/common/virtual_run.hpp"

namespace bmu {
namespace {

using namespace bmu::test;

SimulatorConfig two_modules(std::uint64_t seed = 1) {
  SimulatorConfig config;
  config.seed = seed;
  config.plant.cell.ocv_V.fill(3.7);
  for (std::uint8_t node = 1; node <= 2; ++node) {
    config.modules.push_back({.node = node});
    config.plant.cells_of_module.push_back(12);
  }
  return config;
}

Scenario parsed(std::string_view text) {
  const auto scenario = parse_scenario(text, core_vocabulary());
  if (!scenario) FAIL(to_text(scenario.error().front(), "test"));
  return *scenario;
}

/// The emulated pack with a script; times are from the start.
struct Stage {
  explicit Stage(std::string_view script, const SimulatorConfig& config = two_modules())
      : simulator(config, parsed(script), power_up) {}

  void run_to(Duration end) {
    while (simulator.now() < power_up + end) {
      for (const SentFrame& sent : simulator.advance(simulator.now() + 1ms)) frames.push_back(sent.frame);
    }
  }
  [[nodiscard]] ScriptVerdict verdict() const { return simulator.script().verdict(); }
  [[nodiscard]] bool is_closed() const { return simulator.plant().is_closed(ContactorName::main_positive); }
  [[nodiscard]] std::string failure() const { return simulator.script().failure(); }
  /// Time at which the outcome with this number was decided.
  [[nodiscard]] Duration decided(std::size_t outcome) const {
    REQUIRE(simulator.script().outcomes().size() > outcome);
    return simulator.script().outcomes()[outcome].ended_at - power_up;
  }

  Simulator simulator;
  std::vector<CanFrame> frames;
};

CanFrame contactor_frame(std::uint8_t outputs, std::uint8_t counter) {
  CanFrame frame = make_frame(internal_bus::contactor_command);
  frame.data[0] = outputs;
  seal(internal_bus::contactor_command, counter, frame);
  return frame;
}

constexpr std::string_view weld = "0.5 contactor main_positive welded\n";

// --- waiting --------------------------------------------------------------------------------------------------------

TEST_CASE("what follows a wait counts from the moment it is met", "[scenario][script]") {
  Stage stage(std::string(weld) + "0 wait contactor main_positive closed within 1\n0.2 contactor main_positive ok");
  stage.run_to(700ms);
  CHECK(stage.decided(0) == 501ms);
  CHECK(stage.is_closed());
  stage.run_to(702ms);
  CHECK_FALSE(stage.is_closed());
  CHECK(stage.simulator.script().is_over());
}

TEST_CASE("a wait that takes too long fails the run, and nothing more of the script happens", "[scenario][script]") {
  Stage stage("2 contactor main_positive welded\n0.1 wait contactor main_positive closed within 0.3\n0 vehicle on");
  stage.run_to(399ms);
  CHECK(stage.verdict() == ScriptVerdict::open);
  stage.run_to(400ms);
  CHECK(stage.verdict() == ScriptVerdict::failed);
  CHECK(stage.failure() == "at 0.4 s: waited 0.3 s for contactor main_positive closed; found open");
  CHECK(stage.simulator.script().deciding_line()->line == 2);
  stage.run_to(3s);
  CHECK_FALSE(stage.is_closed());
  CHECK(stage.simulator.script().conclude(stage.simulator.now()) == ScriptVerdict::failed);
}

TEST_CASE("a wait may be met at its last moment", "[scenario][script]") {
  Stage stage("0.399 contactor main_positive welded\n0.1 wait contactor main_positive closed within 0.3");
  stage.run_to(1s);
  CHECK(stage.decided(0) == 400ms);
  CHECK(stage.verdict() == ScriptVerdict::open);
}

TEST_CASE("waits for what is already so cost no time", "[scenario][script]") {
  Stage stage(
      "0.5 wait contactor main_positive open within 1\nwait load current_A = 0 within 1\n0 contactor main_positive "
      "welded");
  stage.run_to(501ms);
  CHECK(stage.decided(1) == 500ms);
  CHECK(stage.is_closed());
}

TEST_CASE("lines before a wait go on in their own time", "[scenario][script]") {
  Stage stage(
      "1 contactor main_positive welded\n0.2 wait load current_A = 0 within 1\n0.3 contactor main_negative welded");
  stage.run_to(501ms);
  CHECK(stage.simulator.plant().is_closed(ContactorName::main_negative));
  CHECK_FALSE(stage.is_closed());
  stage.run_to(1001ms);
  CHECK(stage.is_closed());
}

// --- expect, always, never ------------------------------------------------------------------------------------------

TEST_CASE("an expectation that does not hold says what was there", "[scenario][script]") {
  struct Case {
    const char* line;
    const char* found;  // empty: it is true
  };
  const Case cases[] = {
      {"expect cell 2.7 voltage_mV = 2700", ""},
      {"expect cell 2.7 voltage_mV < 2700", "2700"},
      {"expect cell 2.8 voltage_mV != 3700", "3700"},
      {"expect pack cell_voltage_min_mV <= 2700", ""},
      {"expect pack cell_voltage_min_mV > 2700", "2700"},
      {"expect pack cell_voltage_max_mV = 4100", ""},
      {"expect pack temperature_max_dC = 355.5", ""},
      {"expect pack temperature_max_dC < 355.5", "355.5"},
      {"expect pack soc_permille > 799", ""},
      {"expect cell 1.1 soc_permille < 100", "800"},
      {"expect cell 1.1 balancing", "not balancing"},
      {"expect contactor charge open", ""},
      {"expect contactor precharge open", "closed"},
      {"expect link voltage_mV > 1", "0"},
      {"expect charger current_A > 0", "0"},
      {"expect module 2 mode = starting", ""},
      {"expect module 2 mode != starting", "starting"},
      {"expect master phase = closed", "open"},
      {"expect master opened_by != none", "none"},
  };
  for (const Case& one : cases) {
    INFO(one.line);
    Stage stage(std::string("0 cell 2.7 voltage_mV 2700\n0 cell 1.3 voltage_mV 4100\n0 contactor precharge welded\n"
                            "0 cell 1.4 temperature_dC 355.5\n0.003 ") +
                one.line);
    stage.run_to(10ms);
    const std::string wanted = one.found;
    CHECK(stage.verdict() == (wanted.empty() ? ScriptVerdict::open : ScriptVerdict::failed));
    const std::string text = stage.failure();
    if (!wanted.empty()) CHECK(text.substr(text.find("; found ") + 8) == wanted);
  }
}

TEST_CASE("every row of the table of states can be asked", "[scenario][script]") {
  const std::string place_of[] = {"", " 2", " 2.3", " 2.3", ""};
  const std::string rest_of[] = {"", " > -1e9", " != breaking", " != shut_down", " != asleep"};
  for (const StateSpec& row : state_table()) {
    const TargetSpec& target = target_table()[static_cast<std::size_t>(row.target)];
    std::string asked = std::string(target.name) + place_of[static_cast<std::size_t>(target.address)];
    if (target.address == Address::word) asked += " " + std::string(target.words.back());
    asked += " " + std::string(row.name) + rest_of[static_cast<std::size_t>(row.kind)];
    INFO(asked);
    Stage stage("0.001 wait " + asked + " within 0.005");
    stage.run_to(10ms);
    const bool is_open_by_itself = row.kind != StateKind::flag || row.name == "open";
    CHECK(stage.simulator.script().outcomes()[0].has_held == is_open_by_itself);
  }
}

TEST_CASE("a module can be waited for, whatever it does", "[scenario][script]") {
  Stage stage(
      "0.5 wait module 2 mode = normal within 1\n+0.1 module 2 external_supply_mV 0\n"
      "wait module 2 mode = going_to_sleep within 2\nwait module 2 mode = asleep within 1\nexpect module 1 mode = "
      "normal");
  stage.run_to(4s);
  CHECK(stage.failure().empty());
  CHECK(stage.simulator.script().outcomes().size() == 4);
}

TEST_CASE("a script is over when its last ramp has come to its end", "[scenario][script]") {
  Stage stage("0.1 expect cell 1.1 voltage_mV = 3700\n0.1 cell 1.1 voltage_mV 3700..3600 over 0.5");
  stage.run_to(599ms);
  CHECK_FALSE(stage.simulator.script().is_over());
  stage.run_to(600ms);
  CHECK(stage.simulator.script().is_over());
  CHECK(stage.simulator.world().sensed_mV(0) == 3600.0);
}

TEST_CASE("always and never watch from their moment to their end", "[scenario][script]") {
  const auto verdict_of = [](const std::string& line) {
    Stage stage(std::string(weld) + "1 contactor main_positive ok\n" + line);
    stage.run_to(2s);
    return stage.simulator.script().conclude(stage.simulator.now());
  };
  CHECK(verdict_of("0.1 never contactor main_positive closed") == ScriptVerdict::failed);
  CHECK(verdict_of("0.1 never contactor main_positive closed for 0.4") == ScriptVerdict::passed);
  CHECK(verdict_of("0.1 never contactor main_positive closed for 0.5") == ScriptVerdict::failed);
  CHECK(verdict_of("1.1 never contactor main_positive closed") == ScriptVerdict::passed);
  CHECK(verdict_of("0.6 always contactor main_positive closed") == ScriptVerdict::failed);
  CHECK(verdict_of("0.6 always contactor main_positive closed for 0.4") == ScriptVerdict::passed);
  CHECK(verdict_of("0.4 always contactor main_positive closed for 0.4") == ScriptVerdict::failed);
  CHECK(verdict_of("1.5 never contactor main_positive closed for 0.6") == ScriptVerdict::unfinished);
}

TEST_CASE("what always had to hold says since when", "[scenario][script]") {
  Stage stage(std::string(weld) + "0.2 always contactor main_positive open");
  stage.run_to(1s);
  CHECK(stage.failure() == "at 0.501 s: expected always contactor main_positive open, from 0.2 s on; found closed");
}

// --- frames ---------------------------------------------------------------------------------------------------------

TEST_CASE("a frame that is waited for has to be whole and to say so", "[scenario][script]") {
  Stage stage("0.1 wait frame CONTACTOR_COMMAND main_positive = 1 within 0.3");
  stage.simulator.observe(contactor_frame(0x01, 1), power_up);
  stage.run_to(150ms);
  stage.simulator.observe(contactor_frame(0x02, 2), stage.simulator.now());
  CanFrame damaged = contactor_frame(0x01, 3);
  damaged.data[7] ^= 1U;
  stage.simulator.observe(damaged, stage.simulator.now());
  CanFrame remote = contactor_frame(0x01, 3);
  remote.is_remote = true;
  stage.simulator.observe(remote, stage.simulator.now());
  CHECK(stage.simulator.script().outcomes().empty());
  SECTION("it comes") {
    stage.simulator.observe(contactor_frame(0x03, 3), stage.simulator.now() + 250us);
    CHECK(stage.decided(0) == 150ms + 250us);
  }
  SECTION("another one came last") {
    stage.run_to(1s);
    CHECK(stage.failure() ==
          "at 0.4 s: waited 0.3 s for frame CONTACTOR_COMMAND main_positive = 1; "
          "found main_positive = 0, 0.25 s ago");
  }
}

TEST_CASE("a wait for a frame that never comes says that", "[scenario][script]") {
  Stage stage("0 wait frame 0x7AB within 0.1");
  stage.run_to(1s);
  CHECK(stage.failure() == "at 0.1 s: waited 0.1 s for frame 0x7AB; found no such frame");
}

TEST_CASE("what the emulated devices send counts as well, by name and node", "[scenario][script]") {
  const auto met = [](const std::string& condition) {
    Stage stage("0.3 vehicle on\n0.2 wait " + condition + " within 0.6");
    stage.run_to(250ms);
    stage.simulator.observe(poll_frame(2, want_all | want_sync, 1), stage.simulator.now());
    stage.run_to(1s);
    return stage.simulator.script().outcomes()[0].has_held;
  };
  CHECK(met("frame PDU_STATUS vehicle_on = 1"));
  CHECK_FALSE(met("frame PDU_STATUS charger_connected = 1"));
  CHECK(met("frame 0x041 insulation_monitor_state = speed_start"));
  CHECK(met("frame PDU_STATUS throttle_permille = not_known"));
  CHECK_FALSE(met("frame PDU_STATUS throttle_permille != not_known"));
  CHECK_FALSE(met("frame PDU_STATUS throttle_permille >= 0"));
  CHECK(met("frame STATUS mode = normal"));
  CHECK(met("frame STATUS 2 cell_count = 12"));
  CHECK_FALSE(met("frame STATUS 1 cell_count = 12"));
  CHECK(met("frame SENSOR_U1 pack_voltage_mV > 80000"));
}

TEST_CASE("signals are read in the byte order this pack's sensor has", "[scenario][script]") {
  SimulatorConfig config = two_modules();
  config.sensor.little_endian = true;
  Stage stage("0 wait frame SENSOR_U1 pack_voltage_mV = 88800 within 1", config);
  stage.run_to(500ms);
  CHECK(stage.simulator.script().outcomes()[0].has_held);
}

TEST_CASE("a signal that this frame does not carry is not in it", "[scenario][script]") {
  Stage stage("0 never frame COMMAND mode = starting\n0 wait frame COMMAND 0 mode = going_to_sleep within 1");
  stage.run_to(10ms);
  stage.simulator.observe(command_frame(0, 1, {4, 0}), stage.simulator.now());  // stop balancing has no mode
  CHECK(stage.verdict() == ScriptVerdict::open);
  stage.simulator.observe(command_frame(0, 2, {1, 3}), stage.simulator.now());
  CHECK(stage.simulator.script().outcomes().size() == 1);
}

TEST_CASE("a frame that must never come fails the run when it does", "[scenario][script]") {
  Stage stage("0.1 never frame COMMAND 2 for 1\n0.1 never frame CONTACTOR_COMMAND main_positive = 1");
  stage.run_to(200ms);
  stage.simulator.observe(contactor_frame(0x02, 1), stage.simulator.now());
  stage.simulator.observe(command_frame(1, 1, {4}), stage.simulator.now());
  CHECK(stage.verdict() == ScriptVerdict::open);
  stage.simulator.observe_elsewhere(Port::vehicle, contactor_frame(0x01, 2), stage.simulator.now());
  CHECK(stage.verdict() == ScriptVerdict::failed);
  CHECK(stage.simulator.script().deciding_line()->line == 2);
}

// --- the end --------------------------------------------------------------------------------------------------------

TEST_CASE("pass ends the run before a later fail, and fail says its text", "[scenario][script]") {
  Stage passed("0.2 pass\n0.3 fail \"too late\"\n0 never contactor main_positive closed");
  passed.run_to(1s);
  CHECK(passed.verdict() == ScriptVerdict::passed);
  CHECK(passed.simulator.script().conclude(passed.simulator.now()) == ScriptVerdict::passed);
  CHECK(passed.simulator.script().outcomes().size() == 1);
  Stage failed("0.4 pass\n0.3 fail \"too late\"");
  failed.run_to(1s);
  CHECK(failed.verdict() == ScriptVerdict::failed);
  CHECK(failed.failure() == "at 0.3 s: too late");
}

TEST_CASE("a run that ends before the script has not passed", "[scenario][script]") {
  struct Case {
    const char* script;
    ScriptVerdict verdict;
  };
  const Case cases[] = {
      {"0 wait contactor main_positive closed within 5", ScriptVerdict::unfinished},
      {"3 expect contactor main_positive open", ScriptVerdict::unfinished},
      {"3 pass", ScriptVerdict::unfinished},
      {"3 fail", ScriptVerdict::passed},
      {"3 vehicle on", ScriptVerdict::passed},
      {"0 never contactor main_positive closed", ScriptVerdict::passed},
  };
  for (const Case& one : cases) {
    INFO(one.script);
    Stage stage(one.script);
    stage.run_to(1s);
    CHECK(stage.simulator.script().conclude(stage.simulator.now()) == one.verdict);
    CHECK(stage.failure().empty() == (one.verdict == ScriptVerdict::passed));
  }
}

// --- chance ---------------------------------------------------------------------------------------------------------

TEST_CASE("the same seed gives the same frames to the last bit, another seed others", "[scenario][script][property]") {
  const auto frames_of = [](std::uint64_t seed) {
    SimulatorConfig config = two_modules(seed);
    config.cell_noise_uV = 200;
    config.current_noise_mA = 20;
    Stage stage("repeat 40\n+random 0.01..0.1 sensor pack_voltage offset_mV random -500..500\nend", config);
    stage.run_to(3s);
    return stage.frames;
  };
  for (const std::uint64_t seed : {1U, 2U, 77U}) {
    CHECK(frames_of(seed) == frames_of(seed));
    CHECK(frames_of(seed) != frames_of(seed + 1));
  }
}

TEST_CASE("an event given by hand can be left to chance too", "[scenario][script]") {
  Stage stage("");
  REQUIRE(stage.simulator.apply("cell 2.7 voltage_mV random 2700..2800"));
  const double drawn_mV = stage.simulator.world().sensed_mV(18);
  CHECK(drawn_mV >= 2700.0);
  CHECK(drawn_mV <= 2800.0);
}

// --- cost -----------------------------------------------------------------------------------------------------------

TEST_CASE("a script that asks allocates nothing while everything holds", "[scenario][script]") {
  const auto stage = std::make_unique<Stage>(
      "0 never contactor charge closed\n0 always pack cell_voltage_min_mV > 3000 for 2\nrepeat 20\n"
      "+0.05 cell 2.7 voltage_mV random 3500..3600\nwait frame PDU_STATUS vehicle_on = 0 within 1\n"
      "expect cell 2.7 voltage_mV < 3601\nend");
  const std::uint64_t before = allocation_count();
  while (stage->simulator.now() < power_up + 4s) {
    (void)stage->simulator.advance(stage->simulator.now() + 1ms);
  }
  CHECK(allocation_count() == before);
  CHECK(stage->simulator.script().outcomes().size() == 41);
}

// --- with the core ---------------------------------------------------------------------------------------------------

std::string file_text(const std::string& name) {
  std::ifstream stream(test::in_source(name), std::ios::binary);
  REQUIRE(stream);
  std::ostringstream bytes;
  bytes << stream.rdbuf();
  return bytes.str();
}

CoreConfig demo_pack() {
  const auto pack = load_pack_config(test::in_source("config/packs/demo-48s.json"));
  REQUIRE(pack.has_value());
  return pack->core;
}

ScriptVerdict verdict_beside(const CoreConfig& core, const std::string& script, std::uint64_t seed = 1) {
  SimulatorConfig config = simulator_config(core);
  config.seed = seed;
  VirtualRun run(core, config, parsed(script));
  while (!run.simulator().script().is_over()) run.step();
  const ScriptVerdict verdict = run.simulator().script().conclude(run.now());
  UNSCOPED_INFO(run.simulator().script().failure());
  return verdict;
}

ScriptVerdict verdict_beside_core(const std::string& script, std::uint64_t seed = 1) {
  return verdict_beside(demo_pack(), script, seed);
}

/// The same with a pack that bleeds whenever it is at rest.
ScriptVerdict verdict_of_balancing(const std::string& script) {
  CoreConfig core = demo_pack();
  core.balancing.is_enabled = true;
  core.balancing.method = BalancingMethod::ocv;
  core.balancing.settle = 2s;
  return verdict_beside(core, script);
}

TEST_CASE("what the script tells the master is told as an operator's command", "[scenario][script]") {
  const std::string stops =
      "2 vehicle on\nwait contactor main_positive closed within 3\n+1 estop 1 pressed\n"
      "wait master phase = open within 0.3\n+1 estop 1 released\n+11 vehicle off\n";
  const std::string again = "+0.5 vehicle on\nwait contactor main_positive closed within 3\npass";
  CHECK(verdict_beside_core(stops + "+1 master clear\n" + again) == ScriptVerdict::passed);
  CHECK(verdict_beside_core(stops + again) == ScriptVerdict::failed);  // it was not cleared
}

TEST_CASE("with authority the script accepts another module", "[scenario][script]") {
  const std::string exchanged =
      "1 module 2 silent\n20 module 2 restart\n+0 module 2 serial_number 5555\n"
      "+0 module 2 talking\n+20 master clear_authorised\n";
  const std::string closes = "+1 vehicle on\nwait contactor main_positive closed within 3\npass";
  CHECK(verdict_beside_core(exchanged + closes) == ScriptVerdict::failed);
  CHECK(verdict_beside_core(exchanged + "+0.1 master accept_modules\n" + closes) == ScriptVerdict::passed);
}

TEST_CASE("the script switches balancing off and on", "[scenario][script]") {
  const std::string bleeds =
      "0 pack soc_permille 300\n0 cell 2.3 soc_permille 500\n2 vehicle on\n"
      "wait cell 2.3 balancing within 60\n";
  const std::string off = "+1 master balancing off\n+3 expect cell 2.3 voltage_mV > 0\n";
  CHECK(verdict_of_balancing(bleeds + "+4 always cell 2.3 balancing for 10") == ScriptVerdict::passed);
  CHECK(verdict_of_balancing(bleeds + off + "+0 never cell 2.3 balancing for 10") == ScriptVerdict::passed);
  CHECK(verdict_of_balancing(bleeds + off + "+0 master balancing on\nwait cell 2.3 balancing within 60") ==
        ScriptVerdict::passed);
}

TEST_CASE("the examples of docs/scenarios.md that claim a result have it", "[scenario][script][meta]") {
  const std::string page = file_text("docs/scenarios.md");
  std::size_t examples = 0;
  for (const auto& [fence, verdict] : {std::pair<std::string, ScriptVerdict>{"```scn run\n", ScriptVerdict::passed},
                                       {"```scn fails\n", ScriptVerdict::failed}}) {
    for (std::size_t at = page.find(fence); at != std::string::npos; at = page.find(fence, at)) {
      at += fence.size();
      const std::string example = page.substr(at, page.find("```", at) - at);
      INFO(example);
      CHECK(verdict_beside_core(example) == verdict);
      ++examples;
    }
  }
  CHECK(examples >= 4);
}

TEST_CASE("an emergency stop opens in time at whatever moment a seed chooses", "[scenario][script][property]") {
  const std::string script = file_text("vcan-fixtures/emergency_stop.scn");
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    INFO("seed " << seed);
    CHECK(verdict_beside_core(script, seed) == ScriptVerdict::passed);
  }
}

}  // namespace
}  // namespace bmu

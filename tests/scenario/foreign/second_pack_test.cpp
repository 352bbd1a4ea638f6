// The emulated master of a second pack, as received by the real core: in every dialect, and when it falls silent.
#include "daemon/core/measurement/second_pack.hpp"

#include <string>
#include <vector>

#include "tests/support/catch.hpp"
#include "tests/support/patched_pack.hpp"
#include "tests/support/sim_run.hpp"

using namespace bmu;

namespace {

CoreConfig pack_in(const std::string& dialect) {
  return test::patched_pack(R"({"second_pack": {"base_id": "640", "dialect": ")" + dialect + "\"}}");
}

const SecondPack::Values& heard(const test::SimRun& run) {
  return run.core().second_pack().values();
}

Scenario script(std::string_view text) {
  auto scenario = parse_scenario(text, core_vocabulary());
  if (!scenario) FAIL(to_text(scenario.error().front(), "test"));
  return *scenario;
}

bool is_warned_of(const test::SimRun& run) {
  return run.core().faults().state(FaultId::second_pack_silent).is_present();
}

}  // namespace

TEST_CASE("what an emulated second pack is to tell, the core hears in every dialect",
          "[scenario][second_pack][BMS_F.8]") {
  const std::string dialect = GENERATE("iha", "original", "elithion");
  CAPTURE(dialect);
  test::SimRun run(pack_in(dialect));
  for (const char* event :
       {"second_pack soc_permille 720", "second_pack voltage_mV 172800", "second_pack current_A -32",
        "second_pack temperature_dC 180", "second_pack state charging"}) {
    run.apply(event);
  }
  run.run_to(3.0);
  const SecondPack::Values& values = heard(run);
  CHECK(std::string(values.name.begin(), values.name.end()) == "SECOND  ");
  CHECK(values.soc_permille.value == 720);
  CHECK(values.pack_voltage_mV.value == 173'000);        // whole volts
  CHECK(values.cell_voltage_min_uV.value == 3'600'000);  // of 48 cells, like those of this pack
  CHECK(values.cell_voltage_max_uV.value == 3'600'000);
  CHECK(values.current_mA.value == -32'000);
  CHECK(values.cell_temperature_min_dC.value == 180);
  CHECK(values.cell_temperature_max_dC.value == 180);
  CHECK_FALSE(values.soh_permille.is_valid());
  CHECK_FALSE(values.charge_limit_mA.is_valid());
  CHECK(run.core().second_pack().frames_refused() == 0);
  run.apply("second_pack soc_permille auto");
  run.apply("second_pack state open");
  run.run_to(5.0);
  CHECK_FALSE(values.soc_permille.is_valid());
  CHECK(values.charge_limit_mA.is_valid());
  CHECK(values.charge_limit_mA.value == 0);
}

TEST_CASE("a state of an emulated second pack is a number or bits, as its dialect has it", "[scenario][second_pack]") {
  struct Row {
    const char* state;
    int iha;
    int original;
    int elithion;  // .0 fault, .1 main positive, .3 main negative
  };
  const Row row = GENERATE(Row{"fault", 0, 2, 0x01}, Row{"open", 4, 0, 0x00}, Row{"closed", 3, 0, 0x0A},
                           Row{"driving", 2, 4, 0x0A}, Row{"charging", 1, 10, 0x0A});
  CAPTURE(row.state);
  for (const auto& [dialect, state] :
       {std::pair{"iha", row.iha}, std::pair{"original", row.original}, std::pair{"elithion", row.elithion}}) {
    CAPTURE(dialect);
    test::SimRun run(pack_in(dialect));
    run.apply("second_pack state " + std::string(row.state));
    run.run_to(2.0);
    REQUIRE(heard(run).state.is_valid());
    CHECK(heard(run).state.value == state);
  }
}

TEST_CASE("as long as nobody says otherwise a second pack's voltage is that of its cells at rest",
          "[scenario][second_pack]") {
  test::SimRun run(pack_in("iha"));
  run.apply("second_pack soc_permille 100");
  run.run_to(2.0);
  const std::int32_t low_mV = heard(run).pack_voltage_mV.value;
  run.apply("second_pack soc_permille 900");
  run.run_to(4.0);
  CHECK(heard(run).pack_voltage_mV.value > low_mV + 10'000);
  run.apply("second_pack voltage_mV 150000");
  run.run_to(6.0);
  CHECK(heard(run).pack_voltage_mV.value == 150'000);
  run.apply("second_pack voltage_mV auto");
  run.run_to(8.0);
  CHECK(heard(run).pack_voltage_mV.value > low_mV + 10'000);
}

TEST_CASE("an emulated second pack talks as often as our own master does", "[scenario][second_pack]") {
  Simulator simulator(simulator_config(pack_in("iha")), {}, test::SimRun::start);
  std::vector<SentFrame> sent;
  while (simulator.now() < test::SimRun::start + 3s) {
    simulator.advance(simulator.now() + 1ms);
    for (const SentFrame& one : simulator.sent_by_second_pack()) sent.push_back(one);
  }
  REQUIRE(sent.size() == 19);  // two rounds, and the first of the third
  for (std::size_t index = 0; index < sent.size(); ++index) {
    CAPTURE(index);
    CHECK(sent[index].frame.id == 0x640 + index % 9);
    CHECK(sent[index].at == test::SimRun::start + 1s * (1 + index / 9) + 10ms * (index % 9));
  }
}

TEST_CASE("a second pack's charge goes out as SOC2, its silence as unknown, and nothing opens for it",
          "[scenario][second_pack][BMS_F.8]") {
  test::SimRun run(pack_in("elithion"), script("0  second_pack soc_permille 405..604 over 0.5\n"
                                               "2  vehicle on\n"
                                               "wait contactor main_positive closed within 5\n"
                                               "wait frame PACK_CHARGE soc_2_permille = 600 within 2\n"
                                               "wait frame 0x646 within 1.1\n"
                                               "+0 always contactor main_positive closed for 20\n"
                                               "+1 second_pack silent\n"
                                               "+0 never frame 0x646 for 10\n"
                                               "wait frame PACK_CHARGE soc_2_permille = not_known within 5\n"
                                               "+0 never frame PACK_CHARGE soc_2_permille = 0 for 5\n"
                                               "+9 expect master opened_by = none\n"
                                               "+0 second_pack talking\n"
                                               "wait frame PACK_CHARGE soc_2_permille = 600 within 3\n"
                                               "pass\n"));
  bool has_warned = false;
  while (run.simulator().script().verdict() == ScriptVerdict::open && run.seconds() < 60.0) {
    run.run_to(run.seconds() + 0.1);
    has_warned = has_warned || is_warned_of(run);
  }
  CAPTURE(run.simulator().script().failure());
  CHECK(run.simulator().script().verdict() == ScriptVerdict::passed);
  CHECK(has_warned);
  run.run_to(run.seconds() + 5.0);
  CHECK_FALSE(is_warned_of(run));
}

TEST_CASE("on a bus of its own a second pack may have our identifiers, and is not taken for somebody who sends ours",
          "[scenario][second_pack]") {
  test::SimRun run(test::patched_pack(R"({"second_pack": {"base_id": "620"},
                                          "buses": {"vehicle": "can1", "second_pack": "can2"}})"),
                   script("0 second_pack soc_permille 250\n"
                          "0 never frame PACK_CHARGE soc_permille = 250\n"  // that is the master's 626h
                          "wait frame PACK_CHARGE soc_2_permille = 250 within 5\n"));
  run.run_to(6.0);
  CAPTURE(run.simulator().script().failure());
  CHECK(run.simulator().script().outcomes().size() == 1);
  CHECK(run.simulator().script().verdict() != ScriptVerdict::failed);
  CHECK_FALSE(run.core().faults().state(FaultId::foreign_reporter).is_present());
}

TEST_CASE("a pack without a second one has no words for it", "[scenario][second_pack]") {
  Simulator simulator(simulator_config(test::patched_pack("{}")), {}, test::SimRun::start);
  const auto refused = simulator.apply("second_pack soc_permille 500");
  REQUIRE_FALSE(refused);
  CHECK(refused.error().wanted.find("second_pack/base_id") != std::string::npos);
  simulator.advance(test::SimRun::start + 3s);
  CHECK(simulator.sent_by_second_pack().empty());
}

// A module without its external supply: its CAN side has no power, so it neither receives nor sends, and the master
// reports it as lost. If its cells feed its CAN side, too, the loss of its supply opens the pack half a second later.
#include <string>
#include <string_view>

#include "config/pack_config.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/folders.hpp"
#include "tests/support/mmu_bench.hpp"
#include "tests/support/sim_run.hpp"

namespace bmu {
namespace {

using test::SimRun;

constexpr double closed_by_s = 5.0;

CoreConfig demo_pack() {
  const auto pack = load_pack_config(test::in_source("config/packs/demo-48s.json"));
  REQUIRE(pack);
  return pack->core;
}

SimRun closed_run(std::string_view before = "") {
  SimRun run(demo_pack(), *parse_scenario("0 pack soc_permille 800\n1.5 vehicle on\n" + std::string(before)));
  run.run_to(closed_by_s);
  REQUIRE(run.core().sequence().phase == Phase::closed);
  return run;
}

TEST_CASE("a module on its own supply sends nothing and receives nothing", "[scenario][mmu][MMU_7b]") {
  Simulator simulator(simulator_config(demo_pack()), *parse_scenario(""), test::power_up);
  std::uint8_t counter = 0;
  const auto answers_of = [&](std::uint8_t node, Duration duration) {
    std::size_t frames = 0;
    for (const TimePoint end = simulator.now() + duration; simulator.now() < end;) {
      simulator.observe(test::poll_frame(0, test::want_all, ++counter), simulator.now());
      for (const SentFrame& sent : simulator.advance(simulator.now() + 100ms)) {
        const MessageMatch match = internal_bus::catalogue.find(sent.frame.id);
        if (match.message != nullptr && match.message->sender == Sender::mmu && match.node == node) ++frames;
      }
    }
    return frames;
  };
  REQUIRE(answers_of(2, 1s) > 0);
  REQUIRE(simulator.apply("module 2 external_supply_mV 0"));
  static_cast<void>(answers_of(2, 100ms));  // answers in progress
  CHECK(answers_of(2, 900ms) == 0);
  CHECK(answers_of(1, 100ms) > 0);
  const std::uint64_t answered = simulator.mmu(1).counts().polls_answered;
  CHECK(answers_of(2, 2s) == 0);
  CHECK(simulator.mmu(1).counts().polls_answered == answered);  // it received none
  CHECK(simulator.mmu(1).mode() == UnitMode::asleep);           // polls are sent, and it receives none
  REQUIRE(simulator.apply("module 2 external_supply_mV 12000"));
  static_cast<void>(answers_of(2, 500ms));
  CHECK(answers_of(2, 1s) > 0);
}

TEST_CASE("a module whose cells feed its CAN side goes on answering", "[scenario][mmu][MMU_7b][MMU_8]") {
  Simulator simulator(simulator_config(demo_pack()), *parse_scenario("0 module 2 talks_on_own_supply on"),
                      test::power_up);
  simulator.advance(simulator.now() + 1s);
  REQUIRE(simulator.apply("module 2 external_supply_mV 0"));
  std::uint8_t counter = 0;
  bool is_reported = false;
  for (int poll = 0; poll < 20; ++poll) {
    simulator.observe(test::poll_frame(2, test::want_status, ++counter), simulator.now());
    for (const SentFrame& sent : simulator.advance(simulator.now() + 100ms)) {
      if (sent.frame.id == 0x102) is_reported = read_raw<internal_bus::status, "supply">(sent.frame) == 1;
    }
  }
  CHECK(is_reported);
}

TEST_CASE("the loss of a module's external supply opens the pack as the loss of the module", "[scenario][MMU_7b]") {
  SimRun run = closed_run();
  run.apply("module 2 external_supply_mV 0");
  run.run_to(closed_by_s + 0.45);
  CHECK(run.core().sequence().phase == Phase::open);
  CHECK(run.core().last_opening().fault == FaultId::module_lost);
  CHECK(run.core().faults().state(FaultId::module_lost).confirmed.element.module_node == 2);
  CHECK(row_of(FaultId::module_lost).remedy.find("external supply") != std::string_view::npos);
}

TEST_CASE("a module that reports that its cells feed it opens the pack after half a second", "[scenario][MMU_7b]") {
  SimRun run = closed_run("0 module 2 talks_on_own_supply on");
  run.apply("module 2 external_supply_mV 0");
  run.run_to(closed_by_s + 0.5);
  CHECK(run.core().sequence().phase == Phase::closed);
  run.run_to(closed_by_s + 0.8);
  CHECK(run.core().sequence().phase == Phase::open);
  CHECK(run.core().last_opening().fault == FaultId::module_supply_lost);
  CHECK(run.core().faults().state(FaultId::module_supply_lost).confirmed.element.module_node == 2);

  run.apply("module 2 external_supply_mV 12000");
  run.run_to(run.seconds() + 3.0);
  CHECK(run.core().faults().state(FaultId::module_supply_lost).is_present());  // until it is cleared
  run.give(Command::clear_faults);
  run.run_to(run.seconds() + 1.0);
  CHECK_FALSE(run.core().faults().state(FaultId::module_supply_lost).is_present());
}

TEST_CASE("a pack with a module that its cells feed is never closed", "[scenario][MMU_7b]") {
  SimRun run(demo_pack(), *parse_scenario("0 module 2 talks_on_own_supply on\n0 module 2 external_supply_mV 0\n"
                                          "0 pack soc_permille 800\n2.5 vehicle on"));
  for (double at_s = 0.1; at_s < 10.0; at_s += 0.1) {
    run.run_to(at_s);
    REQUIRE(run.core().sequence().phase == Phase::open);
  }
  CHECK(run.core().faults().state(FaultId::module_supply_lost).is_present());
}

TEST_CASE("a supply that fails for 200 ms rides through", "[scenario][MMU_7b][MMU_11]") {
  SimRun run = closed_run("0 module 2 talks_on_own_supply on");
  run.apply("module 2 external_supply_mV 0");
  run.run_to(closed_by_s + 0.2);
  run.apply("module 2 external_supply_mV 12000");
  run.run_to(closed_by_s + 5.0);
  CHECK(run.core().sequence().phase == Phase::closed);
}

}  // namespace
}  // namespace bmu

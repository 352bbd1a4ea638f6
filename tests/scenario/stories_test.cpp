// The stories that tools/demo shows: each with the pack that it names, with the core in virtual time. They happen as
// described.
#include <cmath>
#include <fstream>
#include <string>

#include "config/pack_config.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/folders.hpp"
#include "tests/support/sim_run.hpp"

using namespace bmu;

namespace {

const std::string root = test::in_source("");

struct Story {
  CoreConfig pack;
  Scenario script;
  double seconds = 0.0;  // duration
};

Story story(const std::string& name) {
  std::ifstream stream(root + "vcan-fixtures/" + name + ".scn");
  REQUIRE(stream);
  Story told;
  std::string text;
  for (std::string line; std::getline(stream, line); text += line + "\n") {
    const auto value_after = [&line](const std::string& start) {
      return line.rfind(start, 0) == 0 ? line.substr(start.size()) : std::string();
    };
    if (const std::string seconds = value_after("# seconds: "); !seconds.empty()) told.seconds = std::stod(seconds);
    const std::string pack_file = value_after("# pack: ");
    if (pack_file.empty()) continue;
    const auto pack = load_pack_config(root + pack_file);
    REQUIRE(pack);
    told.pack = pack->core;
  }
  REQUIRE_FALSE(told.pack.modules.empty());
  const auto script = parse_scenario(text);
  REQUIRE(script);
  CHECK(check_against(*script, simulator_config(told.pack)).empty());
  told.script = *script;
  return told;
}

bool is_closed(const test::SimRun& run) {
  return run.core().sequence().phase == Phase::closed;
}
bool is_open(const test::SimRun& run) {
  return run.core().sequence().phase == Phase::open;
}
std::int32_t current_mA(const test::SimRun& run) {
  return run.core().pack().current_mA.value;
}
FaultId opened_by(const test::SimRun& run) {
  REQUIRE(run.core().last_opening().cause == OpeningCause::fault);
  return run.core().last_opening().fault;
}

}  // namespace

TEST_CASE("the story of a charge: plugged in, a power cut, charged on, and a cell that is full before the others",
          "[scenario][story][charge]") {
  const Story told = story("charge-from-the-wall");
  test::SimRun run(told.pack, told.script);
  run.run_to(14.0);
  CHECK(is_closed(run));
  CHECK(run.core().charge_control().stage() == ChargeStage::charging);
  CHECK(current_mA(run) < -1'000);
  run.run_to(19.0);
  CHECK(is_open(run));
  CHECK(opened_by(run) == FaultId::charger_silent);
  run.run_to(22.0);
  CHECK(is_open(run));
  run.run_to(36.0);
  CHECK(is_closed(run));
  CHECK(current_mA(run) < -1'000);
  run.run_to(told.seconds - 3.0);
  CHECK(is_closed(run));
  CHECK(run.core().charge_control().stage() == ChargeStage::balancing);
  CHECK(std::abs(current_mA(run)) < 200);
  CHECK(run.simulator().plant().cell(18).balancing_siemens > 0.0);  // cell 2.7
}

TEST_CASE("the story of a salvage pack: one number that cannot be opens nothing, a module that is lost does",
          "[scenario][story][foreign]") {
  const Story told = story("salvage-pack");
  test::SimRun run(told.pack, told.script);
  run.run_to(9.9);
  CHECK(is_closed(run));
  const std::uint64_t out_of_range = run.core().modules().find(3)->values_out_of_range;
  run.run_to(13.9);
  CHECK(is_closed(run));
  CHECK(run.core().modules().find(3)->values_out_of_range > out_of_range);
  run.run_to(15.0);
  CHECK(is_open(run));
  CHECK(opened_by(run) == FaultId::module_lost);
  run.run_to(told.seconds);
  CHECK(is_open(run));
  CHECK(run.core().last_opening().fault == FaultId::module_lost);
}

TEST_CASE("the story of storage in a house: it charges and gives as the inverter may, and opens when that is not heard",
          "[scenario][story][inverter]") {
  const Story told = story("stationary");
  test::SimRun run(told.pack, told.script);
  run.run_to(14.0);
  CHECK(is_closed(run));
  CHECK(current_mA(run) < -38'000);
  run.run_to(21.5);
  CHECK(current_mA(run) > 58'000);
  run.run_to(27.9);
  CHECK(current_mA(run) > 90'000);
  CHECK(current_mA(run) <= run.core().limits().discharge.limit_mA + 500);
  CHECK(is_closed(run));
  run.run_to(36.0);
  CHECK(is_open(run));
  CHECK(opened_by(run) == FaultId::inverter_lost);
  run.run_to(told.seconds);
  CHECK(is_open(run));
}

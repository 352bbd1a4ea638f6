// The shipped pack with modules that must report the faults of their front ends: each of the bits alone opens it, with
// all voltages and temperatures normal, and a pack with a module that cannot report them is never closed.
#include <string>
#include <string_view>

#include "config/pack_config.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/folders.hpp"
#include "tests/support/sim_run.hpp"

namespace bmu {
namespace {

using test::SimRun;

CoreConfig shipped_pack(const std::string& name) {
  const auto pack = load_pack_config(test::in_source("config/packs/" + name + ".json"));
  REQUIRE(pack);
  return pack->core;
}

constexpr double closed_by_s = 5.0;
constexpr double opened_within_s = 0.5;

SimRun closed_run(const std::string& name) {
  SimRun run(shipped_pack(name), *parse_scenario("0 pack soc_permille 800\n1.5 vehicle on"));
  run.run_to(closed_by_s);
  REQUIRE(run.core().sequence().phase == Phase::closed);
  return run;
}

constexpr double charged_by_s = 10.0;

/// shell-eco-6s, charged with 5 A.
SimRun charged_run() {
  SimRun run(shipped_pack("shell-eco-6s"),
             *parse_scenario("0 pack soc_permille 600\n0 charger current_A 5\n1.5 charger connected"));
  run.run_to(charged_by_s);
  REQUIRE(run.core().sequence().phase == Phase::closed);
  REQUIRE(run.simulator().plant().current_A() == Approx(-5.0).margin(0.1));
  return run;
}

/// The contacts really are open, by this fault.
void check_opened_by(const SimRun& run, FaultId fault) {
  CHECK(run.core().sequence().phase == Phase::open);
  CHECK(run.core().last_opening().fault == fault);
  CHECK_FALSE(run.simulator().pdu().outputs().contactors[0]);
  CHECK(run.core().faults().state(fault).confirmed.element.module_node == 1);
}

/// The pack does not close again by itself: the front end has recovered, but the module keeps the fault until it is
/// cleared.
void check_way_back(SimRun& run, std::string_view ends, FaultId fault) {
  run.apply(ends);
  run.run_to(run.seconds() + 3.0);
  CHECK(run.core().faults().state(fault).is_present());
  run.give(Command::clear_faults);
  run.run_to(run.seconds() + 3.0);
  CHECK_FALSE(run.core().faults().state(fault).is_present());
  run.apply("vehicle off");
  run.run_to(run.seconds() + 1.0);
  run.apply("vehicle on");
  run.run_to(run.seconds() + 5.0);
  CHECK(run.core().sequence().phase == Phase::closed);
}

TEST_CASE("shell-eco-6s opens for the undervoltage flag of each of its cells", "[scenario][RR_7]") {
  for (int cell = 1; cell <= 6; ++cell) {
    CAPTURE(cell);
    SimRun run = closed_run("shell-eco-6s");
    run.apply("cell 1." + std::to_string(cell) + " undervoltage_flag on");
    run.run_to(closed_by_s + opened_within_s);
    check_opened_by(run, FaultId::module_reports_undervoltage);
    CHECK(run.core().modules().find(1)->status.value.undervoltage_cells == 1U << (cell - 1));
  }
}

TEST_CASE("shell-eco-6s that is charged stays closed for the undervoltage flag of a cell, and reports it",
          "[scenario][RR_7][BMS_F.10]") {
  SimRun run = charged_run();
  run.apply("cell 1.3 undervoltage_flag on");
  for (double at_s = charged_by_s; at_s < charged_by_s + 10.0; at_s += 0.1) {
    run.run_to(at_s);
    REQUIRE(run.core().sequence().phase == Phase::closed);
  }
  CHECK(run.core().faults().state(FaultId::module_reports_undervoltage).is_present());
  CHECK(run.core().faults().state(FaultId::module_reports_undervoltage).confirmed.element.module_node == 1);
  CHECK(run.simulator().plant().current_A() < -4.0);
}

TEST_CASE("shell-eco-6s opens when a front end reports undervoltage of its own supply", "[scenario][RR_7]") {
  SimRun run = closed_run("shell-eco-6s");
  run.apply("module 1 front_end_supply_low on");
  run.run_to(closed_by_s + opened_within_s);
  check_opened_by(run, FaultId::front_end_supply_low);
  check_way_back(run, "module 1 front_end_supply_low off", FaultId::front_end_supply_low);
}

TEST_CASE("shell-eco-6s opens when a front end reports its thermal shutdown", "[scenario][RR_7]") {
  SimRun run = closed_run("shell-eco-6s");
  run.apply("module 1 front_end_thermal_shutdown on");
  run.run_to(closed_by_s + opened_within_s);
  check_opened_by(run, FaultId::front_end_overtemperature);
  check_way_back(run, "module 1 front_end_thermal_shutdown off", FaultId::front_end_overtemperature);
}

TEST_CASE("a front end's fault opens shell-eco-6s while it is charged", "[scenario][RR_7]") {
  const auto [property, fault] =
      GENERATE(table<std::string, FaultId>({{"front_end_supply_low", FaultId::front_end_supply_low},
                                            {"front_end_thermal_shutdown", FaultId::front_end_overtemperature}}));
  CAPTURE(property);
  SimRun run = charged_run();
  const double at_s = run.seconds();
  run.apply("module 1 " + property + " on");
  run.run_to(at_s + opened_within_s);
  check_opened_by(run, fault);
}

TEST_CASE("a front end's fault of a few milliseconds between two polls opens shell-eco-6s", "[scenario][RR_7]") {
  SimRun run = closed_run("shell-eco-6s");
  run.apply("module 1 front_end_supply_low on");
  run.run_to(closed_by_s + 0.02);
  run.apply("module 1 front_end_supply_low off");
  run.run_to(closed_by_s + opened_within_s);
  check_opened_by(run, FaultId::front_end_supply_low);
}

TEST_CASE("a module that does not report its front end's faults never closes shell-eco-6s", "[scenario][RR_7]") {
  SimRun run(shipped_pack("shell-eco-6s"),
             *parse_scenario("0 module 1 front_end_faults not_reported\n0 pack soc_permille 800\n1.5 vehicle on\n"
                             "6 vehicle off\n8 vehicle on"));
  for (double at_s = 0.1; at_s < 15.0; at_s += 0.1) {
    run.run_to(at_s);
    REQUIRE(run.core().sequence().phase == Phase::open);
  }
  CHECK(run.core().faults().state(FaultId::front_end_faults_missing).is_present());
}

TEST_CASE("a module that stops reporting its front end's faults opens shell-eco-6s", "[scenario][RR_7]") {
  SimRun run = closed_run("shell-eco-6s");
  run.apply("module 1 front_end_faults not_reported");
  run.run_to(closed_by_s + opened_within_s);
  check_opened_by(run, FaultId::front_end_faults_missing);
}

TEST_CASE("a pack whose file does not require the report closes with a module that has none", "[scenario][RR_7]") {
  SimRun run(shipped_pack("lipo-6s-24v"), *parse_scenario("0 module 1 front_end_faults not_reported\n"
                                                          "0 pack soc_permille 800\n1.5 vehicle on"));
  run.run_to(closed_by_s);
  CHECK(run.core().sequence().phase == Phase::closed);
  CHECK_FALSE(run.core().faults().state(FaultId::front_end_faults_missing).is_present());
}

TEST_CASE("a front end's fault that is reported opens a pack whose file does not require the report",
          "[scenario][RR_7]") {
  SimRun run = closed_run("lipo-6s-24v");
  run.apply("module 1 front_end_thermal_shutdown on");
  run.run_to(closed_by_s + opened_within_s);
  check_opened_by(run, FaultId::front_end_overtemperature);
}

}  // namespace
}  // namespace bmu

// Troubles that chargers report, and which of them stay: a Brusa latches its errors until a command clears them, or its
// supply has been off.
#include <string>

#include "tests/support/catch.hpp"
#include "tests/support/patched_pack.hpp"
#include "tools/common/virtual_run.hpp"

using namespace bmu;

namespace {

struct Wall {
  CoreConfig config;
  VirtualRun run;

  explicit Wall(const std::string& protocol) : config(pack_with(protocol)), run(config, simulator_config(config), {}) {}

  static CoreConfig pack_with(const std::string& protocol) {
    return test::patched_pack(R"({"contactors": {"precharge_overcurrent_mA": 6000, "precharge_energy_J": 5000},
      "charger": {"current_max_mA": 8000, "protocol": ")" +
                              protocol + "\"}}");
  }
  void run_for(Duration span) {
    for (const TimePoint end = run.now() + span; run.now() < end;) run.step();
  }
  void apply(const char* event) { REQUIRE(run.simulator().apply(event)); }
  void plug_in() {
    run_for(3s);
    apply("charger current_A 20");
    apply("charger connected");
    run_for(20s);
    REQUIRE(run.core().sequence().phase == Phase::closed);
  }
  [[nodiscard]] bool flows() const { return run.simulator().plant().charger_A() > 7.5; }
  [[nodiscard]] std::uint16_t reported() const { return run.core().chargers().unit(0).report.troubles; }
  [[nodiscard]] bool is_warned_of() const { return run.core().faults().state(FaultId::charger_trouble).is_present(); }
};

constexpr std::uint16_t no_command = bit_of(ChargerTrouble::no_command);

}  // namespace

TEST_CASE("a trouble of a charger is warned of for as long as it reports it, and nothing opens", "[scenario][charge]") {
  struct Row {
    const char* protocol;
    const char* event;
    ChargerTrouble trouble;
    bool flows;
  };
  const auto row =
      GENERATE(Row{"elcon_tc", "charger trouble hardware", ChargerTrouble::hardware, false},
               Row{"elcon_tc", "charger trouble too_hot", ChargerTrouble::too_hot, false},
               Row{"elcon_tc", "charger trouble mains", ChargerTrouble::mains, false},
               Row{"elcon_tc", "charger trouble no_battery", ChargerTrouble::no_battery, false},
               Row{"elcon_tc", "charger trouble no_command", ChargerTrouble::no_command, false},
               Row{"brusa_nlg5", "charger trouble too_hot", ChargerTrouble::too_hot, true},
               Row{"brusa_nlg5", "charger trouble no_mains", ChargerTrouble::no_mains, true},
               Row{"brusa_nlg5", "charger trouble no_battery", ChargerTrouble::no_battery, true},
               Row{"brusa_nlg5", "charger trouble command_refused", ChargerTrouble::command_refused, true});
  CAPTURE(row.protocol, row.event);
  Wall wall(row.protocol);
  wall.plug_in();
  CHECK(wall.flows());
  wall.apply(row.event);
  wall.run_for(10s);
  CHECK(wall.reported() == bit_of(row.trouble));
  CHECK(wall.is_warned_of());
  CHECK(wall.flows() == row.flows);
  CHECK(wall.run.core().sequence().phase == Phase::closed);
  wall.apply("charger trouble none");
  wall.run_for(20s);
  CHECK(wall.reported() == 0);
  CHECK_FALSE(wall.is_warned_of());
  CHECK(wall.flows());
}

TEST_CASE("what a Brusa has latched while nobody commanded it stays until it is plugged in, and is cleared then",
          "[scenario][charge]") {
  Wall wall("brusa_nlg5");
  wall.run_for(3s);
  CHECK(wall.reported() == 0);
  wall.run.stop();
  wall.run_for(600ms);
  wall.run.go_on();
  wall.run_for(30s);
  CHECK(wall.reported() == no_command);  // commanded again since, without a command to clear it
  wall.plug_in();
  CHECK(wall.reported() == 0);
  CHECK(wall.flows());
  CHECK_FALSE(wall.is_warned_of());
}

TEST_CASE("an error of a Brusa that a command clears ends when its cause does, one that takes its supply then only",
          "[scenario][charge]") {
  struct Row {
    const char* event;
    ChargerTrouble trouble;
    bool is_cleared;
  };
  const auto row = GENERATE(Row{"charger trouble battery", ChargerTrouble::battery, true},
                            Row{"charger trouble mains", ChargerTrouble::mains, true},
                            Row{"charger trouble unnamed", ChargerTrouble::unnamed, true},
                            Row{"charger trouble no_command", ChargerTrouble::no_command, true},
                            Row{"charger trouble hardware", ChargerTrouble::hardware, false},
                            Row{"charger trouble output_overvoltage", ChargerTrouble::output_overvoltage, false});
  CAPTURE(row.event);
  Wall wall("brusa_nlg5");
  wall.plug_in();
  REQUIRE(wall.flows());
  wall.apply(row.event);
  wall.run_for(5s);
  CHECK(wall.reported() == bit_of(row.trouble));
  CHECK(wall.is_warned_of());
  CHECK_FALSE(wall.flows());
  wall.apply("charger trouble none");
  wall.run_for(40s);
  CHECK(wall.reported() == (row.is_cleared ? 0 : bit_of(row.trouble)));
  CHECK(wall.is_warned_of() != row.is_cleared);
  CHECK(wall.flows() == row.is_cleared);
  if (row.is_cleared) return;
  wall.apply("charger mains off");
  wall.run_for(5s);
  wall.apply("charger mains on");
  wall.run_for(40s);
  CHECK(wall.reported() == 0);
  CHECK_FALSE(wall.is_warned_of());
  CHECK(wall.flows());
}

TEST_CASE("a cause that outlasts all tries to clear it leaves the error to the next plugging in",
          "[scenario][charge]") {
  Wall wall("brusa_nlg5");
  wall.plug_in();
  wall.apply("charger trouble battery");
  wall.run_for(30s);
  wall.apply("charger trouble none");
  wall.run_for(30s);
  CHECK(wall.reported() == bit_of(ChargerTrouble::battery));
  CHECK_FALSE(wall.flows());
  wall.apply("charger disconnected");
  wall.run_for(3s);
  wall.plug_in();
  CHECK(wall.reported() == 0);
  CHECK(wall.flows());
}

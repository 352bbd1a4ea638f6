// Readings of the fault rows of chargers and of the second pack, with and without either.
#include "daemon/core/faults/fault_memory.hpp"
#include "daemon/core/faults/fault_readers.hpp"
#include "daemon/core/measurement/charger_table.hpp"
#include "daemon/core/plausibility/bus_watch.hpp"
#include "daemon/core/plausibility/charger_watch.hpp"
#include "devices/device_list.hpp"
#include "tests/support/catch.hpp"

using namespace bmu;

namespace {

constexpr TimePoint now{100s};

struct Seen {
  PackState pack;
  ChargerTable table;
  ChargerWatch watch;
  SecondPack second_pack;
  FaultInputs in{.now = now, .pack = &pack, .second_pack = &second_pack, .chargers = &table, .charger_watch = &watch};

  Seen() { table.init({.driver = find_device("elcon_tc")->charger}); }
  void hear(const CanFrame& frame, TimePoint at) { REQUIRE(table.observe(frame, at)); }
  void hear(const ChargerReport& report) {
    for (const CanFrame& frame : table.driver().reports(0, report)) hear(frame, in.now);
  }
  void look(ChargerWatchInputs with) {
    with.now = in.now;
    with.pack = &pack;
    with.table = &table;
    watch.update(with);
  }
};

bool holds(const Reading& reading) {
  return reading.is_known && reading.value != 0;
}

}  // namespace

TEST_CASE("without chargers or a second pack their rows hold nothing", "[unit][faults][charger]") {
  PackState pack;
  const FaultInputs none{.now = now, .pack = &pack};
  for (Reading (*read)(const FaultInputs&) :
       {fault_readers::charger_silent, fault_readers::charger_runaway, fault_readers::charger_keeps_on,
        fault_readers::charger_trouble, fault_readers::charger_contradicts, fault_readers::foreign_charger_master,
        fault_readers::foreign_charger_commands, fault_readers::second_pack_silent}) {
    CHECK_FALSE(holds(read(none)));
    CHECK_FALSE(holds(read(Seen{}.in)));
  }
}

TEST_CASE("a pack that has no chargers has none in trouble", "[unit][faults][charger]") {
  Seen seen;
  seen.look({.is_plugged_in = true, .is_enabled = true, .asked_mA = 8'000});
  seen.in.now += 60s;
  seen.table.init({});  // whatever was requested before
  CHECK_FALSE(holds(fault_readers::charger_trouble(seen.in)));
}

TEST_CASE("a charger that runs away is believed after a quarter of a second and two samples",
          "[unit][faults][charger][F97]") {
  FaultMemory memory;
  const auto is_present_after = [&memory](Duration since) {
    FaultChanges changes;
    memory.judge(row_of(FaultId::charger_runaway), {true, 1, {}, now + since}, {}, now + since, changes);
    return memory.state(FaultId::charger_runaway).is_present();
  };
  CHECK_FALSE(is_present_after(0ms));
  CHECK_FALSE(is_present_after(100ms));
  CHECK_FALSE(is_present_after(249ms));
  CHECK(is_present_after(250ms));
}

TEST_CASE("a charger's trouble holds while it tells it", "[unit][faults][charger]") {
  Seen seen;
  seen.hear({.voltage_mV = known(300'000), .troubles = bit_of(ChargerTrouble::mains)});
  CHECK(holds(fault_readers::charger_trouble(seen.in)));
  CHECK(seen.table.troubles(now, false).unit == 1);
  seen.hear(ChargerReport{.voltage_mV = known(300'000)});
  CHECK_FALSE(holds(fault_readers::charger_trouble(seen.in)));
}

TEST_CASE("a charger without a battery is in trouble once it has been asked for as long as it may take to follow",
          "[unit][faults][charger]") {
  Seen seen;
  const auto is_in_trouble = [&seen](bool is_enabled) {
    seen.hear({.voltage_mV = known(0), .troubles = bit_of(ChargerTrouble::no_battery)});
    seen.look({.is_plugged_in = true, .is_enabled = is_enabled, .asked_mA = is_enabled ? 8'000 : 0});
    return holds(fault_readers::charger_trouble(seen.in));
  };
  const Duration settle = seen.table.driver().settle;
  CHECK_FALSE(is_in_trouble(false));
  seen.in.now += settle * 2;
  CHECK_FALSE(is_in_trouble(false));
  seen.in.now += 1s;
  CHECK_FALSE(is_in_trouble(true));
  seen.in.now += settle - 1ms;
  CHECK_FALSE(is_in_trouble(true));
  seen.in.now += 1ms;
  CHECK(is_in_trouble(true));
  seen.in.now += 10ms;
  CHECK_FALSE(is_in_trouble(false));  // commanded to stop
}

TEST_CASE("somebody else's command to a charger holds for a while", "[unit][faults][charger]") {
  Seen seen;
  seen.hear(seen.table.driver().command(0, {}), now);
  CHECK_FALSE(holds(fault_readers::foreign_charger_master(seen.in)));  // nothing is plugged in
  CHECK(holds(fault_readers::foreign_charger_commands(seen.in)));
  seen.look({.is_plugged_in = true});
  CHECK_FALSE(holds(fault_readers::foreign_charger_commands(seen.in)));
  CHECK(holds(fault_readers::foreign_charger_master(seen.in)));
  seen.in.now = now + BusWatch::reporter_memory;
  CHECK(holds(fault_readers::foreign_charger_master(seen.in)));
  seen.in.now += 1ns;
  CHECK_FALSE(holds(fault_readers::foreign_charger_master(seen.in)));
  seen.look({.is_plugged_in = false});
  CHECK_FALSE(holds(fault_readers::foreign_charger_commands(seen.in)));
}

TEST_CASE("silence, runaway, a charge after the stop and a contradiction are the watch's", "[unit][faults][charger]") {
  Seen seen;
  const auto pass = [&seen](Duration span, const ChargerWatchInputs& with, std::int32_t told_mA,
                            std::int32_t sensed_mA) {
    for (const TimePoint end = seen.in.now + span; seen.in.now < end; seen.in.now += 1s) {
      seen.hear({.voltage_mV = known(300'000), .current_mA = known(told_mA)});
      seen.pack.current_mA = {sensed_mA, seen.in.now, Validity::valid};
      seen.look(with);
    }
  };
  const ChargerWatchInputs charging{
      .is_plugged_in = true, .is_alone = true, .is_enabled = true, .asked_mA = 10'000, .asked_mV = 400'000};
  pass(20s, charging, 10'000, -10'000);
  CHECK_FALSE(holds(fault_readers::charger_runaway(seen.in)));
  CHECK_FALSE(holds(fault_readers::charger_contradicts(seen.in)));
  SECTION("runaway") {
    pass(2s, charging, 10'000, -15'000);
    CHECK(holds(fault_readers::charger_runaway(seen.in)));
  }
  SECTION("contradiction") {
    pass(2s, charging, 10'000, -1'000);
    CHECK(holds(fault_readers::charger_contradicts(seen.in)));
  }
  SECTION("after the stop") {
    ChargerWatchInputs stopped = charging;
    stopped.is_enabled = false;
    pass(10s, stopped, 10'000, -10'000);
    CHECK(holds(fault_readers::charger_keeps_on(seen.in)));
  }
  SECTION("silence, since its last word") {
    const TimePoint heard_at = seen.table.unit(0).values_at;
    seen.in.now += 10s;
    seen.look(charging);
    CHECK(holds(fault_readers::charger_silent(seen.in)));
    CHECK(fault_readers::charger_silent(seen.in).taken_at == heard_at);
    CHECK(heard_at != TimePoint{});
  }
}

TEST_CASE("silence of a unit that the pack does not have holds, and is of no time: a recorded core may name one",
          "[unit][faults][charger]") {
  Seen seen;
  ChargerTable two_units;
  two_units.init({.driver = find_device("elcon_tc")->charger, .unit_count = 2});
  const auto hear_from = [&seen, &two_units](std::uint8_t unit) {
    for (const CanFrame& frame : seen.table.driver().reports(unit, {.voltage_mV = known(300'000)})) {
      REQUIRE(two_units.observe(frame, seen.in.now));
    }
  };
  const auto look = [&seen, &two_units] {
    seen.watch.update(
        {.now = seen.in.now, .is_plugged_in = true, .is_enabled = true, .pack = &seen.pack, .table = &two_units});
  };
  hear_from(0);
  hear_from(1);
  look();
  seen.in.now += 10s;
  hear_from(0);
  look();
  REQUIRE(seen.watch.silent_unit() == 2);
  const Reading reading = fault_readers::charger_silent(seen.in);
  CHECK(holds(reading));
  CHECK(reading.taken_at == TimePoint{});
}

// Reading of each row of the fault table: which received value makes it true, its maximum age, and when it is unknown.
#include <array>
#include <set>
#include <utility>

#include "daemon/core/faults/fault_table.hpp"
#include "daemon/core/records/event.hpp"
#include "devices/device_list.hpp"
#include "protocol/tables/internal_bus.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/fault_world.hpp"

using namespace bmu;
using bmu::test::start;
using World = bmu::test::FaultWorld;

namespace {

void expect_only_if_started(World& world, FaultId id) {
  world.has_started = false;
  CHECK_FALSE(world.read(id).is_known);
  world.has_started = true;
  CHECK(world.read(id).is_known);
}

}  // namespace

TEST_CASE("in a world where all is well every row that is true or not knows so", "[unit][faults]") {
  const World world;
  for (const FaultRow& row : fault_table()) {
    if (row.has_limit()) continue;
    INFO(row.name);
    // Without any change a current cannot be distinguished from its opposite.
    CHECK(world.read(row.id).is_known == (row.id != FaultId::current_contradicts_voltage));
    CHECK(world.read(row.id).value == 0);
    CHECK_FALSE(world.read(row.id).is_partial);
    CHECK(world.read(row.id).element == Element{});
  }
}

TEST_CASE("a module is lost when any part of its answer is too old", "[unit][faults][F21]") {
  World world;
  world.now = start + 250ms;
  CHECK_FALSE(world.is_true(FaultId::module_lost));
  world.now = start + 250ms + 1ns;
  CHECK(world.is_true(FaultId::module_lost));
  CHECK(world.read(FaultId::module_lost).element == Element{.module_node = 1});
  CHECK(world.read(FaultId::module_lost).taken_at == start);
  world.poll_after(0ms);
  world.answer(1);
  CHECK(world.read(FaultId::module_lost).element == Element{.module_node = 2});
  world.answer(2);
  CHECK_FALSE(world.is_true(FaultId::module_lost));
  expect_only_if_started(world, FaultId::module_lost);
}

TEST_CASE("a cell that an answering module does not know is named", "[unit][faults][F11]") {
  World world;
  world.poll_after(100ms);
  world.say_status(2, [](CanFrame&) {});
  world.say_cells(2, 3);
  const Reading reading = world.read(FaultId::cell_not_measured);
  CHECK(reading.value == 1);
  CHECK(reading.element == Element{.module_node = 2, .number = 4});
  CHECK(reading.taken_at == start + 100ms);
  world.tell_cells(2, {0, 3'700'000, 3'700'000, 3'700'000});
  CHECK_FALSE(world.is_true(FaultId::cell_not_measured));
  world.say_cells(2, 0);
  CHECK(world.read(FaultId::cell_not_measured).element == Element{.module_node = 2, .number = 1});
  world.say_cells(2, 4);
  CHECK_FALSE(world.is_true(FaultId::cell_not_measured));
  CHECK_FALSE(world.read(FaultId::cell_not_measured).is_partial);
  expect_only_if_started(world, FaultId::cell_not_measured);
}

TEST_CASE("cells of a module that does not answer are its loss, and the others speak in part only",
          "[unit][faults][F21]") {
  World world;
  world.poll_after(301ms);
  world.answer(2);
  CHECK_FALSE(world.is_true(FaultId::cell_not_measured));
  CHECK(world.read(FaultId::cell_not_measured).is_partial);
  world.say_cells(2, 2);
  CHECK(world.read(FaultId::cell_not_measured).element == Element{.module_node = 2, .number = 3});
}

TEST_CASE("a temperature that is none, or does not come, is missing", "[unit][faults][F9]") {
  World world;
  world.poll_after(100ms);
  world.say_temperatures(2, 1);
  Reading reading = world.read(FaultId::temperature_not_measured);
  CHECK(reading.value == 1);
  CHECK(reading.element == Element{.module_node = 2, .number = 2, .is_temperature_sensor = true});
  CHECK(reading.taken_at == start + 100ms);
  world.say_temperatures(2, 2);
  world.now = start + 250ms;
  CHECK_FALSE(world.is_true(FaultId::temperature_not_measured));
  world.now = start + 250ms + 1ns;
  reading = world.read(FaultId::temperature_not_measured);
  CHECK(reading.value == 1);
  CHECK(reading.element == Element{.module_node = 1, .number = 1, .is_temperature_sensor = true});
  CHECK(reading.taken_at == world.now);  // a missing value gets the time of each reading
  expect_only_if_started(world, FaultId::temperature_not_measured);
}

TEST_CASE("a board sensor that a module has once shown is expected of it, whatever it says later",
          "[unit][faults][F9]") {
  const FaultId id = FaultId::temperature_not_measured;
  const SignalValue none = not_known(Validity::not_fitted);
  World world;
  world.say_boards(2, {known(300), none, known(310), none});
  CHECK_FALSE(world.is_true(id));
  for (const SignalValue& bad : {not_known(Validity::sensor_fault), none}) {
    world.say_boards(2, {known(300), none, bad, none});
    CHECK(world.is_true(id));
    CHECK(world.read(id).element == Element{.module_node = 2, .number = 8, .is_temperature_sensor = true});
    CHECK(to_text(world.read(id).element) == "board sensor 2.3");
  }
  world.say_boards(2, {known(300), none, known(310), none});
  CHECK_FALSE(world.is_true(id));
  world.modules().forget_values();
  world.poll_after(1s);
  world.answer(1);
  world.answer(2);
  CHECK(world.read(id).element == Element{.module_node = 2, .number = 6, .is_temperature_sensor = true});
  world.say_boards(2, {known(300), none, known(310), none});
  CHECK_FALSE(world.is_true(id));
  world.poll_after(250ms + 1ns);
  world.answer(1);
  world.answer(2);
  CHECK(world.is_true(id));  // TEMP_2 is missing
  CHECK(world.read(id).taken_at == world.now);
}

TEST_CASE("a board sensor that is broken from the start is fitted", "[unit][faults][F9]") {
  World world;
  world.say_boards(1, {not_known(Validity::not_fitted), not_known(Validity::sensor_fault),
                       not_known(Validity::not_fitted), not_known(Validity::not_fitted)});
  CHECK(world.read(FaultId::temperature_not_measured).element ==
        Element{.module_node = 1, .number = 7, .is_temperature_sensor = true});
}

TEST_CASE("a temperature in doubt is not missing, and nothing is good meanwhile", "[unit][faults][F2][F9]") {
  const FaultId id = FaultId::temperature_not_measured;
  World world;
  world.poll_after(100ms);
  world.say_first_temperature(1, known(800));
  CHECK_FALSE(world.is_true(id));
  CHECK(world.read(id).is_partial);
  world.now += 250ms;
  world.say_first_temperature(2, known(250));
  CHECK_FALSE(world.is_true(id));
  world.now += 1ns;
  CHECK(world.is_true(id));  // stale, no longer only implausible
  world.say_first_temperature(1, known(250));
  CHECK_FALSE(world.is_true(id));
  CHECK_FALSE(world.read(id).is_partial);
  world.say_first_temperature(1, known(800));
  world.say_temperatures(2, 1);
  CHECK(world.is_true(id));  // another one is missing
  World silent;
  silent.poll_after(100ms);
  silent.say_temperatures(1, 2, 800);
  CHECK_FALSE(silent.is_true(id));
  silent.poll_after(250ms + 1ns);
  silent.say_temperatures(2, 2);
  CHECK(silent.is_true(id));  // all implausible ones are stale
}

TEST_CASE("each failure that a module can report is one", "[unit][faults][F36][RR_7]") {
  using namespace internal_bus;
  struct Report {
    FaultId fault;
    void (*write_it)(CanFrame&);
  };
  const std::array reports{
      Report{FaultId::module_reports_undervoltage,
             [](CanFrame& frame) { write<status, "undervoltage_cells">(frame, 1); }},
      Report{FaultId::module_reports_fault, [](CanFrame& frame) { write<status, "overvoltage_cells">(frame, 1); }},
      Report{FaultId::module_reports_fault, [](CanFrame& frame) { write<status, "self_test_failed">(frame, 1); }}};
  for (const Report& report : reports) {
    World world;
    world.now = start + 20ms;
    world.say_status(2, report.write_it);
    for (const FaultId id : {FaultId::module_reports_fault, FaultId::module_reports_undervoltage}) {
      CHECK(world.is_true(id) == (id == report.fault));
    }
    CHECK(world.read(report.fault).element == Element{.module_node = 2});
    CHECK(world.read(report.fault).taken_at == start + 20ms);  // of the status
    CHECK_FALSE(world.is_true(FaultId::module_warning));
    world.modules().forget_values();
    CHECK_FALSE(world.is_true(report.fault));
  }
}

TEST_CASE("an open wire that a module flags, in its status or with its voltage, is one, and as old as that",
          "[unit][faults][F10]") {
  World world;
  world.poll_after(100ms);
  world.answer(1);
  world.say_status(2, [](CanFrame& frame) { write<internal_bus::status, "open_cell_wire">(frame, 1); });
  CHECK(world.is_true(FaultId::open_wire));
  CHECK(world.read(FaultId::open_wire).element == Element{.module_node = 2});
  CHECK(world.read(FaultId::open_wire).taken_at == start + 100ms);
  CHECK_FALSE(world.is_true(FaultId::module_reports_fault));
  world.modules().forget_values();
  CHECK_FALSE(world.is_true(FaultId::open_wire));
  world.say_module(1, 0b100);
  world.now = start + 120ms;
  world.say_status(1, [](CanFrame&) {});
  CHECK(world.is_true(FaultId::open_wire));
  CHECK(world.read(FaultId::open_wire).element == Element{.module_node = 1});
  CHECK(world.read(FaultId::open_wire).taken_at == start + 100ms);
}

TEST_CASE("each thing that a module can warn of is a warning and no failure", "[unit][faults]") {
  using namespace internal_bus;
  const std::array<void (*)(CanFrame&), 4> warnings{
      [](CanFrame& frame) { write<status, "board_too_hot">(frame, 1); },
      [](CanFrame& frame) { write<status, "external_supply_low">(frame, 1); },
      [](CanFrame& frame) { write<status, "temperature_sensor_fault">(frame, 1); },
      [](CanFrame& frame) { write<status, "front_end_crc_errors">(frame, 1); }};
  for (const auto warning : warnings) {
    World world;
    world.now = start + 20ms;
    world.say_status(1, warning);
    CHECK(world.is_true(FaultId::module_warning));
    CHECK(world.read(FaultId::module_warning).element == Element{.module_node = 1});
    CHECK(world.read(FaultId::module_warning).taken_at == start + 20ms);
    CHECK_FALSE(world.is_true(FaultId::module_reports_fault));
    world.modules().forget_values();
    CHECK_FALSE(world.is_true(FaultId::module_warning));
  }
}

TEST_CASE("a wrong count of cells is found by the status or by the identity", "[unit][faults][F81]") {
  World world;
  const FaultId id = FaultId::wrong_cell_count;
  for (const std::int64_t cells : {3, 5}) {
    world.answer(1);
    world.say_status(1, [cells](CanFrame& frame) { write<internal_bus::status, "cell_count">(frame, cells); });
    CHECK(world.is_true(id));
    CHECK(world.read(id).element == Element{.module_node = 1});
    CHECK(world.read(id).taken_at == start);
    world.answer(1);
    CHECK_FALSE(world.is_true(id));
    world.say_identity(2, 1, cells, 2);
    CHECK(world.is_true(id));
    CHECK(world.read(id).element == Element{.module_node = 2});
    world.say_identity(2, 1, 4, 2);
    CHECK_FALSE(world.is_true(id));
  }
}

TEST_CASE("a wrong count of cells opens at once, and a pack that has it from the start does not close",
          "[unit][faults][F81]") {
  CHECK(row_of(FaultId::wrong_cell_count).reaction == Reaction::open_now);
  test::CoreBench bench(test::small_pack());
  bench.modules[1].cell_count = 5;
  bench.modules[1].cell_voltage_uV[4] = known(0);  // so that the sum of the module's cells is unchanged
  bool was_contactor_commanded = false;
  bench.each_ms = [&] { was_contactor_commanded = was_contactor_commanded || bench.commanded().any_contactor(); };
  CHECK_FALSE(bench.close());
  CHECK_FALSE(was_contactor_commanded);
  CHECK_FALSE(bench.core().permission().may_close);
  for (const FaultRow& row : fault_table()) {
    INFO(row.name);
    CHECK(bench.is_active(row.id) == (row.id == FaultId::wrong_cell_count));
  }
  CHECK(bench.core().faults().state(FaultId::wrong_cell_count).confirmed.element == Element{.module_node = 2});
}

TEST_CASE("a module of another protocol, or with another number of temperature sensors, is not the configured one",
          "[unit][faults][F37]") {
  World world;
  const auto is_mismatch = [&world](std::int64_t version, std::int64_t temperatures) {
    world.say_identity(2, version, 4, temperatures);
    return world.is_true(FaultId::module_mismatch);
  };
  CHECK(is_mismatch(2, 2));
  CHECK(world.read(FaultId::module_mismatch).element == Element{.module_node = 2});
  CHECK(world.read(FaultId::module_mismatch).taken_at == start);
  CHECK(is_mismatch(0, 2));
  CHECK(is_mismatch(1, 1));
  CHECK_FALSE(is_mismatch(1, 2));
  CHECK(is_mismatch(1, 3));  // its temperatures may be those of other cells than in the pack file
}

TEST_CASE("a module that has said nothing yet is no other module", "[unit][faults][F37]") {
  World world;
  world.say_identity(1, 2, 5, 1);
  world.say_status(2, [](CanFrame& frame) { write<internal_bus::status, "cell_count">(frame, 5); });
  world.modules().forget_values();
  CHECK_FALSE(world.is_true(FaultId::module_mismatch));
  CHECK_FALSE(world.is_true(FaultId::wrong_cell_count));
}

TEST_CASE("nobody is out of place for sure once all modules have said who they are, where they can say so",
          "[unit][faults][F37]") {
  World world;
  for (const FaultId id : {FaultId::module_exchanged, FaultId::modules_swapped}) {
    CHECK_FALSE(world.is_true(id));
    CHECK_FALSE(world.read(id).is_partial);
  }
  world.modules().forget_values();
  for (const FaultId id : {FaultId::module_exchanged, FaultId::modules_swapped}) {
    CHECK_FALSE(world.is_true(id));
    CHECK(world.read(id).is_partial);
    world.config.foreign.driver = find_device("i3_csc")->modules;  // of a protocol without serial numbers
    CHECK_FALSE(world.read(id).is_partial);
    world.config.foreign.driver = nullptr;
  }
}

TEST_CASE("two modules under one number are remembered for 15 s", "[unit][faults][F30]") {
  World world;
  world.modules().note_conflict(2, start);
  world.modules().begin_cycle(start + 999ms, {});
  world.modules().note_conflict(2, start + 1s);
  world.now = start + 16s;
  CHECK(world.is_true(FaultId::duplicate_node));
  CHECK(world.read(FaultId::duplicate_node).element == Element{.module_node = 2});
  world.now = start + 16s + 1ns;
  CHECK_FALSE(world.is_true(FaultId::duplicate_node));
}

TEST_CASE("a memory of no rival at all is none, however early it is", "[unit][faults][F30]") {
  World world;
  world.now = TimePoint{1s};
  CHECK_FALSE(world.is_true(FaultId::duplicate_node));
}

TEST_CASE("each of the sensor's three values is missed after its own time", "[unit][faults][F17]") {
  World world;
  world.now = start + 200ms;
  CHECK_FALSE(world.is_true(FaultId::current_sensor_lost));
  CHECK_FALSE(world.is_true(FaultId::pdu_lost));
  world.now = start + 200ms + 1ns;
  CHECK(world.is_true(FaultId::current_sensor_lost));
  CHECK(world.is_true(FaultId::pdu_lost));
  CHECK(world.read(FaultId::current_sensor_lost).taken_at == start);
  CHECK(world.read(FaultId::pdu_lost).taken_at == start);
  world.now = start + 250ms;
  CHECK_FALSE(world.is_true(FaultId::voltage_sensor_lost));
  world.now = start + 250ms + 1ns;
  CHECK(world.is_true(FaultId::voltage_sensor_lost));
  world.sensors.link_voltage_mV.taken_at = world.now;
  CHECK(world.is_true(FaultId::voltage_sensor_lost));
  CHECK(world.read(FaultId::voltage_sensor_lost).taken_at == start);
  world.sensors.pack_voltage_mV.taken_at = world.now;
  CHECK_FALSE(world.is_true(FaultId::voltage_sensor_lost));
  world.sensors.link_voltage_mV.validity = Validity::sensor_fault;
  CHECK(world.is_true(FaultId::voltage_sensor_lost));
  CHECK(world.read(FaultId::voltage_sensor_lost).taken_at == world.now);
  expect_only_if_started(world, FaultId::current_sensor_lost);
  expect_only_if_started(world, FaultId::voltage_sensor_lost);
  expect_only_if_started(world, FaultId::pdu_lost);
}

TEST_CASE("lines of this machine that cannot be read are their own fault, not the unit's", "[unit][faults][gpio]") {
  World world;
  world.config.lines.are_used = true;
  world.sensors.pdu_word = world.sensors.pdu;
  world.sensors.pdu = {};                   // the combined state of GPIO and PDU is unknown
  CHECK(world.is_true(FaultId::pdu_lost));  // a GPIO failure is not reported
  world.flags.lines_failed = true;
  CHECK_FALSE(world.is_true(FaultId::pdu_lost));
  CHECK(world.is_true(FaultId::lines_failed));
  world.now = start + world.config.ages.pdu_status + 1ns;
  CHECK(world.is_true(FaultId::pdu_lost));
  world.now = start;
  world.config.contactors.has_pdu = false;
  CHECK(world.is_true(FaultId::pdu_lost));
}

TEST_CASE("each input of the unit speaks for itself, as long as the unit is heard", "[unit][faults][F93][F100][F95]") {
  struct Case {
    FaultId id;
    bool PduState::*input;
  };
  const Case cases[] = {{FaultId::emergency_stop, &PduState::estop_1_released},
                        {FaultId::emergency_stop, &PduState::estop_2_released},
                        {FaultId::interlock_open, &PduState::interlock_closed},
                        {FaultId::insulation_fault, &PduState::insulation_monitor_ok}};
  for (const Case& one : cases) {
    World world;
    world.sensors.pdu.value.*one.input = false;
    for (const Case& other : cases) CHECK(world.is_true(other.id) == (other.id == one.id));
    CHECK(world.read(one.id).taken_at == start);
    world.now = start + 200ms;
    CHECK(world.is_true(one.id));
    world.now = start + 200ms + 1ns;
    CHECK_FALSE(world.read(one.id).is_known);
  }
}

TEST_CASE("a unit that missed commands or restarted has opened by itself, if something was to be closed",
          "[unit][faults][F101]") {
  World world;
  for (const bool by_timeout : {false, true}) {
    for (const bool by_restart : {false, true}) {
      world.sensors.pdu.value.opened_by_timeout = by_timeout;
      world.flags.pdu_restarted = by_restart;
      world.flags.closing_is_commanded = false;
      CHECK_FALSE(world.is_true(FaultId::pdu_opened_by_itself));
      world.flags.closing_is_commanded = true;
      CHECK(world.is_true(FaultId::pdu_opened_by_itself) == (by_timeout || by_restart));
    }
  }
}

TEST_CASE("an alarm loop that the unit reports as open is a fault, whatever is commanded", "[unit][faults][SEC_1]") {
  World world;
  const FaultId id = FaultId::alarm_loop_open;
  CHECK_FALSE(world.is_true(id));
  world.sensors.pdu.value.alarm_loop_open = true;
  CHECK(world.is_true(id));
  CHECK(world.read(id).taken_at == start);
  CHECK(row_of(id).reaction == Reaction::open_now);
  world.has_started = false;
  CHECK_FALSE(world.read(id).is_known);
  world.has_started = true;
  world.now = start + world.config.ages.pdu_status + 1ns;
  CHECK_FALSE(world.read(id).is_known);
}

TEST_CASE("commands that are not on the bus matter while something is to be closed", "[unit][faults][F46]") {
  World world;
  world.flags.command_not_on_bus = true;
  CHECK_FALSE(world.is_true(FaultId::command_not_on_bus));
  world.flags.closing_is_commanded = true;
  CHECK(world.is_true(FaultId::command_not_on_bus));
  world.flags.command_not_on_bus = false;
  CHECK_FALSE(world.is_true(FaultId::command_not_on_bus));
}

TEST_CASE("each condition of the core has the row of its name", "[unit][faults][BMU_9]") {
  struct Case {
    FaultId id;
    bool CoreFlags::*flag;
    bool is_bad;
  };
  const Case cases[] = {{FaultId::foreign_master, &CoreFlags::foreign_master_seen, true},
                        {FaultId::internal_bus_down, &CoreFlags::internal_bus_up, false},
                        {FaultId::control_loop_gap, &CoreFlags::loop_gap_seen, true},
                        {FaultId::tick_overrun, &CoreFlags::tick_was_late, true},
                        {FaultId::lines_failed, &CoreFlags::lines_failed, true},
                        {FaultId::clock_jump, &CoreFlags::clock_jumped, true},
                        {FaultId::frames_lost, &CoreFlags::frames_lost_seen, true}};
  for (const Case& one : cases) {
    World world;
    world.flags.*one.flag = one.is_bad;
    for (const Case& other : cases) CHECK(world.is_true(other.id) == (other.id == one.id));
    CHECK(world.read(one.id).taken_at == start);
  }
}

TEST_CASE("each way in which a precharge fails has its row", "[unit][faults]") {
  const std::array<std::pair<PrechargeFailure, FaultId>, 3> rows{
      {{PrechargeFailure::too_slow, FaultId::precharge_failed},
       {PrechargeFailure::too_fast, FaultId::precharge_too_fast},
       {PrechargeFailure::overcurrent, FaultId::precharge_overcurrent}}};
  for (const auto& [failure, id] : rows) {
    World world;
    world.flags.precharge_failure = failure;
    for (const auto& [other_failure, other] : rows) CHECK(world.is_true(other) == (other == id));
  }
}

TEST_CASE("a contactor that disobeys is named", "[unit][faults][F83]") {
  World world;
  world.flags.contactor_not_following = 2;
  CHECK(world.is_true(FaultId::contactor_feedback));
  CHECK(world.read(FaultId::contactor_feedback).element == Element{.contactor = 2});
  CHECK_FALSE(world.is_true(FaultId::contactor_welded));
  world.flags = {.internal_bus_up = true, .contactor_welded = 1};
  CHECK(world.is_true(FaultId::contactor_welded));
  CHECK(world.read(FaultId::contactor_welded).element == Element{.contactor = 1});
  CHECK_FALSE(world.is_true(FaultId::contactor_feedback));
}

TEST_CASE("each trouble of the daemon's own has its row", "[unit][faults]") {
  const std::array<std::pair<bool OwnHealth::*, FaultId>, 5> rows{
      {{&OwnHealth::store_unreadable, FaultId::store_unreadable},
       {&OwnHealth::store_write_failed, FaultId::store_write_failed},
       {&OwnHealth::history_write_failed, FaultId::history_write_failed},
       {&OwnHealth::memory_low, FaultId::memory_low},
       {&OwnHealth::disk_low, FaultId::disk_low}}};
  for (const auto& [trouble, id] : rows) {
    World world;
    world.flags.health.*trouble = true;
    for (const auto& [other_trouble, other] : rows) CHECK(world.is_true(other) == (other == id));
  }
}

TEST_CASE("extremes of cells and temperatures are read with their cell and time, and unknown without any",
          "[unit][faults]") {
  World world;
  const Element low{.module_node = 1, .number = 2, .pack_number = 2};
  const Element high{.module_node = 2, .number = 1, .pack_number = 5};
  const Spread spread{.min = 10,
                      .max = 20,
                      .min_at = low,
                      .max_at = high,
                      .min_taken_at = start - 2ms,
                      .max_taken_at = start - 1ms,
                      .count = 8,
                      .expected = 8};
  struct Case {
    FaultId id;
    Spread PackState::*spread;
    bool is_min;
  };
  const Case cases[] = {{FaultId::cell_undervoltage, &PackState::cell_voltage_uV, true},
                        {FaultId::cell_overvoltage, &PackState::cell_voltage_uV, false},
                        {FaultId::cell_undertemperature, &PackState::cell_temperature_dC, true},
                        {FaultId::cell_overtemperature, &PackState::cell_temperature_dC, false}};
  for (const Case& one : cases) {
    world.pack = {};
    CHECK_FALSE(world.read(one.id).is_known);
    world.pack.*one.spread = spread;
    CHECK(world.read(one.id).is_known);
    CHECK_FALSE(world.read(one.id).is_partial);
    CHECK(world.read(one.id).value == (one.is_min ? 10 : 20));
    CHECK(world.read(one.id).element == (one.is_min ? low : high));
    CHECK(world.read(one.id).taken_at == (one.is_min ? start - 2ms : start - 1ms));
    (world.pack.*one.spread).count = 7;
    CHECK(world.read(one.id).is_known);
    CHECK(world.read(one.id).is_partial);
  }
}

TEST_CASE("a current is judged in both directions", "[unit][faults][BMU_14]") {
  World world;
  CHECK_FALSE(world.read(FaultId::discharge_overcurrent).is_known);
  CHECK_FALSE(world.read(FaultId::charge_overcurrent).is_known);
  world.pack.current_mA = {INT32_MIN, start, Validity::valid};
  CHECK(world.read(FaultId::discharge_overcurrent).value == INT32_MIN);
  CHECK(world.read(FaultId::charge_overcurrent).value == -std::int64_t{INT32_MIN});
  CHECK(world.read(FaultId::discharge_overcurrent).taken_at == start);
  CHECK(world.read(FaultId::charge_overcurrent).taken_at == start);
}

TEST_CASE("the sum of the cells against the pack voltage: both are needed, and the later one dates it",
          "[unit][faults][F14][BMU_4]") {
  World world;
  const FaultId id = FaultId::pack_voltage_mismatch;
  CHECK_FALSE(world.read(id).is_known);
  world.pack.cell_voltage_sum_mV = {30'000, start, Validity::valid};
  CHECK_FALSE(world.read(id).is_known);
  world.pack.pack_voltage_mV = {29'000, start - 5ms, Validity::valid};
  CHECK(world.read(id).is_known);
  CHECK(world.read(id).value == 1'000);
  CHECK(world.read(id).taken_at == start);
  world.pack.pack_voltage_mV = {31'000, start + 5ms, Validity::valid};
  CHECK(world.read(id).value == 1'000);
  CHECK(world.read(id).taken_at == start + 5ms);
  world.pack.cell_voltage_sum_mV = {};
  CHECK_FALSE(world.read(id).is_known);
}

TEST_CASE("what a swing of the current explains is taken off a difference of voltages, twice the model's resistance",
          "[unit][faults][F14]") {
  World world;
  world.config.cell.series_resistance_Ohm = 0.001;  // 8 cells: 8 mOhm
  const auto mismatch_mV = [&world](std::int32_t apart_mV, TimePoint sum_at, TimePoint pack_at) {
    world.pack.cell_voltage_sum_mV = {30'000, sum_at, Validity::valid};
    world.pack.pack_voltage_mV = {30'000 - apart_mV, pack_at, Validity::valid};
    return world.read(FaultId::pack_voltage_mismatch).value;
  };
  world.sensors.current_window.add(100'000, start - 100ms);
  world.sensors.current_window.add(0, start - 60ms);
  world.sensors.current_window.add(0, start - 20ms);
  CHECK(mismatch_mV(2'000, start - 100ms, start) == 400);  // 2 * 100 A * 8 mOhm = 1.6 V
  CHECK(mismatch_mV(2'000, start, start - 100ms) == 400);  // the older one counts, whichever it is
  CHECK(mismatch_mV(-2'000, start, start - 100ms) == 400);
  CHECK(mismatch_mV(1'600, start - 100ms, start) == 0);
  CHECK(mismatch_mV(1'601, start - 100ms, start) == 1);
  CHECK(mismatch_mV(1'000, start - 100ms, start) == 0);  // never below
  CHECK(mismatch_mV(2'000, start, start) == 2'000);
}

TEST_CASE("a link is compared with the pack while closed, by what was measured since", "[unit][faults][F85]") {
  World world;
  const FaultId id = FaultId::link_not_following;
  world.flags.closed_since = start;
  const auto shown = [&world](const Measured<std::int32_t>& pack, const Measured<std::int32_t>& link) {
    world.pack.pack_voltage_mV = pack;
    world.pack.link_voltage_mV = link;
    return world.read(id);
  };
  const Measured<std::int32_t> pack{100'000, start + 1ns, Validity::valid};
  const Measured<std::int32_t> apart{94'999, start + 2ns, Validity::valid};
  CHECK(shown(pack, apart).value == 1);
  CHECK(shown(pack, apart).taken_at == start + 2ns);
  CHECK(shown(pack, {95'000, start + 2ns, Validity::valid}).is_known);
  CHECK(shown(pack, {95'000, start + 2ns, Validity::valid}).value == 0);
  CHECK(shown(pack, {105'001, start + 2ns, Validity::valid}).value == 1);
  CHECK_FALSE(shown({}, apart).is_known);
  CHECK_FALSE(shown(pack, {}).is_known);
  CHECK_FALSE(shown({100'000, start + 1ns, Validity::unknown}, apart).is_known);
  CHECK_FALSE(shown(pack, {0, start + 2ns, Validity::unknown}).is_known);
  CHECK_FALSE(shown({100'000, start, Validity::valid}, apart).is_known);
  CHECK_FALSE(shown(pack, {94'999, start, Validity::valid}).is_known);
  world.flags.closed_since = {};
  CHECK(shown(pack, apart).is_known);
  CHECK(shown(pack, apart).value == 0);
}

TEST_CASE("limits that a pack file leaves out are these", "[unit][faults][BMS_F.7][BMS_NF.7]") {
  struct Case {
    FaultId id;
    std::int32_t warn;
    std::int32_t open;
    std::int32_t hysteresis;
    Duration confirm;
  };
  for (const Case& one :
       {Case{FaultId::cell_resistance, 1'500, 2'001, 200, 0ms}, Case{FaultId::pack_resistance, 1'500, 2'000, 200, 0ms},
        Case{FaultId::discharge_overload, 800, 1'000, 150, 20ms},
        Case{FaultId::charge_overload, 800, 1'000, 150, 20ms}}) {
    INFO(row_of(one.id).name);
    REQUIRE(row_of(one.id).limit != nullptr);
    const LimitConfig limit = LimitsConfig{}.*row_of(one.id).limit;
    CHECK(limit.warn == one.warn);
    CHECK_FALSE(limit.limit.has_value());
    CHECK(limit.open == one.open);
    CHECK(limit.hysteresis == one.hysteresis);
    CHECK(limit.confirm == one.confirm);
    CHECK(limit.clear == 1s);
  }
}

TEST_CASE("a row that nobody filled in opens at once, and clears after a second", "[unit][faults]") {
  const FaultRow unfilled{};
  CHECK(unfilled.samples == 1);
  CHECK(unfilled.clear == 1s);
  CHECK(unfilled.reaction == Reaction::open_now);
  CHECK(unfilled.dtc == 0);
  CHECK(unfilled.lithiumate_code == 0);
  CHECK_FALSE(unfilled.has_limit());
}

TEST_CASE("reactions and latches have names of their own, and no other number has one", "[unit][faults]") {
  CHECK(to_text(Reaction::warn) == "warn");
  CHECK(to_text(Reaction::open_after_grace) == "open after grace");
  CHECK(to_text(Reaction::open_now) == "open now");
  CHECK(to_text(static_cast<Reaction>(99)) == "?");
  CHECK(to_text(Reaction::refuse_close) == "refuse to close");
  CHECK(to_text(Concerns::all) == "all");
  CHECK(to_text(Concerns::charge) == "charging");
  CHECK(to_text(Concerns::discharge) == "discharging");
  CHECK(to_text(static_cast<Concerns>(99)) == "?");
  CHECK(to_text(Latch::until_authorised) == "until cleared with authority");
  CHECK(to_text(Latch::none) == "none");
  CHECK(to_text(Latch::until_cleared) == "until cleared");
  CHECK(to_text(static_cast<Latch>(99)) == "?");
}

TEST_CASE("what nobody filled in is not known, not seen and not up", "[unit][faults]") {
  const Reading reading;
  CHECK_FALSE(reading.is_known);
  CHECK_FALSE(reading.is_partial);
  CHECK(reading.value == 0);
  const CoreFlags flags;
  for (const bool flag : {flags.foreign_master_seen, flags.internal_bus_up, flags.loop_gap_seen, flags.frames_lost_seen,
                          flags.contactor_not_following != 0, flags.contactor_welded != 0, flags.closing_is_commanded,
                          flags.pdu_restarted, flags.command_not_on_bus, flags.is_driving, FaultInputs{}.has_started}) {
    CHECK_FALSE(flag);
  }
}

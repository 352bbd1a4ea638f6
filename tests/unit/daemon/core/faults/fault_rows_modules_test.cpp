// Readings of the fault rows that compare cells with cells, cells with modules, and frames with frames.
#include <array>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "daemon/core/measurement/module_table.hpp"
#include "tests/support/fault_world.hpp"

using namespace bmu;
using bmu::test::start;
using World = bmu::test::FaultWorld;

namespace {

constexpr std::array<std::uint8_t, 2> nodes{1, 2};

CoreConfig pack_of_threes() {
  CoreConfig config = test::small_pack();
  for (ModuleConfig& module : config.modules) module.cell_count = 3;
  return config;
}

void say_module_mV(World& world, std::uint8_t node, std::int64_t voltage_mV, std::int64_t open_wire_cells = 0) {
  CanFrame frame = make_frame(internal_bus::module, node);
  encode_signal(internal_bus::module.signals[0], known(voltage_mV), frame.data);
  write<internal_bus::module, "open_wire_cells">(frame, open_wire_cells);
  world.modules().observe(internal_bus::module, node, frame, world.now);
}

}  // namespace

TEST_CASE("a spread is the highest less the lowest, at the one that is further from the average", "[unit][faults]") {
  constexpr Element low{.module_node = 1, .number = 2};
  constexpr Element high{.module_node = 2, .number = 3};
  struct Case {
    FaultId id;
    Spread PackState::*spread;
  };
  for (const Case& one : {Case{FaultId::cell_imbalance, &PackState::cell_voltage_uV},
                          Case{FaultId::temperature_spread, &PackState::cell_temperature_dC}}) {
    World world;
    CHECK_FALSE(world.read(one.id).is_known);
    Spread& spread = world.pack.*one.spread;
    spread = {.min = 100,
              .max = 400,
              .average = 251,
              .min_at = low,
              .max_at = high,
              .min_taken_at = start - 2ms,
              .max_taken_at = start - 1ms,
              .count = 8,
              .expected = 8};
    CHECK(world.read(one.id).is_known);
    CHECK_FALSE(world.read(one.id).is_partial);
    CHECK(world.read(one.id).value == 300);
    CHECK(world.read(one.id).element == low);
    CHECK(world.read(one.id).taken_at == start - 1ms);
    spread.average = 250;  // both deviate equally
    CHECK(world.read(one.id).element == high);
    spread.average = 101;
    CHECK(world.read(one.id).element == high);
    spread.min_taken_at = start;
    CHECK(world.read(one.id).taken_at == start);
    spread.count = 7;
    CHECK(world.read(one.id).is_partial);
    spread.min = INT32_MIN;
    spread.max = INT32_MAX;
    CHECK(world.read(one.id).value == std::int64_t{UINT32_MAX});
  }
}

TEST_CASE("the hottest and the coldest board are judged", "[unit][faults]") {
  World world;
  world.pack.board_temperature_dC = {.min = -50, .max = 700, .count = 2, .expected = 2};
  CHECK(world.read(FaultId::board_overtemperature).value == 700);
  CHECK(world.read(FaultId::board_undertemperature).value == -50);
}

TEST_CASE("a module's voltage against the sum of its cells: the worst module, in part if one is missing",
          "[unit][faults][F14]") {
  World world;
  const FaultId id = FaultId::module_voltage_mismatch;
  world.poll_after(100ms);
  for (const std::uint8_t node : nodes) {
    world.say_status(node, [](CanFrame&) {});
    world.tell_cells(node, {3'700'000, 3'700'000, 3'700'000, 3'700'000});
    say_module_mV(world, node, 14'800);
  }
  CHECK(world.read(id).is_known);
  CHECK(world.read(id).value == 0);
  CHECK(world.read(id).element == Element{});
  CHECK_FALSE(world.read(id).is_partial);
  world.poll_after(5ms);
  say_module_mV(world, 1, 14'900);
  CHECK(world.read(id).value == 100);
  CHECK(world.read(id).element == Element{.module_node = 1});
  CHECK(world.read(id).taken_at == start + 105ms);
  say_module_mV(world, 2, 14'700);
  CHECK(world.read(id).element == Element{.module_node = 1});  // the first of equal ones
  say_module_mV(world, 2, 14'690);
  CHECK(world.read(id).value == 110);
  CHECK(world.read(id).element == Element{.module_node = 2});
  world.now = start + 100ms + 250ms;  // maximum age of cells
  CHECK_FALSE(world.read(id).is_partial);
  world.now += 1ns;
  CHECK(world.read(id).value == 0);
  CHECK(world.read(id).is_partial);
}

TEST_CASE("a module's voltage that is too old is compared with nothing, however fresh its cells are",
          "[unit][faults][F14]") {
  World world;
  world.poll_after(250ms + 1ns);
  for (const std::uint8_t node : nodes) {
    world.say_status(node, [](CanFrame&) {});
    world.tell_cells(node, {3'700'000, 3'700'000, 3'700'000, 3'700'000});
  }
  CHECK(world.read(FaultId::module_voltage_mismatch).value == 0);
  CHECK(world.read(FaultId::module_voltage_mismatch).is_partial);
}

TEST_CASE("a swing of the current explains as much between a module and its cells as its cells have resistance",
          "[unit][faults][F14]") {
  World world;
  world.config.cell.series_resistance_Ohm = 0.001;  // 4 cells: 4 mOhm
  world.poll_after(100ms);
  world.say_status(1, [](CanFrame&) {});
  world.sensors.current_window.add(100'000, world.now - 20ms);
  world.tell_cells(1, {3'700'000, 3'700'000, 3'700'000, 3'700'000});
  say_module_mV(world, 2, 14'800);
  world.now += 20ms;
  world.sensors.current_window.add(0, world.now);
  say_module_mV(world, 1, 16'800);
  CHECK(world.read(FaultId::module_voltage_mismatch).value == 1'200);  // 2 V less 2 * 100 A * 4 mOhm
}

TEST_CASE("an open wire moves two neighbours the same way apart, by 0.4 V and more", "[unit][faults][F10]") {
  const auto wire = [](const std::vector<std::int64_t>& cells_uV) {
    World world;
    world.tell_cells(1, cells_uV);
    CHECK(world.read(FaultId::open_wire).value == (world.read(FaultId::open_wire).element == Element{} ? 0 : 1));
    return world.read(FaultId::open_wire).element;
  };
  constexpr Element between_2_and_3{.module_node = 1, .number = 2};
  CHECK(wire({3'700'000, 3'300'000, 4'100'000, 3'700'000}) == between_2_and_3);
  CHECK(wire({3'700'000, 4'100'000, 3'300'000, 3'700'000}) == between_2_and_3);
  CHECK(wire({3'700'000, 3'300'100, 4'099'900, 3'700'000}) == Element{});
  CHECK(wire({3'300'000, 4'100'000, 3'700'000, 3'700'000}) == Element{.module_node = 1, .number = 1});
  CHECK(wire({3'700'000, 3'700'000, 3'300'000, 4'100'000}) == Element{.module_node = 1, .number = 3});
  // The decrease of one cell need not equal the increase of the other: up to a quarter of the smaller one it is still
  // an open wire.
  CHECK(wire({3'700'000, 3'300'000, 4'200'000, 3'600'000}) == between_2_and_3);
  CHECK(wire({3'700'000, 3'300'000, 4'200'100, 3'599'900}) == Element{});
  CHECK(wire({3'600'000, 4'200'000, 3'300'000, 3'700'000}) == between_2_and_3);
  // Both on the same side of the average, or one of them on it, is a difference of cells.
  CHECK(wire({3'000'000, 3'000'000, 4'400'000, 4'400'000}) == between_2_and_3);
  CHECK(wire({4'400'000, 4'400'000, 3'700'000, 2'300'000}) == Element{});
  CHECK(wire({3'700'000, 3'700'000, 3'700'000, 3'700'000}) == Element{});
}

TEST_CASE("three cells are enough to tell an open wire, a module that is not complete is not", "[unit][faults][F10]") {
  World three(pack_of_threes());
  three.tell_cells(1, {3'700'000, 3'000'000, 4'400'000});
  CHECK(three.read(FaultId::open_wire).element == Element{.module_node = 1, .number = 2});
  CHECK(three.read(FaultId::open_wire).taken_at == start);
  World incomplete;
  incomplete.say_cells(1, 3);  // of four
  incomplete.tell_cells(1, {3'700'000, 3'000'000, 4'400'000});
  CHECK_FALSE(incomplete.is_true(FaultId::open_wire));
  World old(pack_of_threes());
  old.tell_cells(1, {3'700'000, 3'000'000, 4'400'000});
  old.now = start + 250ms;
  CHECK(old.is_true(FaultId::open_wire));
  old.now += 1ns;
  CHECK_FALSE(old.is_true(FaultId::open_wire));
}

TEST_CASE("a module is disturbed from the third damaged frame of ten on, and sound when ten have come",
          "[unit][faults]") {
  World world;
  const FaultId id = FaultId::module_disturbed;
  for (int damaged = 1; damaged <= 3; ++damaged) {
    CHECK_FALSE(world.is_true(id));
    world.now += 10ms;
    world.modules().note_damaged(2, world.now);
    CHECK(world.is_true(id) == (damaged >= 3));
    CHECK(world.read(id).is_partial == (damaged < 3));
  }
  CHECK(world.read(id).element == Element{.module_node = 2});
  CHECK(world.read(id).taken_at == start + 30ms);
  World first;
  first.modules().note_damaged(1, first.now);  // the healthy one after it does not hide it
  CHECK(first.read(id).is_partial);
}

TEST_CASE("a current while everything is open counts once the contacts had their time", "[unit][faults]") {
  World world;
  const FaultId id = FaultId::current_while_open;
  world.pack.current_mA = {50'000, start, Validity::valid};
  CHECK(world.read(id).is_known);
  CHECK(world.read(id).value == 0);
  const Duration timeout = world.config.contactors.feedback_timeout;
  world.flags.open_since = start - timeout;
  CHECK_FALSE(world.read(id).is_known);
  world.flags.open_since -= 1ns;
  CHECK(world.is_true(id));
  CHECK(world.read(id).taken_at == start);
  for (const std::int32_t current_mA : {1'001, -1'001, 1'000, -1'000, 0}) {
    world.pack.current_mA.value = current_mA;
    CHECK(world.is_true(id) == (std::abs(current_mA) > 1'000));
  }
  world.pack.current_mA = {50'000, start, Validity::out_of_range};
  CHECK_FALSE(world.read(id).is_known);
}

TEST_CASE("a link that stays at the voltage of an open pack counts once it had its time", "[unit][faults]") {
  World world;
  const FaultId id = FaultId::link_not_discharging;
  world.pack.pack_voltage_mV = {100'000, start, Validity::valid};
  world.pack.link_voltage_mV = {95'000, start, Validity::valid};
  CHECK(world.read(id).is_known);
  CHECK(world.read(id).value == 0);
  world.flags.open_since = start - world.config.contactors.link_decay;
  CHECK_FALSE(world.read(id).is_known);
  world.flags.open_since -= 1ns;
  CHECK(world.is_true(id));
  CHECK(world.read(id).taken_at == start);
  world.pack.link_voltage_mV.value = 94'999;
  CHECK_FALSE(world.is_true(id));
  world.pack.link_voltage_mV = {95'000, start, Validity::unknown};
  CHECK_FALSE(world.read(id).is_known);
  world.pack.link_voltage_mV = {95'000, start, Validity::valid};
  world.pack.pack_voltage_mV = {100'000, start, Validity::unknown};
  CHECK_FALSE(world.read(id).is_known);
}

TEST_CASE("an open pack's link is judged by voltages that were taken together, and both behind its time",
          "[unit][faults]") {
  World world;
  const FaultId id = FaultId::link_not_discharging;
  world.flags.open_since = start - world.config.contactors.link_decay;
  const auto is_judged = [&](Duration pack_at, Duration link_at) {
    world.pack.pack_voltage_mV = {100'000, start + pack_at, Validity::valid};
    world.pack.link_voltage_mV = {100'000, start + link_at, Validity::valid};
    return world.read(id).is_known;
  };
  CHECK(is_judged(1ns, 1ns));
  CHECK_FALSE(is_judged(0ns, 1ns));  // the pack voltage may be from before the opening, under load
  CHECK_FALSE(is_judged(1ns, 0ns));
  CHECK(is_judged(1ms, 6ms));
  CHECK_FALSE(is_judged(1ms, 6ms + 1ns));
  CHECK(is_judged(40ms, 20ms));
}

TEST_CASE("the rise of a temperature is judged in part while temperatures are missing", "[unit][faults][F8]") {
  World world;
  CHECK(world.read(FaultId::temperature_rise).is_partial);
  world.pack.cell_temperature_dC = {.count = 4, .expected = 4};
  CHECK_FALSE(world.read(FaultId::temperature_rise).is_partial);
}

TEST_CASE("a current against its cells is no question while everything is open", "[unit][faults]") {
  World world;
  CHECK_FALSE(world.read(FaultId::current_contradicts_voltage).is_known);
  world.flags.open_since = start;
  CHECK(world.read(FaultId::current_contradicts_voltage).is_known);
  CHECK_FALSE(world.is_true(FaultId::current_contradicts_voltage));
}

TEST_CASE("methods apart by more than they allow, and a cell that is none of its file's, are warned of",
          "[unit][faults][estimators]") {
  World world;
  for (const auto& [id, reading] : {std::pair{FaultId::soc_methods_disagree, &World::soc_disagreement_permille},
                                    std::pair{FaultId::cell_model_mismatch, &World::cell_misfit_permille}}) {
    CAPTURE(row_of(id).name);
    CHECK(row_of(id).reaction == Reaction::warn);
    (world.*reading).value = 999;
    CHECK_FALSE(world.is_true(id));
    (world.*reading).value = 1'000;
    (world.*reading).element = {.module_node = 2, .number = 1, .pack_number = 5};
    CHECK(world.is_true(id));
    CHECK(world.read(id).element.pack_number == 5);
    CHECK(world.read(id).taken_at == start);
    (world.*reading).is_known = false;
    CHECK_FALSE(world.read(id).is_known);
  }
}

TEST_CASE("what is used of a peak is known while the current is", "[unit][faults][BMS_NF.7]") {
  World world;
  world.config.current = {.discharge_continuous_mA = 10'000,
                          .discharge_peak_mA = 20'000,
                          .charge_continuous_mA = 10'000,
                          .charge_peak_mA = 20'000};
  world.watchers.overload.init(world.config.current);
  world.watchers.overload.observe({20'000, start - 1s, Validity::valid});
  world.watchers.overload.observe({20'000, start, Validity::valid});
  CHECK_FALSE(world.read(FaultId::discharge_overload).is_known);
  CHECK_FALSE(world.read(FaultId::charge_overload).is_known);
  world.pack.current_mA = {20'000, start, Validity::valid};
  CHECK(world.read(FaultId::discharge_overload).is_known);
  CHECK(world.read(FaultId::discharge_overload).value == 100);
  CHECK(world.read(FaultId::discharge_overload).taken_at == start);
  CHECK(world.read(FaultId::charge_overload).value == 0);
  world.watchers.overload.observe({-20'000, start + 1s, Validity::valid});
  world.watchers.overload.observe({-20'000, start + 2s, Validity::valid});
  CHECK(world.read(FaultId::charge_overload).value == 100);
  CHECK(world.read(FaultId::charge_overload).taken_at == start + 2s);
}

TEST_CASE("the mode and the supply that a module told of count as long as its status may be old, and no longer",
          "[unit][faults][MMU_A][MMU_S]") {
  using internal_bus::Mode;
  struct Case {
    FaultId id;
    Mode mode;
    bool on_module_supply;
  };
  const auto one = GENERATE(Case{FaultId::module_starting, Mode::starting, false},
                            Case{FaultId::module_going_to_sleep, Mode::going_to_sleep, false},
                            Case{FaultId::module_alone, Mode::autonomous, false},
                            Case{FaultId::module_supply_lost, Mode::normal, true},
                            Case{FaultId::module_supply_lost, Mode::autonomous, true});
  World world;
  CHECK_FALSE(world.is_true(one.id));
  world.say_status(2, [&one](CanFrame& frame) {
    write<internal_bus::status, "mode">(frame, static_cast<std::int64_t>(one.mode));
    write<internal_bus::status, "supply">(frame, one.on_module_supply ? 1 : 0);
  });
  world.now = start + world.config.ages.module_status;
  CHECK(world.is_true(one.id));
  CHECK(world.read(one.id).element == Element{.module_node = 2});
  CHECK(world.read(one.id).taken_at == start);
  CHECK(world.is_true(FaultId::module_supply_lost) == one.on_module_supply);
  CHECK(world.is_true(FaultId::module_alone) == (one.id == FaultId::module_alone));
  world.now += 1ns;
  CHECK_FALSE(world.is_true(one.id));
}

TEST_CASE("a low external supply of a module that is on it is no loss of its supply", "[unit][faults][MMU_7b]") {
  World world;
  world.say_status(2, [](CanFrame& frame) { write<internal_bus::status, "external_supply_low">(frame, 1); });
  CHECK(world.is_true(FaultId::module_warning));
  CHECK_FALSE(world.is_true(FaultId::module_supply_lost));
  CHECK(row_of(FaultId::module_warning).reaction == Reaction::warn);
  CHECK(row_of(FaultId::module_supply_lost).reaction == Reaction::open_now);
  CHECK(row_of(FaultId::module_supply_lost).confirm == 500ms);
}

TEST_CASE("each fault that a front end reports of itself is one, if it is reported at all", "[unit][faults][RR_7]") {
  struct Report {
    FaultId fault;
    bool supply_low;
    bool thermal_shutdown;
  };
  for (const Report& report :
       {Report{FaultId::front_end_supply_low, true, false}, Report{FaultId::front_end_overtemperature, false, true}}) {
    for (const bool is_reported : {false, true}) {
      World world;
      CHECK_FALSE(world.is_true(report.fault));
      world.now = start + 20ms;
      CanFrame frame = make_frame(internal_bus::module, 2);
      write<internal_bus::module, "front_end_faults_reported">(frame, is_reported);
      write<internal_bus::module, "front_end_supply_low">(frame, report.supply_low);
      write<internal_bus::module, "front_end_thermal_shutdown">(frame, report.thermal_shutdown);
      world.modules().observe(internal_bus::module, 2, frame, world.now);
      for (const FaultId id : {FaultId::front_end_supply_low, FaultId::front_end_overtemperature}) {
        CHECK(world.is_true(id) == (is_reported && id == report.fault));
      }
      if (!is_reported) continue;
      CHECK(world.read(report.fault).element == Element{.module_node = 2});
      CHECK(world.read(report.fault).taken_at == start + 20ms);
      CHECK(row_of(report.fault).reaction == Reaction::open_now);
      world.modules().forget_values();
      CHECK_FALSE(world.is_true(report.fault));
    }
  }
}

TEST_CASE("a module without the report that its pack file requires is a fault, an old report is no good",
          "[unit][faults][RR_7]") {
  const FaultId id = FaultId::front_end_faults_missing;
  CoreConfig config = test::small_pack();
  CHECK_FALSE(World(config).is_true(id));
  config.modules[1].must_report_front_end = true;
  World world(config);
  CHECK(world.is_true(id));
  CHECK(world.read(id).element == Element{.module_node = 2});
  CHECK(world.read(id).taken_at == start);
  world.now = start + 20ms;
  CanFrame frame = make_frame(internal_bus::module, 2);
  write<internal_bus::module, "front_end_faults_reported">(frame, 1);
  world.modules().observe(internal_bus::module, 2, frame, world.now);
  CHECK_FALSE(world.is_true(id));
  CHECK_FALSE(world.read(id).is_partial);
  world.now += world.config.ages.module_status;
  CHECK_FALSE(world.read(id).is_partial);
  world.now += 1ns;
  CHECK(world.read(id).is_partial);
  world.has_started = false;
  CHECK_FALSE(world.read(id).is_known);
}

TEST_CASE("an old report of one module leaves the report of front ends partial, whichever module follows",
          "[unit][faults][RR_7]") {
  CoreConfig config = test::small_pack();
  for (ModuleConfig& module : config.modules) module.must_report_front_end = true;
  World world(config);
  const auto report = [&world](std::size_t index, TimePoint at) {
    CanFrame frame = make_frame(internal_bus::module, world.config.modules[index].node);
    write<internal_bus::module, "front_end_faults_reported">(frame, 1);
    world.modules().observe(internal_bus::module, world.config.modules[index].node, frame, at);
  };
  const std::size_t count = config.modules.size();
  for (std::size_t old = 0; old < count; ++old) {
    CAPTURE(old);
    for (std::size_t index = 0; index < count; ++index) report(index, world.now);
    world.now += world.config.ages.module_status + 1ns;
    for (std::size_t index = 0; index < count; ++index) {
      if (index != old) report(index, world.now);
    }
    CHECK_FALSE(world.is_true(FaultId::front_end_faults_missing));
    CHECK(world.read(FaultId::front_end_faults_missing).is_partial);
  }
}

TEST_CASE("a module that is not set up is named, before anybody is asked nothing is known of it",
          "[unit][faults][MMU_UV]") {
  World world;
  CHECK_FALSE(world.is_true(FaultId::module_not_set_up));
  world.flags.module_not_set_up = 2;
  CHECK(world.is_true(FaultId::module_not_set_up));
  CHECK(world.read(FaultId::module_not_set_up).element == Element{.module_node = 2});
  world.has_started = false;
  CHECK_FALSE(world.read(FaultId::module_not_set_up).is_known);
}

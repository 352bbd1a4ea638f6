// Readings of the fault rows of insulation, of GPIO inputs beside those of the PDU, and of a second current sensor.
#include <array>
#include <cstdint>

#include "daemon/core/contactors/contactor_sequence.hpp"
#include "tests/support/fault_world.hpp"

using namespace bmu;
using bmu::test::start;
using World = bmu::test::FaultWorld;

namespace {

World world_that_measures() {
  World world;
  world.config.insulation.monitoring = InsulationMonitoring::measured;
  world.sensors.pdu.value.insulation_state = InsulationState::normal;
  world.sensors.pdu.value.insulation_resistance_Ohm = known(100'000);
  world.sensors.insulation_known_at = start;
  return world;
}

void fall_silent(World& world) {
  world.sensors.pdu.value.insulation_state = InsulationState::speed_start;
}

}  // namespace

TEST_CASE("emergency stops and interlocks on lines are numbered behind the unit's own", "[unit][faults][F93]") {
  World world;
  PduState& pdu = world.sensors.pdu.value;
  pdu.estops_pressed = 0b100;
  CHECK(world.read(FaultId::emergency_stop).element == Element{.input = 5});
  pdu.estops_pressed = 0b101;
  CHECK(world.read(FaultId::emergency_stop).element == Element{.input = 3});
  pdu.estop_2_released = false;
  CHECK(world.read(FaultId::emergency_stop).element == Element{.input = 2});
  pdu.estop_1_released = false;
  CHECK(world.read(FaultId::emergency_stop).element == Element{.input = 1});
  pdu.interlocks_open = 0b10;
  CHECK(world.read(FaultId::interlock_open).element == Element{.input = 3});
  pdu.interlock_closed = false;
  CHECK(world.read(FaultId::interlock_open).element == Element{.input = 1});
  world.now = start + 200ms + 1ns;  // the PDU is lost, and its values with it
  CHECK_FALSE(world.read(FaultId::emergency_stop).is_known);
  CHECK_FALSE(world.read(FaultId::interlock_open).is_known);
}

TEST_CASE("the resistance counts while the monitor measures, more than it can tell is plenty",
          "[unit][faults][F95][BMU_5]") {
  World world = world_that_measures();
  PduState& pdu = world.sensors.pdu.value;
  CHECK(world.read(FaultId::insulation_low).value == 100'000);
  CHECK(world.read(FaultId::insulation_low).taken_at == start);
  pdu.insulation_state = InsulationState::undervoltage;  // also reported for the monitored supply
  CHECK(world.read(FaultId::insulation_low).value == 100'000);
  pdu.insulation_resistance_Ohm = not_known(Validity::above_range);
  CHECK(world.read(FaultId::insulation_low).value == INT32_MAX);
  for (const Validity none : {Validity::unknown, Validity::sensor_fault}) {
    pdu.insulation_resistance_Ohm = not_known(none);
    CHECK_FALSE(world.read(FaultId::insulation_low).is_known);
  }
  pdu.insulation_resistance_Ohm = known(100'000);
  for (const InsulationState state : {InsulationState::no_signal, InsulationState::speed_start,
                                      InsulationState::device_error, InsulationState::earth_fault}) {
    pdu.insulation_state = state;
    CHECK_FALSE(world.read(FaultId::insulation_low).is_known);
  }
}

TEST_CASE("a low resistance opens while driving, too, unless the pack file says that it only warns there",
          "[unit][faults][F95][BMU_5]") {
  for (const bool opens_while_driving : {false, true}) {
    for (const bool is_driving : {false, true}) {
      World world = world_that_measures();
      world.config.insulation.opens_while_driving = opens_while_driving;
      world.flags.is_driving = is_driving;
      const bool only_warns = is_driving && !opens_while_driving;
      CHECK(world.read(FaultId::insulation_low).is_known == !only_warns);
      CHECK(world.read(FaultId::insulation_low_driving).is_known);
      CHECK(world.read(FaultId::insulation_low_driving).value == (only_warns ? 100'000 : INT32_MAX));
    }
  }
}

TEST_CASE("a monitor that says that it does not measure is lost, and one that does not come to a value",
          "[unit][faults][F96]") {
  const FaultId id = FaultId::insulation_monitor_lost;
  for (const InsulationState bad : {InsulationState::no_signal, InsulationState::device_error,
                                    InsulationState::earth_fault, InsulationState::undefined}) {
    World world = world_that_measures();
    CHECK_FALSE(world.is_true(id));
    world.sensors.pdu.value.insulation_state = bad;
    CHECK(world.is_true(id));
    CHECK(world.read(id).taken_at == start);
    world.config.insulation.monitoring = InsulationMonitoring::ok_line;  // no value is required then
    CHECK_FALSE(world.is_true(id));
  }
  World world = world_that_measures();
  fall_silent(world);
  world.now = world.sensors.pdu.taken_at = start + 20s;
  CHECK_FALSE(world.is_true(id));
  world.now = world.sensors.pdu.taken_at = start + 20s + 1ns;
  CHECK(world.is_true(id));
  world.sensors.pdu.value.insulation_state = InsulationState::normal;
  CHECK_FALSE(world.is_true(id));
  world.now += 200ms + 1ns;
  CHECK_FALSE(world.read(id).is_known);
}

TEST_CASE("what nobody measures any more is good, so that a lock of a time when it was measured can be cleared",
          "[unit][faults]") {
  World world;
  world.now = start + 5ms;
  CHECK(world.read(FaultId::current_sensors_disagree).is_known);
  CHECK(world.read(FaultId::current_sensors_disagree).value == 0);
  CHECK(world.read(FaultId::current_sensors_disagree).taken_at == world.now);
  CHECK(world.read(FaultId::insulation_low).is_known);
  CHECK(world.read(FaultId::insulation_low).value == INT32_MAX);
  CHECK(world.read(FaultId::insulation_low).taken_at == world.now);
  world.sensors.pdu.value.insulation_state = InsulationState::normal;
  world.sensors.pdu.value.insulation_resistance_Ohm = known(70'000);
  CHECK(world.read(FaultId::insulation_low).value == 70'000);  // not required, but available
  world.sensors.pdu = {};
  CHECK_FALSE(world.read(FaultId::insulation_low).is_known);
}

TEST_CASE("a monitor that has told a value once may no longer take its time", "[unit][faults][F96]") {
  const FaultId id = FaultId::insulation_monitor_lost;
  World world = world_that_measures();
  world.sensors.insulation_told = true;
  CHECK_FALSE(world.is_true(id));
  fall_silent(world);
  CHECK(world.is_true(id));
  world.sensors.pdu.value.insulation_state = InsulationState::normal;
  world.sensors.pdu.value.insulation_resistance_Ohm = not_known();
  CHECK(world.is_true(id));
}

TEST_CASE("a monitor that sees no voltage at a closed pack that has one is lost", "[unit][faults][F96]") {
  const FaultId id = FaultId::insulation_monitor_lost;
  World world = world_that_measures();  // eight cells, empty at 2.9 V
  world.sensors.pdu.value.insulation_state = InsulationState::undervoltage;
  world.pack.pack_voltage_mV = {23'201, start, Validity::valid};
  CHECK_FALSE(world.is_true(id));  // open, and the monitor may be on the DC link side
  world.flags.closed_since = start;
  CHECK(world.is_true(id));
  world.pack.pack_voltage_mV.value = 23'200;
  CHECK_FALSE(world.is_true(id));
  world.pack.pack_voltage_mV = {23'201, start, Validity::unknown};
  CHECK_FALSE(world.is_true(id));
  world.pack.pack_voltage_mV.validity = Validity::valid;
  world.sensors.pdu.value.insulation_state = InsulationState::normal;
  CHECK_FALSE(world.is_true(id));
}

TEST_CASE("a second current sensor is missed like the first, and compared with it", "[unit][faults][F20]") {
  World world;
  world.config.sensor.has_second_current = true;
  world.sensors.current_mA = {50'000, start, Validity::valid};
  CHECK(world.is_true(FaultId::current_sensor_lost));
  CHECK_FALSE(world.read(FaultId::current_sensors_disagree).is_known);
  world.now = start + 5ms;
  world.sensors.current_2_mA = {47'000, start + 5ms, Validity::valid};
  CHECK_FALSE(world.is_true(FaultId::current_sensor_lost));
  CHECK(world.read(FaultId::current_sensors_disagree).is_known);
  CHECK(world.read(FaultId::current_sensors_disagree).value == 3'000);
  CHECK(world.read(FaultId::current_sensors_disagree).taken_at == start + 5ms);
  world.sensors.current_2_mA.value = 53'000;
  CHECK(world.read(FaultId::current_sensors_disagree).value == 3'000);
  world.now = start + 200ms + 1ns;
  CHECK(world.is_true(FaultId::current_sensor_lost));
  CHECK(world.read(FaultId::current_sensor_lost).taken_at == start);
  CHECK_FALSE(world.read(FaultId::current_sensors_disagree).is_known);
  world.sensors.current_mA.taken_at = world.now;
  CHECK_FALSE(world.is_true(FaultId::current_sensor_lost));
  world.now = start + 205ms + 1ns;
  CHECK(world.is_true(FaultId::current_sensor_lost));
  CHECK(world.read(FaultId::current_sensor_lost).taken_at == start + 5ms);
  CHECK_FALSE(world.read(FaultId::current_sensors_disagree).is_known);
}

TEST_CASE("a forbidden current that nobody measures is not known", "[unit][faults][BMS_F.10]") {
  struct Case {
    FaultId fault;
    TimePoint CoreFlags::*since;
    std::int32_t current_mA;
  };
  const std::array cases{Case{FaultId::discharge_not_allowed, &CoreFlags::discharge_forbidden_since, 201},
                         Case{FaultId::charge_not_allowed, &CoreFlags::charge_forbidden_since, -small_current_mA - 1}};
  for (const Case& one : cases) {
    World world;
    CHECK_FALSE(world.is_true(one.fault));
    world.flags.*one.since = start;
    CHECK_FALSE(world.read(one.fault).is_known);
    const Duration grace = world.config.contactors.zero_current_grace;
    world.pack.current_mA = {one.current_mA, start + grace, Validity::valid};
    CHECK_FALSE(world.is_true(one.fault));
    world.pack.current_mA.taken_at += 1ns;
    CHECK(world.is_true(one.fault));
    CHECK(world.read(one.fault).taken_at == start + grace + 1ns);
    world.pack.current_mA.value -= one.current_mA > 0 ? 1 : -1;
    CHECK_FALSE(world.is_true(one.fault));
    world.pack.current_mA.value = -one.current_mA;
    CHECK_FALSE(world.is_true(one.fault));
  }
}

TEST_CASE("two cells are too few to tell an open wire from two different cells", "[unit][faults][F10]") {
  CoreConfig config = test::small_pack();
  for (ModuleConfig& module : config.modules) module.cell_count = 2;
  World world(config);
  world.tell_cells(1, {3'000'000, 4'400'000});
  CHECK_FALSE(world.is_true(FaultId::open_wire));
  World four;
  four.tell_cells(1, {3'700'000, 3'000'000, 4'400'000, 3'700'000});
  CHECK(four.is_true(FaultId::open_wire));
  CHECK(four.read(FaultId::open_wire).element == Element{.module_node = 1, .number = 2});
}

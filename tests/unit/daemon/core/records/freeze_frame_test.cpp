// Freeze frame of the pack at the confirmation of a fault: every known value, and no unknown one.
#include "daemon/core/records/freeze_frame.hpp"

#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

using namespace bmu;
using bmu::test::CoreBench;
using bmu::test::small_pack;

namespace {

constexpr Element low{.module_node = 1, .number = 1, .pack_number = 1};
constexpr Element high{.module_node = 2, .number = 3, .pack_number = 7};
constexpr TimePoint now{100s};

Spread spread(std::int32_t min, std::int32_t max) {
  return {.min = min, .max = max, .average = (min + max) / 2, .min_at = low, .max_at = high, .count = 2, .expected = 2};
}
Measured<std::int32_t> just_now(std::int32_t value) {
  return {value, now, Validity::valid};
}

/// Every value is known, and all numbers differ.
struct World {
  CoreConfig config = small_pack();
  FaultState fault;
  PackState pack{.cell_voltage_uV = spread(1, 3),
                 .cell_temperature_dC = spread(4, 6),
                 .board_temperature_dC = spread(7, 9),
                 .cell_voltage_sum_mV = just_now(10),
                 .module_voltage_sum_mV = just_now(11),
                 .pack_voltage_mV = just_now(12),
                 .link_voltage_mV = just_now(13),
                 .current_mA = just_now(14)};
  SensorTable sensors;
  CurrentLimits limits{.discharge = {.limit_mA = 15}, .charge = {.limit_mA = 16}};
  std::optional<std::int32_t> soc_permille = 21;
  OverloadCounter overload;

  World() {
    fault.confirmed = {.is_known = true, .value = 17, .element = high};
    fault.threshold = 18;
    sensors.current_2_mA = just_now(19);
    sensors.pdu = {{.main_negative_closed = true,
                    .vehicle_on = true,
                    .insulation_state = InsulationState::normal,
                    .insulation_resistance_Ohm = known(20)},
                   now,
                   Validity::valid};
    config.current = {.discharge_continuous_mA = 1'000,
                      .discharge_peak_mA = 2'000,
                      .charge_continuous_mA = 1'000,
                      .charge_peak_mA = 3'000};
    overload.init(config.current);
    overload.observe({2'000, now - 1s, Validity::valid});
    overload.observe({2'000, now, Validity::valid});
  }
  [[nodiscard]] FreezeFrame frozen() const {
    return freeze({.now = now,
                   .unix_time_ms = 22,
                   .config = config,
                   .fault = fault,
                   .pack = pack,
                   .sensors = sensors,
                   .limits = limits,
                   .soc_permille = soc_permille,
                   .overload = overload,
                   .outputs = {.main_negative = true, .fan = true},
                   .phase = Phase::precharge,
                   .mode = PackMode::closing,
                   .link_time_constant = 23s});
  }
};

}  // namespace

TEST_CASE("everything that is known is kept", "[unit][faults]") {
  const FreezeFrame frame = World().frozen();
  CHECK(frame.unix_time_ms == 22);
  CHECK(frame.value == 17);
  CHECK(frame.threshold == 18);
  CHECK(frame.element == high);
  CHECK(frame.phase == Phase::precharge);
  CHECK(frame.mode == PackMode::closing);
  CHECK(frame.cell_voltage_min_uV == 1);
  CHECK(frame.cell_voltage_average_uV == 2);
  CHECK(frame.cell_voltage_max_uV == 3);
  CHECK(frame.cell_voltage_min_at == low);
  CHECK(frame.cell_voltage_max_at == high);
  CHECK(frame.cell_voltage_sum_mV == 10);
  CHECK(frame.module_voltage_sum_mV == 11);
  CHECK(frame.cell_temperature_min_dC == 4);
  CHECK(frame.cell_temperature_average_dC == 5);
  CHECK(frame.cell_temperature_max_dC == 6);
  CHECK(frame.cell_temperature_min_at == low);
  CHECK(frame.cell_temperature_max_at == high);
  CHECK(frame.board_temperature_min_dC == 7);
  CHECK(frame.board_temperature_max_dC == 9);
  CHECK(frame.board_temperature_min_at == low);
  CHECK(frame.board_temperature_max_at == high);
  CHECK(frame.pack_voltage_mV == 12);
  CHECK(frame.link_voltage_mV == 13);
  CHECK(frame.link_time_constant_ms == 23'000);
  CHECK(frame.current_mA == 14);
  CHECK(frame.current_2_mA == 19);
  CHECK(frame.soc_permille == 21);
  CHECK(frame.insulation_Ohm == 20);
  CHECK(frame.discharge_limit_mA == 15);
  CHECK(frame.charge_limit_mA == 16);
  CHECK(frame.discharge_overload_permille == 100);
  CHECK(frame.charge_overload_permille == 0);
  CHECK(frame.outputs == ContactorOutputs{.main_negative = true, .fan = true});
  REQUIRE(frame.inputs.has_value());
  CHECK(frame.inputs->main_negative_closed);
  CHECK(frame.inputs->vehicle_on);
  CHECK(frame.inputs->insulation_state == InsulationState::normal);
}

TEST_CASE("of a sensor and a unit that have fallen silent nothing is kept", "[unit][faults]") {
  World world;
  world.sensors.current_2_mA.taken_at = now - world.config.ages.pack_current - 1ns;
  world.sensors.pdu.taken_at = now - world.config.ages.pdu_status - 1ns;
  const FreezeFrame frame = world.frozen();
  CHECK_FALSE(frame.current_2_mA.has_value());
  CHECK_FALSE(frame.inputs.has_value());
  CHECK_FALSE(frame.insulation_Ohm.has_value());
}

TEST_CASE("an insulation of which the monitor tells no number is none, and its state is kept", "[unit][faults]") {
  World world;
  world.sensors.pdu.value.insulation_resistance_Ohm = not_known(Validity::above_range);
  CHECK_FALSE(world.frozen().insulation_Ohm.has_value());
  world.sensors.pdu.value.insulation_resistance_Ohm = known(20);
  world.sensors.pdu.value.insulation_state = InsulationState::earth_fault;
  CHECK_FALSE(world.frozen().insulation_Ohm.has_value());
  CHECK(world.frozen().inputs->insulation_state == InsulationState::earth_fault);
}

TEST_CASE("what is not measured has no value", "[unit][faults]") {
  World world;
  world.pack = {};
  world.soc_permille = std::nullopt;
  const FreezeFrame frame = world.frozen();
  for (const std::optional<std::int32_t>& value :
       {frame.cell_voltage_min_uV, frame.cell_voltage_max_uV, frame.cell_voltage_average_uV, frame.cell_voltage_sum_mV,
        frame.module_voltage_sum_mV, frame.cell_temperature_min_dC, frame.cell_temperature_max_dC,
        frame.cell_temperature_average_dC, frame.board_temperature_min_dC, frame.board_temperature_max_dC,
        frame.pack_voltage_mV, frame.link_voltage_mV, frame.current_mA, frame.soc_permille}) {
    CHECK_FALSE(value.has_value());
  }
}

TEST_CASE("a pack that an emergency stop opens is kept as it was while closed", "[unit][faults][core]") {
  CoreBench bench(small_pack());
  REQUIRE(bench.close());
  bench.run(500ms);
  bench.inputs.estop_2_released = false;
  REQUIRE(bench.run_until([&] { return bench.is_active(FaultId::emergency_stop); }, 200ms));
  const auto& record = bench.core().persistent().faults[static_cast<std::size_t>(FaultId::emergency_stop)];
  REQUIRE(record.frame.has_value());
  const FreezeFrame& frame = *record.frame;
  CHECK(frame.phase == Phase::closed);
  CHECK(frame.mode == PackMode::driving);
  REQUIRE(frame.outputs.has_value());
  CHECK(frame.outputs->main_positive);
  REQUIRE(frame.inputs.has_value());
  CHECK_FALSE(frame.inputs->estop_2_released);
  CHECK(frame.inputs->main_positive_closed);
  CHECK(frame.cell_voltage_sum_mV == frame.pack_voltage_mV);
}

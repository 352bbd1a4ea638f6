// Internal state, and its value in each dialect of the traction-pack messages.
#include "daemon/core/vehicle/vehicle_state.hpp"

#include <set>
#include <string_view>
#include <utility>
#include <vector>

#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

using namespace bmu;

namespace {

struct Row {
  std::string_view name;
  ModeInputs in;
  PackMode mode;
  int iha;
  int original;
};

constexpr std::int32_t charging_mA = -small_current_mA - 1;
constexpr std::int32_t drawing_mA = small_current_mA + 1;

const std::vector<Row> rows{
    {"open and well", {}, PackMode::open, 4, 0},
    {"open, the key turned", {.vehicle_on = true}, PackMode::open, 4, 2},
    {"open, a charger there", {.charger_connected = true}, PackMode::open, 4, 8},
    {"open with a fault", {.fault_opens = true}, PackMode::fault, 0, 0},
    {"open with a fault, the key turned", {.fault_opens = true, .vehicle_on = true}, PackMode::fault, 0, 2},
    {"open with a fault, a charger there", {.fault_opens = true, .charger_connected = true}, PackMode::fault, 0, 8},
    {"resting", {.rest = RestPhase::resting, .fault_opens = true}, PackMode::resting, 0, 0},
    {"looking", {.rest = RestPhase::looking, .fault_opens = true}, PackMode::fault, 0, 0},
    {"main negative", {.phase = Phase::main_negative, .vehicle_on = true}, PackMode::closing, 4, 2},
    {"precharge", {.phase = Phase::precharge, .vehicle_on = true}, PackMode::closing, 4, 2},
    {"main positive", {.phase = Phase::main_positive, .charger_connected = true}, PackMode::closing, 4, 9},
    {"driving", {.phase = Phase::closed, .may_discharge = true, .vehicle_on = true}, PackMode::driving, 2, 4},
    {"closed, nobody asks", {.phase = Phase::closed, .may_discharge = true}, PackMode::closed, 3, 0},
    {"closed and charged by nobody we know",
     {.phase = Phase::closed, .may_discharge = true, .current_mA = charging_mA},
     PackMode::closed,
     3,
     1},
    {"closed and hardly charged",
     {.phase = Phase::closed, .may_discharge = true, .current_mA = -small_current_mA},
     PackMode::closed,
     3,
     0},
    {"charging",
     {.phase = Phase::closed, .may_discharge = true, .charger_connected = true, .current_mA = charging_mA},
     PackMode::charging,
     1,
     10},
    {"a charger there, and nothing flows",
     {.phase = Phase::closed, .may_discharge = true, .charger_connected = true, .current_mA = small_current_mA},
     PackMode::charging,
     1,
     10},
    {"a charger there, and current is drawn",
     {.phase = Phase::closed, .may_discharge = true, .charger_connected = true, .current_mA = drawing_mA},
     PackMode::charging,
     1,
     12},
    {"charging an empty pack",
     {.phase = Phase::closed, .has_fault = true, .charger_connected = true},
     PackMode::charge_only,
     1,
     10},
    {"closed within the grace of a fault",
     {.phase = Phase::closed, .fault_opens = true, .vehicle_on = true},
     PackMode::fault,
     0,
     4},
    {"driven with a fault that forbids charging alone",
     {.phase = Phase::closed, .has_fault = true, .may_discharge = true, .vehicle_on = true},
     PackMode::driving,
     2,
     4},
    {"open with a fault that forbids charging alone", {.has_fault = true}, PackMode::open, 4, 0},
    {"ramping down for a fault, the key turned",
     {.phase = Phase::ramp_down, .vehicle_on = true},
     PackMode::opening,
     3,
     4},
    {"ramping down", {.phase = Phase::ramp_down, .may_discharge = true}, PackMode::opening, 3, 0},
    {"breaking", {.phase = Phase::breaking, .current_mA = charging_mA}, PackMode::opening, 3, 1},
};

}  // namespace

TEST_CASE("each state has its name in every dialect", "[unit][vehicle][BMS_F.8][BMU_10]") {
  for (const Row& row : rows) {
    INFO(row.name);
    const PackMode mode = pack_mode(row.in);
    CHECK(to_text(mode) == to_text(row.mode));
    CHECK(iha_state(mode) == row.iha);
    CHECK(original_state(mode, row.in) == row.original);
  }
}

TEST_CASE("modes have names of their own, and no other number has one", "[unit][vehicle]") {
  std::set<std::string_view> names;
  for (std::size_t mode = 0; mode < pack_mode_count; ++mode) names.insert(to_text(static_cast<PackMode>(mode)));
  CHECK(names.size() == pack_mode_count);
  CHECK(names.count("?") == 0);
  CHECK(to_text(static_cast<PackMode>(pack_mode_count)) == "?");
}

TEST_CASE("elithion's state has a bit for a fault and one for each contactor", "[unit][vehicle][BMS_F.8]") {
  const FaultMemory none;
  CHECK(elithion_state({}) == 0);
  CHECK(elithion_state({.has_fault = true}) == 0b00001);
  CHECK(elithion_state({.outputs = {.main_positive = true}}) == 0b00010);
  CHECK(elithion_state({.outputs = {.precharge = true}}) == 0b00100);
  CHECK(elithion_state({.outputs = {.main_negative = true}}) == 0b01000);
  CHECK(elithion_state({.outputs = {.charge = true, .auxiliary = true, .fan = true, .heater = true}}) == 0);
  CHECK(elithion_state({.has_relay_fault = true}) == 0b10000);
  CHECK_FALSE(has_relay_fault(none));
  CHECK(elithion_faults(none).stored_code == 0);
  CHECK(elithion_faults(none).level_faults == 0);
  CHECK(elithion_faults(none).warnings == 0);
  CHECK(trouble_codes(none).first == 0);
  CHECK(trouble_codes(none).second == 0);
}

TEST_CASE("a failed precharge is elithion's relay fault, with its code", "[unit][core][vehicle][BMS_F.8]") {
  test::CoreBench bench(test::small_pack());
  bench.link_rise_mV_per_ms = 0;
  bench.run(1500ms);
  bench.inputs.vehicle_on = true;
  REQUIRE(bench.run_until([&] { return bench.is_active(FaultId::precharge_failed); }, 10s));
  CHECK(elithion_state(bench.core().mode_inputs(bench.now())) == 0b10001);
  CHECK(elithion_faults(bench.core().faults()).stored_code == 17);
  CHECK(elithion_faults(bench.core().faults()).level_faults == 0);  // only codes 1 to 8 have bits
}

TEST_CASE("elithion's warnings and level faults follow the cells, warned first, present later",
          "[unit][core][vehicle][BMS_F.8]") {
  struct Case {
    std::string_view name;
    void (*bring)(test::CoreBench& bench, bool beyond);
    std::uint8_t warnings;
    FaultId fault;
  };
  const std::vector<Case> cases{
      {"empty",
       [](test::CoreBench& bench, bool beyond) {
         bench.modules[0].cell_voltage_uV[0] = known(beyond ? 2'800'000 : 3'050'000);
       },
       0b00000001, FaultId::cell_undervoltage},
      {"full",
       [](test::CoreBench& bench, bool beyond) {
         bench.modules[0].cell_voltage_uV[0] = known(beyond ? 4'250'000 : 4'160'000);
       },
       0b00000010, FaultId::cell_overvoltage},
      {"cold",
       [](test::CoreBench& bench, bool beyond) {
         bench.modules[0].cell_temperature_dC[0] = known(beyond ? -250 : -60);
       },
       0b00010000, FaultId::cell_undertemperature},
      {"hot",
       [](test::CoreBench& bench, bool beyond) { bench.modules[0].cell_temperature_dC[0] = known(beyond ? 650 : 520); },
       0b00100000, FaultId::cell_overtemperature}};
  for (const Case& one : cases) {
    INFO(one.name);
    test::CoreBench bench(test::small_pack());
    bench.run(1500ms);
    const std::vector<test::BenchModule> good = bench.modules;
    one.bring(bench, false);
    bench.run(2s);
    REQUIRE_FALSE(bench.is_active(one.fault));
    CHECK(elithion_faults(bench.core().faults()).warnings == one.warnings);
    CHECK(elithion_faults(bench.core().faults()).level_faults == 0);
    one.bring(bench, true);
    bench.run(3s);
    REQUIRE(bench.is_active(one.fault));
    const ElithionFaults told = elithion_faults(bench.core().faults());
    CHECK(told.warnings == one.warnings);
    CHECK(told.stored_code == row_of(one.fault).lithiumate_code);
    const unsigned code = row_of(one.fault).lithiumate_code;  // the standard has none for cold
    CHECK(told.level_faults == (code == 0 ? 0 : 1U << (code - 1U)));
    bench.modules = good;
    bench.run(10s);
    const FaultStage stage = bench.core().faults().state(one.fault).stage;
    REQUIRE(stage != FaultStage::active);
    const bool is_latched = stage == FaultStage::latched;
    const ElithionFaults later = elithion_faults(bench.core().faults());
    CHECK(later.warnings == 0);
    CHECK(later.level_faults == 0);
    CHECK(later.stored_code == (is_latched ? code : 0));
  }
}

TEST_CASE("a pack too cold to charge tells trouble code 3, and the latest fault's code is stored",
          "[unit][core][vehicle][BMS_F.8]") {
  CoreConfig config = test::small_pack();
  config.limits.charge_undertemperature = {.warn = 50, .open = 0, .hysteresis = 10};
  test::CoreBench bench(config);
  bench.run(1500ms);
  bench.modules[1].cell_temperature_dC[1] = known(-20);
  bench.run(3s);
  REQUIRE(bench.is_active(FaultId::charge_undertemperature));
  CHECK(trouble_codes(bench.core().faults()).first == 3);
  CHECK(trouble_codes(bench.core().faults()).second == 0);
  bench.inputs.estop_1_released = false;
  bench.run(500ms);
  REQUIRE(bench.is_active(FaultId::emergency_stop));
  CHECK(elithion_faults(bench.core().faults()).stored_code == 2);
}

TEST_CASE("of three trouble codes the two that say most are told, the lowest first", "[unit][vehicle][BMS_F.8]") {
  const auto told = [](const std::vector<FaultId>& present) {
    FaultMemory faults;
    for (const FaultId id : present) faults.restore_lock(id, {}, 0, TimePoint{1s});
    const TroubleCodes codes = trouble_codes(faults);
    return std::pair<int, int>{codes.first, codes.second};
  };
  CHECK(told({FaultId::cell_resistance}) == std::pair{1, 0});
  CHECK(told({FaultId::pack_resistance}) == std::pair{2, 0});
  CHECK(told({FaultId::pack_resistance, FaultId::cell_resistance}) == std::pair{1, 2});
  CHECK(told({FaultId::charge_undertemperature, FaultId::pack_resistance}) == std::pair{2, 3});
  CHECK(told({FaultId::cell_resistance, FaultId::pack_resistance, FaultId::charge_undertemperature}) ==
        std::pair{1, 3});
}

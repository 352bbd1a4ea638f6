// Rows 1 to 20 of the catalogue: measurements of cells and pack.
#include <algorithm>
#include <string>

#include "protocol/tables/internal_bus.hpp"
#include "tests/catalogue/catalogue.hpp"
#include "tests/catalogue/frames.hpp"
#include "tests/support/catch.hpp"

namespace bmu::test {
namespace {

constexpr Duration voltage_budget = 450ms;
constexpr Duration temperature_budget = 950ms;
constexpr Duration communication_budget = 400ms;
/// Additional time of a jump: until the module has taken another sample and is polled again.
constexpr Duration jump_doubt = internal_bus::temperature_sampling_period + 20ms;

bool is_any_cells(const CanFrame& frame, const WiredPack& pack) {
  const MessageSpec* const row = internal_bus::catalogue.find(frame.id).message;
  const auto& blocks = internal_bus::cells_rows;
  return is_of_last_module(frame, pack) && std::find(std::begin(blocks), std::end(blocks), row) != std::end(blocks);
}

/// Voltage of a cell, as its module reports it, and the voltage sensors with it: otherwise their mismatch is the fault.
Act a_cell_really_at(const char* voltage_mV) {
  return [voltage_mV](WiredPack& pack) {
    const Plant& plant = pack.simulator().plant();
    const double before_mV = plant.cell(plant.cell_count() - 1).voltage_V * 1e3;
    const std::string offset_mV = std::to_string(std::stod(voltage_mV) - before_mV);
    pack.apply("cell $C voltage_mV " + std::string(voltage_mV) + "; sensor pack_voltage offset_mV " + offset_mV +
               "; sensor link_voltage offset_mV " + offset_mV);
  };
}

/// The second sensor of the last module's board, in whole degrees or as a code.
Act board_sensor_as(std::uint8_t raw) {
  return forging(is_message(internal_bus::temp_2), [raw](CanFrame& frame, const WiredPack&) { frame.data[3] = raw; });
}

/// Offset by a share of the true voltage.
void offset_pack_voltage(WiredPack& pack, int permille) {
  const int offset_mV = static_cast<int>(pack.simulator().plant().pack_V() * permille);
  pack.apply("sensor pack_voltage offset_mV " + std::to_string(offset_mV));
}

}  // namespace

FAULT(1, "a cell's voltage is too high", voltage_budget,
      {{.what = "a cell at 4.3 V",
        .inject = script("cell $C voltage_mV 4300"),
        .repair = script("cell $C voltage_mV auto"),
        .fault = "cell_overvoltage",
        .configured = seen::in_cells},
       {.what = "every cell at 4.3 V",
        .inject = on_every_cell("voltage_mV 4300"),
        .repair = on_every_cell("voltage_mV auto"),
        .fault = "cell_overvoltage",
        .configured = seen::in_cells}})

SLOW_FAULT(2, "one sample of a cell's voltage is too high", 0ms,
           {{.what = "a spike of 4.6 V for one sample of the module",
             .inject = for_a_while("cell $C voltage_mV 4600", 10ms, "cell $C voltage_mV auto"),
             .outcome = Outcome::stays_closed}})

TEST_CASE("F2: a spike is seen by the core and forgotten", "[catalogue][F2]") {
  WiredPack base = closed_pack(packs().front());
  std::size_t times_seen = 0;
  for (int shift = 0; shift < 22; ++shift, base.run(7ms)) {
    WiredPack pack = base;
    for_a_while("cell $C voltage_mV 4600", 10ms, "cell $C voltage_mV auto")(pack);
    const FaultId id = find_fault("cell_overvoltage")->id;
    const auto is_suspected = [id](const WiredPack& now) {
      return now.core().faults().state(id).stage == FaultStage::suspected;
    };
    if (!pack.run_until(is_suspected, 200ms)) continue;
    ++times_seen;
    pack.run(1s);
    CHECK(pack.core().faults().state(id).stage == FaultStage::good);
  }
  CHECK(times_seen > 0);
}

SLOW_FAULT(3, "a value stands exactly at its limit, or one step before", voltage_budget,
           {{.what = "a cell exactly at the limit of 4.2 V",
             .inject = script("cell $C voltage_mV 4200"),
             .repair = script("cell $C voltage_mV auto"),
             .fault = "cell_overvoltage",
             .configured = seen::in_cells},
            {.what = "a cell 0.1 mV below the upper limit",
             .inject = a_cell_really_at("4199.9"),
             .outcome = Outcome::stays_closed},
            {.what = "a cell exactly at the limit of 2.9 V",
             .inject = script("cell $C voltage_mV 2900"),
             .repair = script("cell $C voltage_mV auto"),
             .fault = "cell_undervoltage",
             .configured = seen::in_cells},
            {.what = "a cell 0.1 mV above the lower limit",
             .inject = a_cell_really_at("2900.1"),
             .outcome = Outcome::stays_closed}})

TEST_CASE("F3: an overvoltage is over only behind its hysteresis", "[catalogue][F3]") {
  WiredPack pack = closed_pack(packs().front());
  pack.apply("cell $C voltage_mV 4300");
  REQUIRE(pack.run_until([](const WiredPack& now) { return is_open(now, Until::command); }, 1s));
  pack.apply("cell $C voltage_mV 4180.1");  // the hysteresis is 20 mV
  pack.run(5s);
  pack.give(Command::clear_faults);
  pack.run(500ms);
  CHECK(is_present(pack, "cell_overvoltage"));
  pack.apply("cell $C voltage_mV 4179.9");
  pack.run(5s);
  CHECK(is_present(pack, "cell_overvoltage"));
  pack.give(Command::clear_faults);
  pack.run(500ms);
  CHECK_FALSE(is_present(pack, "cell_overvoltage"));
}

SLOW_FAULT(4, "a cell's voltage is too low under load", voltage_budget,
           {{.what = "a cell at 2.7 V while 40 A flow",
             .inject = script("cell $C voltage_mV 2700"),
             .repair = script("cell $C voltage_mV auto"),
             .fault = "cell_undervoltage",
             .configured = seen::in_cells,
             .prepare = script("load current_A 40")},
            {.what = "a cell at 3.0 V: less current is allowed, and that is all",
             .inject = a_cell_really_at("3000"),
             .outcome = Outcome::stays_closed,
             .prepare = script("load current_A 40"),
             .holds = [](const WiredPack& pack) {
               const CurrentLimit& limit = pack.core().limits().discharge;
               return limit.cause == LimitCause::cell_voltage_low && limit.limit_mA == 40'000;
             }}})

// From just below the limit on, by 8 C per second: faster than any cell, and no jump.
FAULT(6, "a cell is too hot", temperature_budget,
      {{.what = "a cell gets hotter than 60 C",
        .inject = script("cell $C temperature_dC ..650 over 0.63"),
        .repair = script("cell $C temperature_dC 250"),
        .fault = "cell_overtemperature",
        .configured = seen::in_temperatures,
        .prepare = script("cell $C temperature_dC 599.4"),
        .span = 620ms,
        .step = 23ms}})

// Not accepted before the module has taken another sample.
SLOW_FAULT(6, "a temperature jumps further than a cell can", temperature_budget + jump_doubt,
           {{.what = "a cell at 65 C from one moment to the next",
             .inject = script("cell $C temperature_dC 650"),
             .repair = script("cell $C temperature_dC 250"),
             .fault = "cell_overtemperature",
             .configured = seen::in_a_jump,
             .span = 620ms,
             .step = 23ms},
            {.what = "a board at 105 C from one moment to the next",
             .inject = script("module $N board_temperature_dC 1050"),
             .repair = script("module $N board_temperature_dC 250"),
             .fault = "board_overtemperature",
             .configured = seen::in_a_jump,
             .span = 620ms,
             .step = 23ms},
            {.what = "a cell at 65 C in one sample of its module",
             .inject = for_a_while("cell $C temperature_dC 650", internal_bus::temperature_sampling_period,
                                   "cell $C temperature_dC 250"),
             .outcome = Outcome::stays_closed,
             .span = 620ms,
             .step = 23ms},
            {.what = "a cell at -50 C in one sample of its module",
             .inject = for_a_while("cell $C temperature_dC -500", internal_bus::temperature_sampling_period,
                                   "cell $C temperature_dC 250"),
             .outcome = Outcome::stays_closed,
             .span = 620ms,
             .step = 23ms},
            {.what = "a board at 120 C in one sample of its module",
             .inject = for_a_while("module $N board_temperature_dC 1200", internal_bus::temperature_sampling_period,
                                   "module $N board_temperature_dC 250"),
             .outcome = Outcome::stays_closed,
             .span = 620ms,
             .step = 23ms}})

FAULT(6, "a cell is too cold", temperature_budget,
      {{.what = "the pack gets colder than -20 C under load",
        .inject = script("pack temperature_dC ..-250 over 0.63"),
        .repair = script("pack temperature_dC 250; pack ambient_dC 250"),
        .fault = "cell_undertemperature",
        .configured = seen::in_temperatures,
        .prepare = script("pack temperature_dC -199.4; pack ambient_dC -199.4; load current_A 40"),
        .span = 620ms,
        .step = 23ms}})

SLOW_FAULT(9, "a temperature sensor is open or shorted", temperature_budget,
           {{.what = "a temperature sensor is open",
             .inject = script("thermistor $T state open"),
             .repair = script("thermistor $T state ok"),
             .fault = "temperature_not_measured",
             .configured = seen::in_temperatures,
             .span = 620ms,
             .step = 23ms},
            {.what = "a temperature sensor is shorted",
             .inject = script("thermistor $T state shorted"),
             .repair = script("thermistor $T state ok"),
             .fault = "temperature_not_measured",
             .configured = seen::in_temperatures,
             .span = 620ms,
             .step = 23ms},
            {.what = "a fitted temperature sensor told as not fitted",
             .inject = forging(is_message(internal_bus::temp_1),
                               [](CanFrame& frame, const WiredPack&) { frame.data[0] = 0x80, frame.data[1] = 0; }),
             .repair = heal,
             .fault = "temperature_not_measured",
             .configured = seen::in_cells}})

FAULT(9, "a module's board sensor is open, shorted or gone", temperature_budget,
      {{.what = "a board sensor is open or shorted",
        .inject = board_sensor_as(0x7F),
        .repair = heal,
        .fault = "temperature_not_measured",
        .configured = seen::in_cells},
       {.what = "a fitted board sensor told as not fitted",
        .inject = board_sensor_as(0x80),
        .repair = heal,
        .fault = "temperature_not_measured",
        .configured = seen::in_cells},
       {.what = "a module's board temperatures do not come",
        .inject = losing(is_message(internal_bus::temp_2)),
        .repair = heal,
        .fault = "temperature_not_measured",
        .configured = seen::in_temperature_silence}})

FAULT(11, "a fitted cell is told as not fitted", communication_budget,
      {{.what = "three fitted cells told as not fitted",
        .inject = forging(is_message(internal_bus::cells_1), cells_as(0xFFFF)),
        .repair = heal,
        .fault = "cell_not_measured",
        .configured = seen::in_cells}})

FAULT(13, "all cells of a module at 0 or at the end of the range", communication_budget,
      {{.what = "all cells of a module told as 0 V, checksums right",
        .inject = forging(is_any_cells, cells_as(0)),
        .repair = heal,
        .fault = "cell_undervoltage",
        .configured = seen::in_cells},
       {.what = "all cells of a module told as FFFFh, checksums right",
        .inject = forging(is_any_cells, cells_as(0xFFFF)),
        .repair = heal,
        .fault = "cell_not_measured",
        .configured = seen::in_cells},
       {.what = "all cells of a module told as FFFEh, 6.5534 V, checksums right",
        .inject = forging(is_any_cells, cells_as(0xFFFE)),
        .repair = heal,
        .fault = "cell_overvoltage",
        .configured = seen::in_cells}})

FAULT(14, "the sum of the cells is not the pack voltage", 1s,
      {{.what = "the pack voltage sensor tells 4 % less than there is",
        .inject = [](WiredPack& pack) { offset_pack_voltage(pack, -40); },
        .repair = script("sensor pack_voltage offset_mV 0"),
        .fault = "pack_voltage_mismatch",
        .configured = seen::in_pack_voltage},
       {.what = "the pack voltage sensor tells 4 % more than there is",
        .inject = [](WiredPack& pack) { offset_pack_voltage(pack, 40); },
        .repair = script("sensor pack_voltage offset_mV 0"),
        .fault = "pack_voltage_mismatch",
        .configured = seen::in_pack_voltage}})

FAULT(16, "too much current", voltage_budget,
      {{.what = "150 A out of the pack",
        .inject = script("load current_A 150"),
        .repair = script("load current_A 0"),
        .fault = "discharge_overcurrent",
        .configured = seen::in_current,
        .span = 40ms,
        .step = 1ms,
        .is_seen_open = false},
       {.what = "45 A into the pack",
        .inject = script("load current_A -45"),
        .repair = script("load current_A 0"),
        .fault = "charge_overcurrent",
        .configured = seen::in_current,
        .span = 40ms,
        .step = 1ms,
        .is_seen_open = false}})

FAULT(17, "the current sensor is silent or says that its result is none", 300ms,
      {{.what = "no current from the sensor",
        .inject = script("sensor current silent"),
        .repair = script("sensor current talking"),
        .fault = "current_sensor_lost",
        .configured = seen::in_current_silence},
       {.what = "the sensor flags each current as wrong",
        .inject = script("sensor current error on"),
        .repair = script("sensor current error off"),
        .fault = "current_sensor_lost",
        .configured = seen::in_current_silence},
       {.what = "no pack voltage from the sensor",
        .inject = script("sensor pack_voltage silent"),
        .repair = script("sensor pack_voltage talking"),
        .fault = "voltage_sensor_lost",
        .configured = seen::in_voltage_silence},
       {.what = "no link voltage from the sensor",
        .inject = script("sensor link_voltage silent"),
        .repair = script("sensor link_voltage talking"),
        .fault = "voltage_sensor_lost",
        .configured = seen::in_voltage_silence}})

}  // namespace bmu::test

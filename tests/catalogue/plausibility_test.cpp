// Rows 5 to 20 of the catalogue again: faults that need more configuration to be monitored, and checks of one
// measurement against another.
#include <algorithm>
#include <cstdlib>
#include <string>

#include "protocol/tables/internal_bus.hpp"
#include "tests/catalogue/catalogue.hpp"
#include "tests/catalogue/frames.hpp"
#include "tests/support/catch.hpp"

namespace bmu::test {
namespace {

constexpr Duration voltage_budget = 450ms;
constexpr Duration temperature_budget = 950ms;

void with_deep_discharge(CoreConfig& config) {
  config.limits.cell_deep_discharge = {.warn = 2'400'000, .open = 2'000'000, .hysteresis = 50'000};
}
/// Charged by any device on the DC link.
void with_charge_temperatures(CoreConfig& config) {
  config.limits.charge_overtemperature = {.warn = 420, .open = 450, .hysteresis = 20, .confirm = 100ms};
  config.limits.charge_undertemperature = {.warn = 50, .open = 0, .hysteresis = 10, .confirm = 100ms};
}
void with_charge_contactor(CoreConfig& config) {
  with_charge_temperatures(config);
  config.contactors.has_charge_contactor = true;
}
void with_temperature_rise(CoreConfig& config) {
  config.limits.temperature_rise = LimitsConfig{}.temperature_rise;
}
/// Lets the cells respond to a current as far as the monitors need.
void with_resistance(CoreConfig& config) {
  config.cell.series_resistance_Ohm = 0.001;
}
void with_imbalance(CoreConfig& config) {
  config.limits.cell_imbalance = {.warn = 200'000, .open = 400'000, .hysteresis = 50'000, .confirm = 300ms};
}
/// The current limit falls between 300 and 400 mV.
void with_imbalance_limit(CoreConfig& config) {
  with_imbalance(config);
  config.limits.cell_imbalance.limit = 300'000;
}
void with_second_sensor(CoreConfig& config) {
  config.sensor.has_second_current = true;
  config.limits.current_sensors_disagree = {.warn = 2'500, .open = 5'000, .hysteresis = 1'000, .confirm = 500ms};
}

/// Its channel shows 350 mV less than the cell has.
void a_cell_below_the_others(WiredPack& pack) {
  const Plant& plant = pack.simulator().plant();
  const double others_mV = plant.cell(plant.cell_count() - 1).voltage_V * 1e3;
  pack.apply("cell $C voltage_mV " + std::to_string(others_mV - 350.0));
}
/// The limit is half of that without the cells' difference: 350 mV, of 300 to 400.
bool is_half_for_imbalance(const CurrentLimit& limit, std::int32_t unhindered_mA) {
  const std::int32_t tolerance_mA = unhindered_mA / 100;
  return limit.cause == LimitCause::cell_imbalance && std::abs(limit.limit_mA - unhindered_mA / 2) <= tolerance_mA;
}

/// Repeats the last module's present cell and module voltages permanently, with counters that go on.
Act stuck_cells() {
  return [](WiredPack& pack) {
    forging(
        [is_module = is_message(internal_bus::module)](const CanFrame& frame, const WiredPack& now) {
          const bool is_cells = is_of_last_module(frame, now) && frame.id >= 0x140 && frame.id < 0x240;
          return is_cells || is_module(frame, now);
        },
        [old = pack.last_sent()](CanFrame& frame, const WiredPack&) {
          const CanFrame& before = old.at(frame.id);
          std::copy_n(before.data.begin(), 6, frame.data.begin());
        })(pack);
  };
}

}  // namespace

FAULT(5, "a cell is deeply discharged", voltage_budget,
      {{.what = "a cell at 1.5 V",
        .inject = script("cell $C voltage_mV 1500"),
        .repair = script("cell $C voltage_mV auto"),
        .fault = "cell_deep_discharge",
        .configured = seen::in_cells,
        .fit = with_deep_discharge}})

TEST_CASE("F5: the lock after a deep discharge survives a restart", "[catalogue][F5]") {
  WiredPack pack = closed_pack(packs().front());
  CoreConfig config = pack.config();
  with_deep_discharge(config);
  WiredPack first(config);
  REQUIRE(first.close());
  first.apply("cell $C voltage_mV 1500");
  REQUIRE(first.run_until([](const WiredPack& now) { return is_present(now, "cell_deep_discharge"); }, 1s));
  Core next(config, WiredPack::start);
  next.restore(first.core().persistent());
  static_cast<void>(next.decide(WiredPack::start));
  CHECK(next.faults().state(find_fault("cell_deep_discharge")->id).is_present());
}

SLOW_FAULT(6, "a cell is too hot to be charged", temperature_budget,
           {{.what = "a cell gets hotter than 45 C while a charger charges",
             .inject = script("cell $C temperature_dC ..500 over 0.63"),
             .repair = script("cell $C temperature_dC 250"),
             .fault = "charge_overtemperature",
             .configured = seen::in_temperatures,
             .prepare = script("cell $C temperature_dC 449.4; charger current_A 10"),
             .fit = with_charge_temperatures,
             .switch_on = "charger connected",
             .switch_off = "charger disconnected",
             .span = 620ms,
             .step = 23ms},
            {.what = "a cell gets hotter than 45 C while charger and vehicle are on, behind a charge contactor",
             .inject = script("cell $C temperature_dC ..500 over 0.63"),
             .fault = "charge_overtemperature",
             .configured = seen::in_temperatures,
             .until = Until::charge,
             .prepare = script("cell $C temperature_dC 449.4; charger current_A 10"),
             .fit = with_charge_contactor,
             .switch_on = "vehicle on; charger connected",
             .span = 620ms,
             .step = 23ms,
             .has_way_back = false,
             .holds = [](const WiredPack& pack) { return pack.commanded().main_positive; }}})

SLOW_FAULT(7, "a cell is too cold to be charged", temperature_budget,
           {{.what = "the pack gets colder than 0 C while a charger charges",
             .inject = script("pack temperature_dC ..-50 over 0.63"),
             .repair = script("pack temperature_dC 250; pack ambient_dC 250"),
             .fault = "charge_undertemperature",
             .configured = seen::in_temperatures,
             .prepare = script("pack temperature_dC 0.6; pack ambient_dC 0.6; charger current_A 10"),
             .fit = with_charge_temperatures,
             .switch_on = "charger connected",
             .switch_off = "charger disconnected",
             .span = 620ms,
             .step = 23ms},
            {.what = "the pack gets colder than 0 C while charger and vehicle are on, behind a charge contactor",
             .inject = script("pack temperature_dC ..-50 over 0.63"),
             .fault = "charge_undertemperature",
             .configured = seen::in_temperatures,
             .until = Until::charge,
             .prepare = script("pack temperature_dC 0.6; pack ambient_dC 0.6; charger current_A 10"),
             .fit = with_charge_contactor,
             .switch_on = "vehicle on; charger connected",
             .span = 620ms,
             .step = 23ms,
             .has_way_back = false,
             .holds = [](const WiredPack& pack) { return pack.commanded().main_positive; }}})

// The rate is the mean of two seconds: at 8 C/s it is beyond 1 C/s after 0.25 s, and the budget begins there.
FAULT(8, "a cell's temperature rises fast", 250ms + temperature_budget,
      {{.what = "a cell's temperature rises by 8 C a second",
        .inject = script("cell $C temperature_dC ..590 over 4.25"),
        .repair = script("cell $C temperature_dC 250"),
        .fault = "temperature_rise",
        .configured = seen::in_temperature_trend,
        .fit = with_temperature_rise,
        .span = 620ms,
        .step = 23ms}})

// The rate is the mean of two seconds: at 5 C/s it is beyond 1 C/s after 0.4 s, and the budget begins there.
FAULT(8, "a cell's temperature rises", 450ms + temperature_budget,
      {{.what = "a cell's temperature rises by 5 C a second",
        .inject = script("cell $C temperature_dC ..590 over 6.8"),
        .repair = script("cell $C temperature_dC 250"),
        .fault = "temperature_rise",
        .fit = with_temperature_rise,
        .span = 620ms,
        .step = 23ms,
        .has_way_back = false}})

FAULT(10, "a cell's measuring wire is off", 500ms,
      {{.what = "a cell's measuring wire is off",
        .inject = script("cell $C wire open"),
        .repair = script("cell $C wire closed"),
        .fault = "open_wire",
        .configured = seen::in_cells}})

FAULT(12, "values stand still", 10s,
      {{.what = "a module's cell voltages stand still while the current changes",
        .inject = stuck_cells(),
        .repair = heal,
        .fault = "stuck_values",
        .prepare = script("load profile drive"),
        .fit = with_resistance,
        .step = 75ms,
        .is_seen_open = false}})

// The flattest stretch of the packs' curve is 1 mV for a thousandth of 50 Ah: 5 mV are due after 0.25 Ah. Then the 8 s
// of the limit begin.
SLOW_FAULT(12, "values stand still at a steady current", 32s,
           {{.what = "a module repeats what it said last while 40 A are drawn: 22.5 s, and 8 s",
             .inject = script("module $N stuck on"),
             .repair = script("module $N stuck off"),
             .fault = "stuck_values",
             .prepare = script("load current_A 40"),
             .fit = with_resistance,
             .step = 150ms,
             .is_seen_open = false}})
SLOW_FAULT(12, "values stand still while a charger charges", 55s,
           {{.what = "a module repeats what it said last while a charger charges with 20 A: 45 s, and 8 s",
             .inject = script("module $N stuck on"),
             .repair = script("module $N stuck off"),
             .fault = "stuck_values",
             .prepare = script("charger current_A 20"),
             .fit = with_resistance,
             .switch_on = "charger connected",
             .switch_off = "charger disconnected",
             .step = 150ms,
             .is_seen_open = false}})

SLOW_FAULT(15, "the cells are far apart", 1s,
           {{.what = "a cell 500 mV below the others",
             .inject = script("cell $C voltage_mV 3200"),
             .repair = script("cell $C voltage_mV auto"),
             .fault = "cell_imbalance",
             .configured = seen::in_cells,
             .fit = with_imbalance},
            {.what = "a cell 500 mV below the others while 40 A flow",
             .inject = script("cell $C voltage_mV 3200"),
             .repair = script("cell $C voltage_mV auto"),
             .fault = "cell_imbalance",
             .configured = seen::in_cells,
             .prepare = script("load current_A 40"),
             .fit = with_imbalance},
            {.what = "a cell 350 mV below the others: less current is allowed, and that is all",
             .inject = a_cell_below_the_others,
             .outcome = Outcome::stays_closed,
             .fit = with_imbalance_limit,
             .holds = [](const WiredPack& pack) {
               const CurrentLimits& limits = pack.core().limits();
               return is_half_for_imbalance(limits.discharge, pack.config().current.discharge_continuous_mA) &&
                      is_half_for_imbalance(limits.charge, pack.config().current.charge_continuous_mA);
             }}})

FAULT(18, "the current sensor has the wrong sign", 1s,
      {{.what = "the sensor says charging as soon as 20 A are drawn",
        .inject = script("sensor current inverted on; load current_A 20"),
        .repair = script("load current_A 0; sensor current inverted off"),
        .fault = "current_contradicts_voltage",
        .fit = with_resistance,
        .is_seen_open = false}})

FAULT(19, "current flows though everything is open", 300ms,
      {{.what = "5 A in an open pack",
        .inject = script("sensor current value_mA 5000"),
        .fault = "current_while_open",
        .configured = seen::in_current,
        .until = Until::told,
        .in_phase = Phase::open,
        .has_way_back = false},
       {.what = "5 A in an open pack from the start",
        .inject = script("sensor current value_mA 5000"),
        .fault = "current_while_open",
        .outcome = Outcome::never_closes}})

FAULT(20, "two current sensors disagree", 1s,
      {{.what = "the two current sensors are 10 A apart",
        .inject = script("sensor current offset_mA 10000"),
        .repair = script("sensor current offset_mA 0"),
        .fault = "current_sensors_disagree",
        .fit = with_second_sensor},
       {.what = "the second current sensor is silent",
        .inject = script("sensor current_2 silent"),
        .repair = script("sensor current_2 talking"),
        .fault = "current_sensor_lost",
        .configured = seen::in_current_silence,
        .fit = with_second_sensor}})

}  // namespace bmu::test

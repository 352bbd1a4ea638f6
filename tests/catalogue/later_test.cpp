// Rows whose mechanism is not built yet, as they must be: not run by themselves, `test_catalogue "[.later]"` tries
// them. The names of faults are those planned; one that the table does not know fails.
#include <algorithm>

#include "protocol/tables/internal_bus.hpp"
#include "tests/catalogue/catalogue.hpp"
#include "tests/catalogue/frames.hpp"
#include "tests/support/catch.hpp"

namespace bmu::test {
namespace {

constexpr Duration voltage_budget = 450ms;
constexpr Duration temperature_budget = 950ms;

/// 620h to 628h, from somebody else on the vehicle's bus.
void foreign_report(WiredPack& pack) {
  pack.observe(FrameReceived{Port::vehicle, data_frame(0x622, 8)});
}

/// A module nobody configured answers each POLL.
Act unknown_module() {
  return [](WiredPack& pack) {
    pack.on_sent = [](CanFrame& frame, const WiredPack& now) {
      if (!is_of_last_module(frame, now)) return Fate{};
      CanFrame other = frame;
      other.id += 1;
      reseal(other, other.data[6]);
      return Fate{.twin = other};
    };
  };
}

/// Bus-off, back after 100 ms, and again, every 10 s.
Act bus_off_storm() {
  return [](WiredPack& pack) {
    pack.each_ms = [ms = 0](WiredPack& now) mutable {
      const int moment = ms++ % 10'000;
      if (moment == 0) now.observe(BusErrorSeen{Port::internal, 0x040});
      if (moment == 100) now.observe(BusErrorSeen{Port::internal, 0x100});
    };
  };
}

/// What the last module said of its cells, for ever, with counters that go on.
Act stuck_cells() {
  return [](WiredPack& pack) {
    forging([](const CanFrame& frame,
               const WiredPack& now) { return is_of_last_module(frame, now) && frame.id >= 0x140 && frame.id < 0x240; },
            [old = pack.last_sent()](CanFrame& frame, const WiredPack&) {
              const CanFrame& before = old.at(frame.id);
              std::copy_n(before.data.begin(), 6, frame.data.begin());
            })(pack);
  };
}

}  // namespace

LATER_FAULT(5, "a cell is deeply discharged", voltage_budget,
            {{.what = "a cell at 1.5 V",
              .inject = script("cell $C voltage_mV 1500"),
              .repair = script("cell $C voltage_mV auto"),
              .fault = "cell_deep_discharge",
              .configured = seen::in_cells,
              .has_way_back = false}})

LATER_FAULT(6, "a cell is too hot to be charged", temperature_budget,
            {{.what = "a cell at 50 C while it is charged",
              .inject = script("cell $C temperature_dC 500"),
              .repair = script("cell $C temperature_dC 250"),
              .fault = "charge_overtemperature",
              .configured = seen::in_temperatures,
              .prepare = script("load current_A -10")}})

LATER_FAULT(7, "a cell is too cold to be charged", temperature_budget,
            {{.what = "a cell at -5 C while it is charged",
              .inject = script("cell $C temperature_dC -50"),
              .repair = script("cell $C temperature_dC 250"),
              .fault = "charge_undertemperature",
              .configured = seen::in_temperatures,
              .prepare = script("load current_A -10")}})

LATER_FAULT(8, "a cell's temperature rises fast", temperature_budget,
            {{.what = "a cell's temperature rises by 5 C a second",
              .inject = script("cell $C temperature_dC ..590 over 6.8"),
              .repair = script("cell $C temperature_dC 250"),
              .fault = "temperature_rise",
              .configured = seen::in_temperatures}})

LATER_FAULT(10, "a cell's measuring wire is off", 500ms,
            {{.what = "a cell's measuring wire is off",
              .inject = script("cell $C wire open"),
              .repair = script("cell $C wire closed"),
              .fault = "open_wire",
              .configured = seen::in_cells}})

LATER_FAULT(12, "values stand still", 10s,
            {{.what = "a module's cell voltages stand still while the current changes",
              .inject = stuck_cells(),
              .repair = heal,
              .fault = "stuck_values",
              .prepare = script("load profile drive")}})

LATER_FAULT(15, "the cells are far apart", 1s,
            {{.what = "a cell 500 mV below the others",
              .inject = script("cell $C voltage_mV 3400"),
              .repair = script("cell $C voltage_mV auto"),
              .fault = "cell_imbalance",
              .configured = seen::in_cells}})

LATER_FAULT(18, "the current sensor has the wrong sign", 1s,
            {{.what = "the sensor says charging while 60 A are drawn",
              .inject = script("load current_A 60; sensor current value_mA -20000"),
              .repair = script("load current_A 0; sensor current value_mA auto"),
              .fault = "current_contradicts_voltage"}})

LATER_FAULT(19, "current flows though everything is open", 300ms,
            {{.what = "5 A in an open pack",
              .inject = script("sensor current value_mA 5000"),
              .repair = script("sensor current value_mA auto"),
              .fault = "current_while_open",
              .outcome = Outcome::never_closes}})

LATER_FAULT(20, "two current sensors disagree", 1s,
            {{.what = "the current and the sensor's charge counter disagree",
              .inject = script("sensor current offset_mA 10000"),
              .repair = script("sensor current offset_mA 0"),
              .fault = "current_sensors_disagree"}})

LATER_FAULT(31, "a module nobody configured", 1s,
            {{.what = "a module nobody configured answers from the start",
              .inject = unknown_module(),
              .fault = "unknown_module",
              .outcome = Outcome::never_closes},
             {.what = "a module nobody configured begins to answer",
              .inject = unknown_module(),
              .fault = "unknown_module",
              .outcome = Outcome::stays_closed}})

LATER_FAULT(38, "somebody else sends the pack's reports", 100ms,
            {{.what = "a stranger sends 622h on the vehicle's bus",
              .inject = foreign_report,
              .fault = "foreign_reporter",
              .outcome = Outcome::stays_closed}})

LATER_FAULT(45, "bus-off again and again", 100ms,
            {{.what = "bus-off every ten seconds, the third time",
              .inject =
                  [](WiredPack& pack) {
                    bus_off_storm()(pack);
                    pack.run(20s);
                  },
              .repair = heal,
              .fault = "bus_off_storm",
              .until = Until::decision}})

LATER_FAULT(47, "error passive is told", 1s,
            {{.what = "error passive",
              .inject =
                  [](WiredPack& pack) {
                    pack.observe(BusErrorSeen{Port::internal, 0x004});
                  },
              .fault = "error_passive",
              .outcome = Outcome::stays_closed}})

LATER_FAULT(82, "a contactor is welded", 300ms,
            {{.what = "main positive is welded, and everything should be open",
              .inject = script("contactor main_positive welded"),
              .fault = "contactor_welded",
              .outcome = Outcome::never_closes}})

LATER_FAULT(87, "the precharge is there at once", 100ms,
            {{.what = "the link is at the pack's voltage as soon as main negative is closed",
              .inject = {},
              .repair = script("contactor main_positive ok"),
              .fault = "precharge_too_fast",
              .in_phase = Phase::precharge,
              .prepare = script("precharge resistance_Ohm 0.1"),
              .is_seen_open = false}})

LATER_FAULT(88, "too much current during the precharge", 100ms,
            {{.what = "the link is shorted during the precharge",
              .inject = {},
              .repair = script("link bleed_Ohm 10000; precharge resistance_Ohm 100"),
              .fault = "precharge_overcurrent",
              .in_phase = Phase::precharge,
              .prepare = script("link bleed_Ohm 1; precharge resistance_Ohm 10"),
              .is_seen_open = false}})

LATER_FAULT(91, "opening under a high current waits for it, and not long", 250ms,
            {{.what = "the insulation is low while 90 A flow: the current is asked away first",
              .inject = script("insulation resistance_kOhm 10"),
              .repair = script("insulation resistance_kOhm 1200"),
              .fault = "insulation_low",
              .prepare = script("load current_A 90")}})

LATER_FAULT(95, "the insulation is low", 1s,
            {{.what = "the insulation is below 500 Ohm for each volt",
              .inject = script("insulation resistance_kOhm 10"),
              .repair = script("insulation resistance_kOhm 1200"),
              .fault = "insulation_low",
              .configured = seen::in_a_line}})

LATER_FAULT(96, "the insulation monitor does not work", 2s,
            {{.what = "the insulation monitor gives no signal",
              .inject = script("insulation monitor no_signal"),
              .repair = script("insulation monitor normal"),
              .fault = "insulation_monitor_lost",
              .configured = seen::in_a_line},
             {.what = "the insulation monitor reports an error of its own",
              .inject = script("insulation monitor device_error"),
              .repair = script("insulation monitor normal"),
              .fault = "insulation_monitor_lost",
              .configured = seen::in_a_line}})

LATER_FAULT(97, "the charger gives more than it was asked for", voltage_budget,
            {{.what = "the charger gives 25 A, asked for 10",
              .inject = script("charger current_A 25"),
              .repair = script("charger current_A 0"),
              .fault = "charger_runaway",
              .prepare = script("charger connected; charger current_A 10"),
              .is_seen_open = false}})

LATER_FAULT(98, "the charger is silent", 1s,
            {{.what = "the charger is silent while it charges",
              .inject = script("charger disconnected"),
              .fault = "charger_lost",
              .prepare = script("charger connected; charger current_A 10"),
              .is_seen_open = false}})

LATER_FAULT(99, "the charger goes on after it was stopped", voltage_budget,
            {{.what = "5 A go on flowing into the pack when no charging is allowed",
              .inject = script("load current_A -5; cell $C voltage_mV 4190"),
              .repair = script("load current_A 0; cell $C voltage_mV auto"),
              .fault = "charge_not_allowed",
              .is_seen_open = false}})

LATER_FAULT(102, "the supply is low", 20ms,
            {{.what = "the supply is low",
              .inject = forging(is_message(internal_bus::status),
                                [](CanFrame& frame, const WiredPack&) {
                                  write<internal_bus::status, "external_supply_low">(frame, 1);
                                }),
              .fault = "supply_low",
              .outcome = Outcome::never_closes}})

}  // namespace bmu::test

// Rows 82 to 103 of the catalogue: contactors, precharge, hard wires.
#include "protocol/tables/internal_bus.hpp"
#include "tests/catalogue/catalogue.hpp"
#include "tests/catalogue/frames.hpp"
#include "tests/support/catch.hpp"

namespace bmu::test {
namespace {

/// Applies `on` and `off` in turns, without end.
Act flickering(std::string_view on, std::string_view off, int on_ms, int off_ms) {
  return [=](WiredPack& pack) {
    pack.each_ms = [=, ms = 0](WiredPack& now) mutable {
      const int moment = ms++ % (on_ms + off_ms);
      if (moment == 0) now.apply(on);
      if (moment == on_ms) now.apply(off);
    };
  };
}

}  // namespace

FAULT(83, "a contactor does not close", 300ms,
      {{.what = "main negative does not close",
        .inject = {},
        .repair = script("contactor main_negative ok"),
        .fault = "contactor_feedback",
        .configured = seen::in_a_contact_that_stays,
        .in_phase = Phase::main_negative,
        .prepare = script("contactor main_negative stuck_open"),
        .is_seen_open = false},
       {.what = "main positive does not close",
        .inject = {},
        .repair = script("contactor main_positive ok"),
        .fault = "contactor_feedback",
        .configured = seen::in_a_contact_that_stays,
        .in_phase = Phase::main_positive,
        .prepare = script("contactor main_positive stuck_open"),
        .is_seen_open = false}})

SLOW_FAULT(
    84, "an auxiliary contact flickers", 300ms,
    {{.what = "an auxiliary contact of a closed contactor opens for 5 ms",
      .inject = for_a_while("contactor main_positive feedback open", 5ms, "contactor main_positive feedback auto"),
      .outcome = Outcome::stays_closed},
     {.what = "an auxiliary contact of a closed contactor says open",
      .inject = script("contactor main_positive feedback open"),
      .repair = script("contactor main_positive feedback auto"),
      .fault = "contactor_feedback",
      .configured = seen::in_a_contact,
      .is_seen_open = false},
     {.what = "an auxiliary contact opens for 20 ms of each 25",
      .inject = flickering("contactor main_positive feedback open", "contactor main_positive feedback auto", 20, 5),
      .repair = all({heal, script("contactor main_positive feedback auto")}),
      .fault = "contactor_feedback",
      .configured = seen::in_a_contact,
      .is_seen_open = false}})

FAULT(85, "auxiliary contact and voltage contradict each other", 500ms,
      {{.what = "main positive is open, its auxiliary contact says closed",
        .inject = script("contactor main_positive feedback closed; contactor main_positive stuck_open; "
                         "link bleed_Ohm 1"),
        .repair = script("contactor main_positive feedback auto; contactor main_positive ok; "
                         "link bleed_Ohm 10000"),
        .fault = "link_not_following",
        .configured = seen::in_pack_voltage,
        .is_seen_open = false}})

FAULT(89, "the link voltage is not known during the precharge", 400ms,
      {{.what = "no link voltage from the sensor during the precharge",
        .inject = script("sensor link_voltage silent"),
        .repair = script("sensor link_voltage talking"),
        .fault = "voltage_sensor_lost",
        .configured = seen::in_voltage_silence,
        .in_phase = Phase::precharge}})

FAULT(90, "closing is asked for while a fault is present", 0ms,
      {{.what = "a cell is too high, and the key is turned",
        .inject = script("cell $C voltage_mV 4300"),
        .fault = "cell_overvoltage",
        .outcome = Outcome::never_closes,
        .holds =
            [](const WiredPack& pack) {
              const RefusalRecord& refusal = pack.core().last_refusal();
              return refusal.has_happened && refusal.blocker == Blocker::fault;
            }},
       {.what = "the pack is too cold, and the key is turned",
        .inject = script("pack temperature_dC -250"),
        .fault = "cell_undertemperature",
        .outcome = Outcome::never_closes,
        .holds = [](const WiredPack& pack) { return pack.core().last_refusal().has_happened; }}})

FAULT(93, "an emergency stop is pressed", 20ms,
      {{.what = "emergency stop 1 is pressed",
        .inject = script("estop 1 pressed"),
        .repair = script("estop 1 released"),
        .fault = "emergency_stop",
        .configured = seen::in_a_line},
       {.what = "emergency stop 2 is pressed",
        .inject = script("estop 2 pressed"),
        .repair = script("estop 2 released"),
        .fault = "emergency_stop",
        .configured = seen::in_a_line}})

FAULT(94, "an emergency stop bounces", 20ms,
      {{.what = "an emergency stop is pressed for 2 ms",
        .inject = for_a_while("estop 1 pressed", 2ms, "estop 1 released"),
        .fault = "emergency_stop",
        .configured = seen::in_a_line},
       {.what = "an emergency stop bounces, 1 ms on and 1 ms off",
        .inject = flickering("estop 1 pressed", "estop 1 released", 1, 1),
        .repair = all({heal, script("estop 1 released")}),
        .fault = "emergency_stop",
        .configured = seen::in_a_line}})

FAULT(100, "the interlock opens", 100ms,
      {{.what = "the interlock opens",
        .inject = script("interlock open"),
        .repair = script("interlock closed"),
        .fault = "interlock_open",
        .configured = seen::in_a_line}})

FAULT(100, "the plug is pulled under load", 100ms,
      {{.what = "the charger is pulled out while it charges, and 10 A go on flowing through its parting contacts",
        .inject = script("charger disconnected; load current_A -10"),
        .fault = "",
        .prepare = script("charger current_A 10"),
        .switch_on = "charger connected"}})

FAULT(101, "the power distribution unit is silent or contradicts its command", 300ms,
      {{.what = "the power distribution unit is silent",
        .inject = script("pdu silent"),
        .repair = script("pdu talking"),
        .fault = "pdu_lost",
        .configured = seen::in_pdu_silence},
       {.what = "a closed contactor opens by itself",
        .inject = script("contactor main_negative stuck_open"),
        .repair = script("contactor main_negative ok"),
        .fault = "contactor_feedback",
        .configured = seen::in_a_contact,
        .is_seen_open = false},
       {.what = "the precharge contactor is closed in a closed pack",
        .inject = script("contactor precharge welded"),
        .repair = script("contactor precharge ok"),
        .fault = "contactor_welded",
        .configured = seen::in_a_contact}})

}  // namespace bmu::test

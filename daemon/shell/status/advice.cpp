#include "daemon/shell/status/advice.hpp"

#include <array>

namespace bmu {

namespace {

struct CauseRow {
  FaultId id;
  std::string_view cause;
};

// In the order of FaultId.
constexpr std::array<CauseRow, fault_count> cause_table{{
    {FaultId::cell_undervoltage,
     "empty pack; one cell weaker than the others; poor cell joint (voltage drop under load only)"},
    {FaultId::cell_overvoltage,
     "one cell fuller than the others reaches the end of charge first; charger exceeds its limit; regenerative braking "
     "into a full pack"},
    {FaultId::cell_deep_discharge,
     "storage in an empty state; standby load on the pack; for a single cell: internal short, or module powered by it"},
    {FaultId::cell_imbalance,
     "weak cell under load; poor joint; module replaced with a different SOC; balancing switched off for a long time"},
    {FaultId::cell_resistance, "loose or corroded joint at the cell; faster ageing than its neighbours, e.g. by heat"},
    {FaultId::pack_resistance, "aged cells; cell file of a different cell type"},
    {FaultId::cell_overtemperature, "losses above the cooling capacity; fan failed; hot joint next to the cell"},
    {FaultId::cell_undertemperature, "frost; sensor detached from the cell"},
    {FaultId::charge_overtemperature, "charging right after a hard drive, or in the sun"},
    {FaultId::charge_undertemperature, "cold pack (charging would cause lithium plating)"},
    {FaultId::board_overtemperature,
     "many cells balanced at once without air flow over the board; module in the waste heat of the cells"},
    {FaultId::board_undertemperature, "frost: front end below its specified temperature range"},
    {FaultId::temperature_rise,
     "internal short of a cell; high-resistance joint; less often an intermittent sensor connection"},
    {FaultId::temperature_spread, "uneven cooling; one joint worse than the others; sensor detached from its cell"},
    {FaultId::discharge_overcurrent,
     "short circuit behind the contactors; current limit of the motor controller above the pack file; current sensor "
     "counts in the wrong direction (`sensor/invert_current`), so that a charge reads as a load"},
    {FaultId::charge_overcurrent,
     "current limit of the charger or of regenerative braking above the pack file; current sensor counts in the wrong "
     "direction (`sensor/invert_current`), so that each load reads as a charge"},
    {FaultId::discharge_overload,
     "load above the continuous limit for longer than the peak duration, e.g. a long climb; vehicle ignores the "
     "published limit; current sensor counts in the wrong direction (`sensor/invert_current`)"},
    {FaultId::charge_overload,
     "charger or regeneration (e.g. a long descent) above the continuous limit; the source ignores the published "
     "limit; current sensor counts in the wrong direction (`sensor/invert_current`)"},
    {FaultId::discharge_not_allowed,
     "load on the DC link that bmud does not switch (e.g. a DC/DC converter) while the pack is closed for charging "
     "only; current sensor counts in the wrong direction (`sensor/invert_current`), so that the charge reads as a "
     "load"},
    {FaultId::charge_not_allowed,
     "charger or motor controller ignores the charge limit, or does not receive the vehicle bus; current sensor counts "
     "in the wrong direction (`sensor/invert_current`)"},
    {FaultId::current_while_open,
     "contactor does not open; current path that bypasses the contactors, e.g. a converter at the pack's own "
     "terminals; zero offset of the sensor"},
    {FaultId::pack_voltage_mismatch,
     "voltage wire of the sensor on the wrong side of a fuse; blown fuse; a module too many or too few in the pack "
     "file (`modules`)"},
    {FaultId::module_voltage_mismatch, "poor contact of a sense wire; front end out of calibration"},
    {FaultId::stuck_values, "front end or firmware repeats its last values"},
    {FaultId::current_contradicts_voltage,
     "inverted direction (`sensor/invert_current`); sensor on the wrong conductor; frozen sensor value"},
    {FaultId::current_sensors_disagree,
     "zero offset; different measuring ranges; a conductor that passes through only one of the sensors; second sensor "
     "mounted in another direction than `sensor/second_is_reversed`"},
    {FaultId::soc_methods_disagree,
     "offset or gain error of the current sensor; capacity in the cell file too high for the aged cells"},
    {FaultId::cell_model_mismatch, "cell file of a different cell; faulty current sensor; defective cell"},
    {FaultId::module_lost,
     "failure of the external supply (powered by its own cells a module is silent); loose connector; missing bus "
     "termination; wrong node number"},
    {FaultId::cell_not_measured, "broken or loose sense wire; blown fuse in it; cell connected to the wrong input"},
    {FaultId::temperature_not_measured, "sensor unplugged; damaged wire; wrong sensor type"},
    {FaultId::open_wire, "sense wire detached from its cell; blown fuse in it"},
    {FaultId::module_disturbed,
     "interference from a motor cable; missing shield or termination; two senders with the same identifier"},
    {FaultId::module_reports_fault,
     "limits exceeded on the module before bmud opened the contactors; self-test of the front end failed"},
    {FaultId::module_reports_undervoltage, "empty cell, detected by the module in parallel to bmud"},
    {FaultId::module_warning, "board hot from balancing; low module supply; unreadable sensor"},
    {FaultId::module_starting, "module just powered or woken; if it persists: no communication with the front end"},
    {FaultId::module_going_to_sleep,
     "falling module supply; second master or tool on the bus that sent the sleep command"},
    {FaultId::module_alone, "firmware does not detect the polls that it answers"},
    {FaultId::balancing_stays_on,
     "shorted balancing transistor; firmware runs a balancing time that was not commanded"},
    {FaultId::balancing_stays_off, "open balancing resistor or transistor; blown fuse in the sense wire"},
    {FaultId::balancing_refused, "board too hot according to the module; firmware without balancing"},
    {FaultId::module_mismatch,
     "module of another manufacturer or firmware, or with another number of temperature sensors than in the pack file"},
    {FaultId::wrong_cell_count, "pack file copied and not adapted; wire of the topmost cells detached"},
    {FaultId::module_exchanged, "module replaced and not yet accepted"},
    {FaultId::modules_swapped, "two modules swapped during a repair"},
    {FaultId::module_not_set_up, "module restarts repeatedly; firmware does not support the command"},
    {FaultId::duplicate_node, "new module with its factory node number; settings copied from another module"},
    {FaultId::unknown_module, "module added but not in the pack file; wrong node number of a module"},
    {FaultId::current_sensor_lost,
     "supply or connector of the sensor; wrong bitrate; measurement channel not enabled in the sensor; values in the "
     "other byte order (`sensor/little_endian`)"},
    {FaultId::voltage_sensor_lost,
     "voltage wire detached; channel not enabled, or sent more slowly than every 60 ms; values in the other byte order "
     "(`sensor/little_endian`)"},
    {FaultId::sensor_not_set_up,
     "sensor never configured, or configured by another tool for another pack; settings lost because they were not "
     "stored; another sensor than in sensor/protocol"},
    {FaultId::pdu_lost, "supply or connector of the PDU; bus wire broken between the PDU and this host"},
    {FaultId::pdu_opened_by_itself,
     "no contactor command received for 200 ms: bus errors, stalled host, or PDU supply dip when the contactors pulled "
     "in"},
    {FaultId::emergency_stop, "emergency stop pressed; broken wire (reads as pressed)"},
    {FaultId::interlock_open, "cover, connector or service disconnect not fully closed; broken wire (reads as open)"},
    {FaultId::supply_low, "empty auxiliary battery; converter does not feed it"},
    {FaultId::lines_failed, "unplugged GPIO chip; line in use by another process; missing permission of the service"},
    {FaultId::insulation_fault,
     "moisture or dirt in a connector; chafed insulation; charger or heater with a path to earth; monitor without "
     "supply (reads as not OK)"},
    {FaultId::insulation_low,
     "moisture or dirt in a connector; chafed insulation; charger or heater with a path to earth"},
    {FaultId::insulation_low_driving,
     "moisture or dirt in a connector; chafed insulation; heater or converter with a path to earth"},
    {FaultId::insulation_monitor_lost,
     "signal wire or earth wire of the monitor detached; missing earth connection detected by the monitor"},
    {FaultId::insulation_monitor_untested, "monitor switched on without a self-test command; self-test does not end"},
    {FaultId::precharge_failed,
     "load on the DC link during precharge; open precharge resistor or contactor; DC link capacitance too large for "
     "`contactors/precharge_timeout_ms`, or for `contactors/precharge_energy_J`, which ends an attempt before the "
     "timeout"},
    {FaultId::precharge_too_fast,
     "no load behind the contactors; shorted precharge resistor; welded main contactor; DC link capacitance smaller "
     "than `contactors/precharge_min_ms` requires"},
    {FaultId::precharge_overcurrent,
     "short circuit behind the contactors; resistance of the precharge resistor too low for "
     "`contactors/precharge_overcurrent_mA`"},
    {FaultId::contactor_feedback,
     "coil without supply; loose connector; auxiliary contact wired inverted (`active_low`)"},
    {FaultId::contactor_welded,
     "closing with insufficient precharge; opening above the breaking capacity of the contacts"},
    {FaultId::link_not_following, "burnt contact; blown fuse behind the contactor; DC link wire of the sensor"},
    {FaultId::link_not_discharging,
     "both main contactors welded; DC link without discharge resistor, or with one that takes longer than "
     "`contactors/link_decay_ms`; rotating motor"},
    {FaultId::charger_silent,
     "mains failure; mains plug pulled; connector of the charger's bus; charger with another bitrate than "
     "`interfaces/charger_kbit_per_s`"},
    {FaultId::charger_runaway,
     "second charger that is not in the pack file; charger set by hand; wrong protocol (`charger/protocol`)"},
    {FaultId::charger_keeps_on, "enable input of the charger wired to another signal; second charger"},
    {FaultId::charger_trouble,
     "weak mains; hot surroundings; charge contactor open while the charger measures the battery"},
    {FaultId::charger_contradicts,
     "load that bypasses the sensor; sensor on the wrong conductor or in the wrong direction "
     "(`sensor/invert_current`); charger that is not in the pack file (`charger/units`)"},
    {FaultId::foreign_charger_master, "another master of the charger, or the manufacturer's tool, on the same bus"},
    {FaultId::foreign_charger_commands, "another master of the charger, or the manufacturer's tool, on the same bus"},
    {FaultId::inverter_silent,
     "inverter switched off; broken wire; wrong bitrate; model that sends no keep-alive: set `inverter/silence_max_ms` "
     "to 0"},
    {FaultId::inverter_lost,
     "inverter switched off; broken wire; wrong bitrate; model that sends no keep-alive: set `inverter/silence_max_ms` "
     "to 0"},
    {FaultId::inverter_trouble, "overload; heat; grid outside its limits; the number is in the inverter's manual"},
    {FaultId::foreign_battery, "second battery on the inverter's bus; log replayed onto the bus"},
    {FaultId::foreign_master,
     "second master that started to send while this one ran; tool that polls or commands; log replayed onto the bus"},
    {FaultId::foreign_reporter, "second pack or old master with the same identifiers; log replayed onto the bus"},
    {FaultId::second_pack_silent,
     "master of the second pack without supply, or with another base identifier (`second_pack/base_id`) or bitrate "
     "(`interfaces/second_pack_kbit_per_s`) than in the pack file"},
    {FaultId::internal_bus_down, "unplugged CAN adapter; interface not brought up after boot"},
    {FaultId::bus_off_storm,
     "short circuit between the bus wires; node with another bitrate than `buses/internal_kbit_per_s`; no termination "
     "at all"},
    {FaultId::bus_error_passive, "only one terminator; wires too long for the bitrate; no other node to acknowledge"},
    {FaultId::command_not_on_bus,
     "no acknowledgement (all other nodes unpowered); bus saturated by frames of higher priority"},
    {FaultId::frames_lost, "overloaded CPU; receive buffer limited to the kernel default"},
    {FaultId::control_loop_gap, "process with higher priority; host suspended; virtual machine paused"},
    {FaultId::tick_overrun, "host too busy or too slow"},
    {FaultId::store_unreadable, "worn or full disk; file edited by hand"},
    {FaultId::store_write_failed, "full disk; disk read-only after an error; missing permission of the service"},
    {FaultId::history_write_failed, "full disk; disk read-only after an error; damaged database"},
    {FaultId::clock_jump, "time synchronised by network after boot (always on a host without a real-time clock)"},
    {FaultId::memory_low, "software defect in bmud"},
    {FaultId::disk_low, "recordings or logs of bmud or of other programs"},
    {FaultId::front_end_supply_low, "broken wire or fuse between the topmost cell and the front end; empty module"},
    {FaultId::front_end_overtemperature, "balancing resistors without cooling; short circuit on the module's board"},
    {FaultId::front_end_faults_missing, "module with earlier firmware; front end does not respond to the module"},
    {FaultId::module_supply_lost, "fuse or wire of the external supply; auxiliary supply of the pack switched off"},
    {FaultId::alarm_loop_open,
     "overcharged or hot cell while the daemon did not open; module asleep or without supply; broken wire of the loop"},
}};

// In the order of Blocker.
constexpr std::array<BlockerAdvice, blocker_count> advice_table{{
    {Blocker::shutting_down, "The daemon was stopped: it opens the contactors and exits.",
     "restart the service to use the pack"},
    {Blocker::fault,
     "At least one confirmed fault has a reaction above \"warn\". All of them are listed with their element. A fault "
     "that ends with \"cause gone, waiting for\" needs only the named command; for the others the cause persists.",
     "look each one up with `bmuctl faults`, remove the cause, then clear the latched ones"},
    {Blocker::resting,
     "After an undervoltage without operator action the master put the modules to sleep to save the cells. "
     "Measurements are taken only at the periodic wake-up (every five minutes by default).",
     "press the resume button, connect the charger or run `bmuctl wake`; then charge"},
    {Blocker::internal_bus_down, "The CAN interface of the internal bus is down, missing or bus-off.",
     "bring the interface up (`ip link`); check the adapter and its wires"},
    {Blocker::pdu_unknown,
     "No PDU_STATUS within `ages/pdu_status_ms`, or the GPIO lines of this host that provide a part of it cannot be "
     "read: the state of contactors and inputs is unknown. The missing source is named.",
     "check the PDU's supply and bus wires, or the `gpio` section of the pack file"},
    {Blocker::inputs_unhealthy,
     "A safety input is tripped now, whether or not the fault is confirmed. Each input is named: emergency stop, "
     "interlock, OK line of the insulation monitor, or a PDU that opened by itself.",
     "release or close the named input; then check which faults need a clear"},
    {Blocker::insulation_unknown,
     "With `insulation/monitoring` set to `measured`, a resistance must be reported first. After power-up the monitor "
     "may take 20 s and reports \"speed start\" until then.",
     "wait for the monitor; if it does not report: check its supply, signal wire and earth connection"},
    {Blocker::modules_incomplete,
     "Every configured module must have answered within `ages`, with every cell and temperature of the pack file. "
     "Missing modules and sensors are listed with the age of their last answer.",
     "check supply, bus wires and node number of the listed modules"},
    {Blocker::sensors_incomplete, "The missing quantity and its age are listed.",
     "check the sensor's supply, bus and voltage wires, and which channels it is configured to send"},
    {Blocker::not_qualified,
     "After a start, a stall or a lost bus, three consecutive complete poll cycles of all modules are required (0.3 s "
     "at the normal poll rate).",
     "wait one second; if it persists, `bmuctl modules` shows which module misses answers"},
    {Blocker::modules_not_set_up,
     "A module has not yet acknowledged the cell limits of the pack, or refuses them. It would protect its cells with "
     "its own limits.",
     "wait one second; a module that refuses has different firmware: replace or update it"},
    {Blocker::suspicion,
     "A value exceeds its threshold, but not yet for its confirm time. The fault will be confirmed or withdrawn within "
     "that time.",
     "wait one second and query again"},
    {Blocker::commands_not_on_bus,
     "Sent commands were not echoed: no other node acknowledges, or the bus is saturated.",
     "check the supply of the other nodes, wires and termination, and the bus load (`bmudump --follow`)"},
    {Blocker::contacts_unsettled, "The auxiliary contacts have not matched the command for the settling time.",
     "wait one second; if it persists, `bmuctl status` names the contactor: check its coil and auxiliary contact"},
    {Blocker::contactor_closed, "All contactors are commanded open, but an auxiliary contact reads closed.",
     "measure by hand before touching anything: the contactor may be welded, or its auxiliary contact wired inverted"},
    {Blocker::link_follows,
     "The DC link has pack voltage with all contactors open. After an opening this is its residual charge; if it "
     "persists, both main contactors may be welded.",
     "wait until the DC link is discharged; if it does not discharge, measure by hand"},
    {Blocker::precharge_hot, "The precharge resistor has absorbed `contactors/precharge_energy_J` and must cool down.",
     "wait; then find out why precharge needs several attempts"},
    {Blocker::locked_out,
     "After an opening by a fault, a failed precharge or an exit with closed contactors, the lockout time must elapse; "
     "the remaining time is shown.",
     "wait for the remaining time"},
    {Blocker::no_claim,
     "A daemon that starts, or whose bus was down or control loop stalled, receives before it commands anything: for "
     "0.15 to 0.4 s with a power distribution unit, for three polls at the idle poll rate without one. If it receives "
     "a frame that only a master sends, it ends with exit code 71 and `second master`.",
     "wait one second; if the daemon ends, find the other master (`bmudump`) and stop it"},
}};

constexpr bool is_half_sentence(std::string_view text) {
  return !text.empty() && text.back() != '.' && !(text.front() >= 'A' && text.front() <= 'Z');
}
consteval bool causes_are_in_order() {
  for (std::size_t index = 0; index < cause_table.size(); ++index) {
    if (static_cast<std::size_t>(cause_table[index].id) != index || !is_half_sentence(cause_table[index].cause))
      return false;
  }
  return true;
}
consteval bool advice_is_in_order() {
  for (std::size_t index = 0; index < advice_table.size(); ++index) {
    const BlockerAdvice& row = advice_table[index];
    if (static_cast<std::size_t>(row.blocker) != index || !is_half_sentence(row.remedy)) return false;
    if (row.meaning.empty() || row.meaning.back() != '.') return false;
  }
  return true;
}
static_assert(causes_are_in_order());
static_assert(advice_is_in_order());

}  // namespace

std::string_view usual_cause_of(FaultId id) {
  return cause_table.at(static_cast<std::size_t>(id)).cause;
}

const BlockerAdvice& advice_on(Blocker blocker) {
  return advice_table.at(static_cast<std::size_t>(blocker));
}

}  // namespace bmu

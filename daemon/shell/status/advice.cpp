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
     "the pack is empty; or one cell is weaker than the others and is empty before them; or its joint is poor, which "
     "costs voltage only while current flows"},
    {FaultId::cell_overvoltage,
     "one cell is fuller than the others and reaches the end of the charge first; or the charger gives more than it is "
     "told; or braking feeds a full pack"},
    {FaultId::cell_deep_discharge,
     "the pack was stored empty, or something draws from it while nobody looks; a single cell: a short within it, or a "
     "module that lives on it"},
    {FaultId::cell_imbalance,
     "a weak cell under load, a poor joint, a cell with another charge after modules were exchanged, or balancing that "
     "has been off for long"},
    {FaultId::cell_resistance,
     "a loose or corroded joint beside the cell; a cell that ages faster than its neighbours, as one that gets hotter"},
    {FaultId::pack_resistance, "cells near the end of their life; or a cell file that was made for another cell"},
    {FaultId::cell_overtemperature,
     "more current than the cooling takes away, a fan that stands still, a joint that heats the cell beside it"},
    {FaultId::cell_undertemperature, "frost; or a sensor that has come off its cell and measures the air"},
    {FaultId::charge_overtemperature, "charging right after a hard drive, or in the sun"},
    {FaultId::charge_undertemperature,
     "a cold pack: lithium would plate on the anode, which costs capacity and, in the end, safety"},
    {FaultId::board_overtemperature,
     "many cells bled at a time, without air over the board; or the module sits in the cells' waste heat"},
    {FaultId::board_undertemperature, "frost: the measuring chip is below what its maker promises it for"},
    {FaultId::temperature_rise,
     "a cell with an inner short; or a joint that glows; more rarely a sensor wire that moves in its plug"},
    {FaultId::temperature_spread,
     "cooling that does not reach everywhere, one joint worse than the others, a sensor that has come off"},
    {FaultId::discharge_overcurrent,
     "a short behind the contactors, or a controller that may draw more than the pack file says; or a current sensor "
     "that counts the wrong way round (`sensor/invert_current`), so that a charge reads as a load"},
    {FaultId::charge_overcurrent,
     "a charger, or the braking of a motor, set to more than the pack file says; or a current sensor that counts the "
     "wrong way round (`sensor/invert_current`), so that each load reads as a charge"},
    {FaultId::discharge_overload,
     "a load above the continuous current for longer than the peak lasts, as on a long hill; the vehicle does not keep "
     "to the limit that it is told; or a current sensor that counts the wrong way round (`sensor/invert_current`)"},
    {FaultId::charge_overload,
     "a charger or a long descent above the continuous current, which does not keep to the limit that it is given; or "
     "a current sensor that counts the wrong way round (`sensor/invert_current`)"},
    {FaultId::discharge_not_allowed,
     "something on the link draws current that bmud does not switch, as a converter, while the pack is closed for its "
     "charger only; or a current sensor that counts the wrong way round (`sensor/invert_current`), so that the charge "
     "reads as a load"},
    {FaultId::charge_not_allowed,
     "a charger or a controller that does not keep to the charge limit, or has lost the vehicle's bus; or a current "
     "sensor that counts the wrong way round (`sensor/invert_current`)"},
    {FaultId::current_while_open,
     "a contactor that does not open; a path beside the contactors, as a converter at the pack's own terminals; or a "
     "sensor that was not set to zero"},
    {FaultId::pack_voltage_mismatch,
     "the sensor's voltage wire on the wrong side of a fuse, a fuse that has gone, a module too many or too few in the "
     "pack file (`modules`)"},
    {FaultId::module_voltage_mismatch, "a sense wire with a poor contact, or a measuring chip that is no longer true"},
    {FaultId::stuck_values, "a measuring chip or a firmware that repeats its last answer"},
    {FaultId::current_contradicts_voltage,
     "a sensor whose direction is the other one (`sensor/invert_current`), that sits on the wrong conductor, or that "
     "stands still"},
    {FaultId::current_sensors_disagree,
     "an offset that was never set to zero, other ranges, or a conductor that only one of them embraces; or a second "
     "sensor that is mounted the other way round than `sensor/second_is_reversed` says"},
    {FaultId::soc_methods_disagree,
     "a current sensor with an offset or a wrong gain; a capacity in the cell file that these cells no longer have"},
    {FaultId::cell_model_mismatch,
     "a cell file of another cell, a current sensor that is wrong, or a cell that is ill"},
    {FaultId::module_lost,
     "an external supply that failed (on its own cells a module is silent), a plug that has come off, a bus that lacks "
     "a "
     "terminator, a module that has another node number"},
    {FaultId::cell_not_measured,
     "a broken or loose sense wire, a blown fuse in it, a cell connected to the wrong input"},
    {FaultId::temperature_not_measured,
     "a sensor that was pulled out of its plug, a crushed wire, a sensor of another kind"},
    {FaultId::open_wire, "a sense wire that has come off its cell, or a fuse in it that has blown"},
    {FaultId::module_disturbed,
     "a bus wire beside a motor cable, a missing screen or terminator, or two senders under one identifier"},
    {FaultId::module_reports_fault,
     "the module's own limits, which are the pack's, were passed before bmud had opened; or its measuring chip fails "
     "the "
     "test it makes of itself"},
    {FaultId::module_reports_undervoltage, "the same empty cell that bmud sees, seen by the module itself"},
    {FaultId::module_warning,
     "a board that is hot from balancing, a supply below what the module likes, or a sensor that cannot be read"},
    {FaultId::module_starting,
     "the module has just been powered or woken; one that goes on so cannot reach its measuring chip"},
    {FaultId::module_going_to_sleep, "a supply that falls, or another master or tool on the bus that put it to sleep"},
    {FaultId::module_alone, "a firmware that does not notice the polls it answers"},
    {FaultId::balancing_stays_on, "a transistor that has fused, or a firmware that counts minutes nobody told it"},
    {FaultId::balancing_stays_off, "a resistor or transistor that has burnt open, or a blown fuse in the sense wire"},
    {FaultId::balancing_refused, "a board that the module holds to be too hot, or a firmware without balancing"},
    {FaultId::module_mismatch,
     "a module of another make or firmware, or with another number of temperature sensors than the pack file says"},
    {FaultId::wrong_cell_count,
     "a pack file that was copied and not changed; or a wire that has come off the topmost cells"},
    {FaultId::module_exchanged, "a module was replaced, and nobody has told bmud"},
    {FaultId::modules_swapped, "two modules were put back in each other's place after a repair"},
    {FaultId::module_not_set_up, "the module restarts again and again, or its firmware does not know the command"},
    {FaultId::duplicate_node,
     "a new module that still has the number of its maker, or a copy of another one's settings"},
    {FaultId::unknown_module, "a module that was added and is not in the pack file, or one whose number was set wrong"},
    {FaultId::current_sensor_lost,
     "its supply, its plug, another bit rate, measuring that was not switched on when it was set up, or values in the "
     "other byte order (`sensor/little_endian`)"},
    {FaultId::voltage_sensor_lost,
     "a voltage wire that has come off; a channel that was not switched on, or is sent more slowly than every 60 ms; "
     "values in the other byte order (`sensor/little_endian`)"},
    {FaultId::sensor_not_set_up,
     "a sensor that was never configured, or by another tool and for another pack; one that lost its settings because "
     "they were not stored; another sensor than sensor/protocol says"},
    {FaultId::pdu_lost, "its supply or its plug; or the bus between it and this machine is broken in two"},
    {FaultId::pdu_opened_by_itself,
     "commands that did not reach the unit for 200 ms: a bus with errors, a machine that stood still, or a supply that "
     "dropped when the contactors pulled in"},
    {FaultId::emergency_stop, "somebody has pressed it; or its wire is broken, which reads as pressed"},
    {FaultId::interlock_open,
     "a cover, a plug or a service disconnect that is not quite closed; a broken wire reads the same"},
    {FaultId::supply_low, "an auxiliary battery that is empty, or a converter that does not feed it"},
    {FaultId::lines_failed,
     "a chip that was unplugged, a line that another program holds, or rights that the service lacks"},
    {FaultId::insulation_fault,
     "water or dirt at a connector, chafed insulation, a charger or heater with a path to earth; or the monitor has no "
     "supply, which reads the same"},
    {FaultId::insulation_low,
     "water or dirt at a connector, chafed insulation, a charger or heater with a path to earth"},
    {FaultId::insulation_low_driving,
     "water or dirt at a connector, chafed insulation, a heater or converter with a path to earth"},
    {FaultId::insulation_monitor_lost,
     "its signal wire or its earth wire is off; or it finds the earth connection missing itself"},
    {FaultId::insulation_monitor_untested,
     "the monitor was switched on without being told to test itself, or its test does not end"},
    {FaultId::precharge_failed,
     "a load on the link that draws while it is charged; a precharge resistor or contactor that is open; a link with "
     "more capacitance than `contactors/precharge_timeout_ms` allows for, or `contactors/precharge_energy_J`, which "
     "ends a try before the time is over"},
    {FaultId::precharge_too_fast,
     "nothing is connected behind the contactors; a shorted precharge resistor; a main contactor that is welded; a "
     "link with less capacitance than `contactors/precharge_min_ms` expects"},
    {FaultId::precharge_overcurrent,
     "a short behind the contactors, or a precharge resistor of too few ohms for "
     "`contactors/precharge_overcurrent_mA`"},
    {FaultId::contactor_feedback,
     "a coil without supply, a plug that has come off, an auxiliary contact wired the other way round (`active_low`)"},
    {FaultId::contactor_welded,
     "closing without enough precharge, or opening under more current than the contacts bear"},
    {FaultId::link_not_following,
     "a contact that is burnt and does not conduct, a fuse behind it, or the sensor's link wire"},
    {FaultId::link_not_discharging,
     "both main contactors welded; a link without a discharge resistor, which keeps its charge, or with one that takes "
     "longer than `contactors/link_decay_ms`; or a motor that turns"},
    {FaultId::charger_silent,
     "a power cut, a plug that was pulled at the wall, a connector of the charger's bus; a charger that speaks at "
     "another bit rate than `interfaces/charger_kbit_per_s`"},
    {FaultId::charger_runaway,
     "a second charger on the pack that the pack file does not know, a charger that is set by hand, a wrong protocol "
     "(`charger/protocol`)"},
    {FaultId::charger_keeps_on, "a charger whose enable is wired to something else, or a second charger"},
    {FaultId::charger_trouble, "mains too weak, a hot garage, the charge contactor open while the charger looks"},
    {FaultId::charger_contradicts,
     "a load beside the sensor, a sensor on the wrong wire or the wrong way round (`sensor/invert_current`), a charger "
     "that the pack file does not count (`charger/units`)"},
    {FaultId::foreign_charger_master, "another master of the charger, or its maker's tool, on the same bus"},
    {FaultId::foreign_charger_commands, "another master of the charger, or its maker's tool, on the same bus"},
    {FaultId::inverter_silent,
     "an inverter that was switched off, a wire, another bit rate; or a model that sends no keep-alive: then "
     "`inverter/silence_max_ms` is 0"},
    {FaultId::inverter_lost,
     "an inverter that was switched off, a wire, another bit rate; or a model that sends no keep-alive: then "
     "`inverter/silence_max_ms` is 0"},
    {FaultId::inverter_trouble, "overload, heat, or a grid out of bounds; the number is in the inverter's manual"},
    {FaultId::foreign_battery, "a second battery on the inverter's bus, or a played back log"},
    {FaultId::foreign_master,
     "a second master that began to send while this one ran, a tool that polls or commands, or a log that is played "
     "back"},
    {FaultId::foreign_reporter, "a second pack or an old master with the same identifiers, or a played back log"},
    {FaultId::second_pack_silent,
     "its master has no supply, or speaks at another base identifier (`second_pack/base_id`) or bit rate "
     "(`interfaces/second_pack_kbit_per_s`) than the pack file says"},
    {FaultId::internal_bus_down, "the adapter was unplugged, or the interface was not brought up after the start"},
    {FaultId::bus_off_storm,
     "a short between the bus wires, a node at another bit rate than `buses/internal_kbit_per_s`, or no terminator at "
     "all"},
    {FaultId::bus_error_passive,
     "one terminator only, wires that are too long for the bit rate, or nobody else on the bus to acknowledge"},
    {FaultId::command_not_on_bus,
     "nobody acknowledges, since all others have no supply; or somebody fills the bus with frames of higher priority"},
    {FaultId::frames_lost, "a machine that is too busy to read; or receive buffers as small as the kernel's default"},
    {FaultId::control_loop_gap,
     "another program with a higher priority, a machine that was suspended, a virtual machine held up"},
    {FaultId::tick_overrun, "a machine that is too busy, or too slow"},
    {FaultId::store_unreadable, "a disk that is worn out or was full, or a file that somebody changed by hand"},
    {FaultId::store_write_failed,
     "a full disk, one that went read-only after an error, or rights that the service lacks"},
    {FaultId::history_write_failed, "a full disk, one that went read-only after an error, or a damaged database"},
    {FaultId::clock_jump,
     "the network gave the machine its time after the start, which a machine without a clock of its own always sees"},
    {FaultId::memory_low, "an error of ours"},
    {FaultId::disk_low, "recordings or logs, of bmud or of others"},
    {FaultId::front_end_supply_low,
     "a broken wire or fuse between the topmost cell and the front end; an empty module"},
    {FaultId::front_end_overtemperature,
     "balancing resistors without cooling, or a short circuit on the module's board"},
    {FaultId::front_end_faults_missing, "a module of an earlier firmware, or one whose front end does not answer it"},
    {FaultId::module_supply_lost,
     "the fuse or the wire of its external supply; or the pack's auxiliary supply is switched off"},
    {FaultId::alarm_loop_open,
     "a cell that is overcharged or hot while the daemon did not open; a module that sleeps or has no power; a broken "
     "wire of the loop"},
}};

// In the order of Blocker.
constexpr std::array<BlockerAdvice, blocker_count> advice_table{{
    {Blocker::shutting_down, "The daemon was told to end, opens, and ends.",
     "start it again when the pack is to be used"},
    {Blocker::fault,
     "A fault is present that does more than warn. Behind it stand all that are, each with its place. One that ends "
     "\"cause "
     "gone, waiting for\" needs nothing but the command that is named; of the others the cause is still there.",
     "look each one up with `bmuctl faults`, mend the cause, then clear what waits for it"},
    {Blocker::resting,
     "After an undervoltage with nobody there the modules were sent to sleep, so that they do not empty the cells "
     "further. "
     "Nothing is measured meanwhile, but for a look every five minutes.",
     "press the resume button, plug the charger in, or say `bmuctl wake`; then charge"},
    {Blocker::internal_bus_down, "The interface of the internal bus is down, gone, or off the bus.",
     "bring the interface up (`ip link`), look at the adapter and its wires"},
    {Blocker::pdu_unknown,
     "No PDU_STATUS for longer than `ages/pdu_status_ms`, or no look at the GPIO lines of this machine that tell a "
     "part "
     "of it: how contactors and inputs stand is not known. Which of the two it is, is named.",
     "check the power distribution unit's supply and bus wires, or the pack file's GPIO section"},
    {Blocker::inputs_unhealthy,
     "An input says no at this moment, whether it has become a fault already or not. Each is named: an emergency stop, "
     "the "
     "interlock, the insulation monitor's line, or a unit that has opened by itself.",
     "release or close what is named; then see which faults wait to be cleared"},
    {Blocker::insulation_unknown,
     "With `insulation/monitoring` on `measured` the monitor has to tell a resistance first. After it is switched on "
     "that may "
     "take it 20 s; until then it says so (\"speed start\").",
     "wait for the monitor; if it does not come, check its supply, signal wire and earth"},
    {Blocker::modules_incomplete,
     "Each module has to have answered within the ages, with every cell and every temperature that the pack file says. "
     "The "
     "modules and sensors that are missing are named, with the age of their last answer.",
     "check supply, bus wires and node number of the modules that are named"},
    {Blocker::sensors_incomplete,
     "The current, the pack's voltage or the link's is missing or too old; which, and for how long, is named.",
     "check the sensor's supply, its bus and voltage wires, and which channels it was set up to send"},
    {Blocker::not_qualified,
     "Three complete poll cycles in a row are wanted, of all modules, after a start, a gap or a lost bus. At the usual "
     "pace "
     "that takes 0.3 s.",
     "wait a second; if it stays, `bmuctl modules` shows who misses answers"},
    {Blocker::modules_not_set_up,
     "A module does not have the pack's cell limits yet, or refuses them. Without them it would guard its cells by "
     "limits of "
     "its own, and the last line would be another one than you think.",
     "wait a second; a module that refuses has another firmware: replace or update it"},
    {Blocker::suspicion,
     "A value is beyond its limit, or something looks wrong, and has not lasted for its confirm time. In a moment it "
     "is a "
     "fault, or over.",
     "wait a second and ask again"},
    {Blocker::commands_not_on_bus,
     "The commands that were sent have not come back from the bus: nobody acknowledges, or somebody fills it.",
     "check that the others on the bus have supply, its wires and terminators, and who sends (`bmudump --follow`)"},
    {Blocker::contacts_unsettled, "The auxiliary contacts have not stood for long enough where they were commanded to.",
     "wait a second; if it stays, `bmuctl status` shows which contactor: check its coil and its contact"},
    {Blocker::contactor_closed, "Everything is commanded open, and an auxiliary contact says closed.",
     "measure by hand before anybody touches anything: the contactor may be welded, or its contact wired the wrong "
     "way"},
    {Blocker::link_follows,
     "The link is still at the pack's voltage with everything open. After an opening that is its charge, which a "
     "discharge "
     "resistor takes away; if it stays, both main contactors may be welded.",
     "wait until the link has discharged; if it does not, measure by hand"},
    {Blocker::precharge_hot,
     "The precharge resistor has taken as much heat as `contactors/precharge_energy_J` says that it bears, and cools.",
     "wait; then find out why the precharge takes several tries"},
    {Blocker::locked_out,
     "After an opening for a reason, a precharge that failed, or an end of the daemon with closed contactors, some "
     "time has to "
     "go by; how much is left, is told.",
     "wait for the time that is told"},
    {Blocker::no_claim,
     "A daemon that starts, or whose bus was down or loop stalled, listens before it commands anything: for 0.15 to "
     "0.4 s "
     "with a power distribution unit, for three polls at the parked pace without one. If it receives a frame that only "
     "a "
     "master sends, it ends with exit code 71 and `second master`.",
     "wait a second; if the daemon ends, find the other master (`bmudump`) and stop it"},
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

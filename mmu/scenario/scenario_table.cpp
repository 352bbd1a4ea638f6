// Targets and properties of a script, one row each.
#include <algorithm>

#include "devices/charger.hpp"
#include "mmu/devices/contactor.hpp"
#include "mmu/devices/mode.hpp"
#include "mmu/devices/request_words.hpp"
#include "mmu/plant/load_profile.hpp"
#include "mmu/scenario/scenario.hpp"
#include "mmu/scenario/scenario_state.hpp"
#include "mmu/scenario/scenario_text.hpp"
#include "protocol/row_order.hpp"

namespace bmu {

using scenario_text::has_word;
using scenario_text::listed;
using scenario_text::number_text;

// --- the tables -----------------------------------------------------------------------------------------------------

namespace {

constexpr std::string_view on_off_words[] = {"off", "on"};
constexpr std::string_view wire_words[] = {"closed", "open", "open_silent"};
constexpr std::string_view sense_words[] = {"pack", "terminals"};
constexpr std::string_view signal_wire_words[] = {"closed", "open", "shorted"};
constexpr std::string_view omitted_words[] = {"nothing", "status", "cells", "temperatures", "module", "ident"};
constexpr std::string_view obeys_words[] = {"master", "nobody"};
/// After the first one, in the order of ChargerTrouble.
constexpr std::string_view charger_trouble_words[] = {"none",    "hardware",   "too_hot",         "mains",
                                                      "battery", "no_command", "command_refused", "output_overvoltage",
                                                      "unnamed", "no_battery", "no_mains"};
static_assert(std::size(charger_trouble_words) == charger_trouble_count + 1);
constexpr std::string_view switch_words[] = {"auto", "stays_off", "stays_on"};
constexpr std::string_view command_words[] = {"obeyed", "ignored"};
constexpr std::string_view self_test_words[] = {"ok", "failed"};
constexpr std::string_view reported_words[] = {"reported", "not_reported"};
constexpr std::string_view thermistor_words[] = {"ok", "open", "shorted"};
constexpr std::string_view thermistor_curve_words[] = {"table", "steinhart_hart"};
constexpr std::string_view feedback_words[] = {"auto", "open", "closed"};
constexpr std::string_view estop_words[] = {"1", "2"};
constexpr std::string_view sensor_words[] = {"current", "pack_voltage", "link_voltage", "current_2"};
constexpr std::string_view second_pack_words[] = {"fault", "open", "closed", "driving", "charging"};
constexpr std::string_view byte_order_words[] = {"big", "little"};
constexpr std::string_view sign_words[] = {"straight", "inverted"};
constexpr std::string_view self_test_state_words[] = {"done", "pending", "running"};
constexpr std::string_view monitor_words[] = {"no_signal",   "normal",       "undervoltage",
                                              "speed_start", "device_error", "earth_fault"};

constexpr TargetSpec targets[] = {
    {TargetKind::vehicle, "vehicle"},
    {TargetKind::charger, "charger"},
    {TargetKind::inverter, "inverter"},
    {TargetKind::second_pack, "second_pack"},
    {TargetKind::load, "load"},
    {TargetKind::pack, "pack"},
    {TargetKind::cell, "cell", Address::node_cell},
    {TargetKind::module, "module", Address::node},
    {TargetKind::stranger, "stranger", Address::node},
    {TargetKind::thermistor, "thermistor", Address::node_slot},
    {TargetKind::board_thermistor, "board_thermistor", Address::node_slot},
    {TargetKind::sensor, "sensor", Address::word, sensor_words},
    {TargetKind::sensor_unit, "sensor_unit"},
    {TargetKind::pdu, "pdu"},
    {TargetKind::contactor, "contactor", Address::word, contactor_names},
    {TargetKind::estop, "estop", Address::word, estop_words},
    {TargetKind::interlock, "interlock"},
    {TargetKind::insulation, "insulation"},
    {TargetKind::link, "link"},
    {TargetKind::precharge, "precharge"},
    {TargetKind::resume_button, "resume_button"},
    {TargetKind::master, "master"},
};

static_assert(rows_are_in_order(targets, &TargetSpec::kind), "targets[] is indexed by TargetKind");

constexpr PropertySpec make(Property property, TargetKind target, std::string_view name, std::string_view meaning) {
  return {.property = property, .target = target, .name = name, .meaning = meaning};
}
constexpr PropertySpec make(Property property, TargetKind target, std::string_view name, double min, double max,
                            std::string_view meaning, ValueKind kind = ValueKind::number,
                            std::string_view only_for = {}) {
  return {.property = property,
          .target = target,
          .name = name,
          .kind = kind,
          .min = min,
          .max = max,
          .only_for = only_for,
          .meaning = meaning};
}
constexpr PropertySpec make(Property property, TargetKind target, std::string_view name,
                            std::span<const std::string_view> words, std::string_view meaning,
                            std::string_view only_for = {}) {
  return {.property = property,
          .target = target,
          .name = name,
          .kind = ValueKind::word,
          .words = words,
          .only_for = only_for,
          .meaning = meaning};
}

constexpr PropertySpec ours(PropertySpec row) {
  row.need = ModuleNeed::ours;
  return row;
}
constexpr PropertySpec needing(ModuleNeed need, PropertySpec row) {
  row.need = need;
  return row;
}

constexpr auto automatic = ValueKind::number_or_auto;
constexpr auto count = ValueKind::count;
constexpr auto automatic_count = ValueKind::count_or_auto;

constexpr std::array<PropertySpec, property_count> properties{
    make(Property::vehicle_on, TargetKind::vehicle, "on", "the key is turned: input \"vehicle on\""),
    make(Property::vehicle_off, TargetKind::vehicle, "off", "the key is turned back"),
    make(Property::vehicle_asks, TargetKind::vehicle, "asks", request_words,
         "a display asks for this, as a Lithiumate is asked (vehicle/request_id); once"),
    make(Property::vehicle_asks_about, TargetKind::vehicle, "asks_about", 0, 255,
         "the cell, bank or battery of which it asks from then on; at first 0", count),
    make(Property::charger_connected, TargetKind::charger, "connected", "input \"charger connected\""),
    make(Property::charger_disconnected, TargetKind::charger, "disconnected", "and away again; its current stops"),
    make(Property::charger_current, TargetKind::charger, "current_A", 0, 1000,
         "what it delivers at most while connected and the contactors are closed (the charge contactor too, where the "
         "pack has one), up to the cells' maximum voltage"),
    make(Property::charger_runaway, TargetKind::charger, "runaway", on_off_words,
         "delivers its current at whatever voltage the cells have, and whatever the master allows"),
    make(Property::charger_unstoppable, TargetKind::charger, "unstoppable", on_off_words,
         "goes on with its current when told less or disconnected, while the contactors let it"),
    make(Property::charger_obeys, TargetKind::charger, "obeys", obeys_words,
         "master: never more than the charge limit the vehicle is told, nothing where none has come for 3 s; nobody: "
         "its "
         "own current"),
    make(Property::charger_mains, TargetKind::charger, "mains", on_off_words,
         "the wall's socket, of a charger that is driven over a bus: off, it gives nothing and says nothing"),
    make(Property::charger_post, TargetKind::charger, "post", on_off_words,
         "a charging post in place of the socket: its mains are on while the charger is told to ask for them"),
    make(Property::charger_units, TargetKind::charger, "units", 0, charger_units_max,
         "so many of its units have mains, the first ones; at first all", count),
    make(Property::charger_trouble, TargetKind::charger, "trouble", charger_trouble_words,
         "what is wrong with each unit, where its protocol has a word for it; what it has latched stays after it"),
    make(Property::charger_lead, TargetKind::charger, "lead_mOhm", 0, 10'000,
         "of its leads, both ways: so much higher than the link's is the voltage at its terminals"),
    make(Property::charger_voltage, TargetKind::charger, "voltage_V", 1, 1'500,
         "what it holds, where it senses it; auto: all cells at their maximum", automatic),
    make(Property::charger_senses, TargetKind::charger, "senses", sense_words,
         "pack: by sense wires, at the link; terminals: its own, without them"),
    make(Property::inverter_current, TargetKind::inverter, "current_A", -1000, 1000,
         "what it wants to draw, positive out of the pack, or charge with; it takes as much of it as it is told"),
    make(Property::inverter_obeys, TargetKind::inverter, "obeys", obeys_words,
         "master: never more than its limits, nothing where none has come for as long as its protocol says; nobody: "
         "ignores its limits"),
    make(Property::inverter_silent, TargetKind::inverter, "silent", "sends no keep-alive; goes on working"),
    make(Property::inverter_talking, TargetKind::inverter, "talking", "and sends it again"),
    make(Property::inverter_failed, TargetKind::inverter, "failed", on_off_words,
         "says so, where its protocol has a word for it"),
    make(Property::second_pack_soc, TargetKind::second_pack, "soc_permille", 0, 1000,
         "the charge its master tells, in whole percent; auto: that it does not know", automatic),
    make(
        Property::second_pack_voltage, TargetKind::second_pack, "voltage_mV", 0, 1e6,
        "of its pack, in whole volts; auto: of as many cells as this pack has, of the same kind, at rest at its charge",
        automatic),
    make(Property::second_pack_current, TargetKind::second_pack, "current_A", -1000, 1000,
         "what it says flows, positive out of its pack; its charge stays what the script says"),
    make(Property::second_pack_temperature, TargetKind::second_pack, "temperature_dC", -500, 1000,
         "of its cells, in whole degrees"),
    make(Property::second_pack_state, TargetKind::second_pack, "state", second_pack_words,
         "as its dialect has it; at first open"),
    make(Property::second_pack_silent, TargetKind::second_pack, "silent", "its master sends nothing"),
    make(Property::second_pack_talking, TargetKind::second_pack, "talking", "and sends again"),
    make(Property::load_current, TargetKind::load, "current_A", -1000, 1000,
         "demand, positive out of the pack; flows while the contactors are closed; ends a profile"),
    make(Property::load_profile, TargetKind::load, "profile", load_profile_names,
         "drive: accelerations, cruising, regeneration, over and over; none: stand still"),
    make(Property::pack_soc, TargetKind::pack, "soc_permille", 0, 1000, "charge of every cell"),
    make(Property::pack_ambient, TargetKind::pack, "ambient_dC", -500, 1000, "temperature of the air"),
    make(Property::pack_temperature, TargetKind::pack, "temperature_dC", -500, 1000,
         "of every cell now; they go on to heat and cool"),
    make(Property::cell_voltage, TargetKind::cell, "voltage_mV", 0, 6000,
         "what its module measures, whatever the cell does", automatic),
    make(Property::cell_offset, TargetKind::cell, "offset_mV", -1000, 1000, "error of the measurement"),
    make(Property::cell_soc, TargetKind::cell, "soc_permille", 0, 1000, "its charge"),
    make(Property::cell_capacity, TargetKind::cell, "capacity_permille", 10, 2000,
         "of what the cell file says: a worn cell; its state of charge stays", automatic),
    make(Property::cell_resistance, TargetKind::cell, "resistance_mOhm", 0, 10000,
         "series resistance at 25 C: a poor cell or joint", automatic),
    make(Property::cell_leak, TargetKind::cell, "leak_Ohm", 0.01, 1e9, "a resistance in parallel: an inner short",
         automatic),
    make(Property::cell_temperature, TargetKind::cell, "temperature_dC", -500, 2000,
         "held there; auto lets it heat and cool", automatic),
    make(Property::cell_wire, TargetKind::cell, "wire", wire_words,
         "measuring wire at its upper end off. open: reported, this cell and the next are not measured; open_silent: "
         "not "
         "noticed, this cell reads less and less and the next as much more"),
    make(Property::cell_stuck, TargetKind::cell, "stuck", on_off_words,
         "its channel says for ever what it said last, to the last bit"),
    needing(ModuleNeed::foreign, make(Property::cell_out_of_range, TargetKind::cell, "out_of_range", on_off_words,
                                      "its module says a number for it that the field must not hold")),
    make(Property::cell_balancing_switch, TargetKind::cell, "balancing_switch", switch_words,
         "of its balancing resistor, whatever its module wants; the module sees how it stands"),
    ours(make(Property::cell_undervoltage_flag, TargetKind::cell, "undervoltage_flag", on_off_words,
              "on: its module reports it as failed for undervoltage, whatever it measures")),
    make(Property::module_silent, TargetKind::module, "silent", "sends nothing; goes on working"),
    make(Property::module_talking, TargetKind::module, "talking", "and sends again"),
    ours(make(Property::module_restart, TargetKind::module, "restart", "loses power for a moment")),
    ours(make(Property::module_crc_errors, TargetKind::module, "crc_errors", on_off_words,
              "every transfer from its front end is damaged: voltages age, STATUS says so")),
    ours(make(Property::module_crc_error_rate, TargetKind::module, "crc_error_permille", 0, 1000,
              "so many of the register groups its front end sends arrive damaged: what they would have renewed ages")),
    ours(make(Property::module_crc_wrong_bits, TargetKind::module, "crc_wrong_bits", 1, 64,
              "in each damaged group; up to five are always found, of more about one in 33000 passes for good", count)),
    needing(ModuleNeed::protection, make(Property::module_damaged_frames, TargetKind::module, "damaged_frames",
                                         on_off_words, "its frames have a wrong checksum")),
    make(Property::module_stuck, TargetKind::module, "stuck", on_off_words,
         "answers each POLL, for ever with the data it sent last"),
    needing(ModuleNeed::protection, make(Property::module_frozen_counter, TargetKind::module, "frozen_counter",
                                         on_off_words, "new data, for ever under the counter it sent last")),
    make(Property::module_replay, TargetKind::module, "replay", on_off_words,
         "answers with the frames it sent last, counter and checksum included"),
    make(Property::module_omits, TargetKind::module, "omits", omitted_words, "leaves these frames out of its answers"),
    make(Property::module_delay, TargetKind::module, "delay_ms", 0, 500, "its frames leave so much later"),
    make(Property::module_sends_as_node, TargetKind::module, "sends_as_node", 1, 63,
         "its frames carry this node's identifiers; it goes on listening to its own", automatic_count),
    ours(make(Property::module_cell_count, TargetKind::module, "cell_count", 0, 15, "number of cells it says it has",
              automatic_count)),
    ours(make(Property::module_temperature_sensor_count, TargetKind::module, "temperature_sensor_count", 0, 15,
              "number of cell temperature sensors it says it has", automatic_count)),
    ours(make(Property::module_protocol_version, TargetKind::module, "protocol_version", 0, 255,
              "of the protocol it says it speaks", automatic_count)),
    ours(make(Property::module_serial_number, TargetKind::module, "serial_number", 0, 4294967295.0,
              "says it is this one: exchanged", automatic_count)),
    ours(make(Property::module_commands, TargetKind::module, "commands", command_words,
              "ignored: no COMMAND reaches it, to it alone or to all; none is done, none answered")),
    ours(make(Property::module_self_test, TargetKind::module, "self_test", self_test_words, "of the front end")),
    ours(make(Property::module_front_end_faults, TargetKind::module, "front_end_faults", reported_words,
              "not_reported: a module built before MODULE had bits for the next two")),
    ours(make(Property::module_front_end_supply, TargetKind::module, "front_end_supply_low", on_off_words,
              "its front end reports undervoltage of its own supply; kept until faults are cleared")),
    ours(make(Property::module_front_end_shutdown, TargetKind::module, "front_end_thermal_shutdown", on_off_words,
              "its front end reports thermal shutdown; kept until faults are cleared")),
    needing(ModuleNeed::errors, make(Property::module_errors, TargetKind::module, "errors", 0, 4294967295.0,
                                     "its word for what is wrong with it, as a number; 0: nothing", count)),
    needing(ModuleNeed::board_sensor, make(Property::module_board_temperature, TargetKind::module,
                                           "board_temperature_dC", -1000, 1250, "all board sensors", automatic)),
    ours(make(Property::module_external_supply, TargetKind::module, "external_supply_mV", 0, 60000,
              "what feeds it; below 5000 it lives on its own cells, and its CAN side has no power")),
    ours(make(Property::module_talks_on_own_supply, TargetKind::module, "talks_on_own_supply", on_off_words,
              "on: its own cells feed its CAN side, too")),
    ours(make(Property::module_converts, TargetKind::module, "converts", thermistor_curve_words,
              "by which curve the unit itself makes temperatures of resistances; what is fitted follows, unless "
              "thermistor_curve says otherwise")),
    ours(make(Property::module_thermistor_curve, TargetKind::module, "thermistor_curve", thermistor_curve_words,
              "of the thermistors fitted, cell and board, whatever the unit takes them for")),
    ours(make(
        Property::stranger_connected, TargetKind::stranger, "connected",
        "a module that is not of this pack comes to the bus with this node number, its own cells at 3.6 V; if the pack "
        "has that node, both answer")),
    ours(make(Property::stranger_disconnected, TargetKind::stranger, "disconnected", "and goes again")),
    make(Property::thermistor_state, TargetKind::thermistor, "state", thermistor_words, "of a cell sensor"),
    make(Property::thermistor_stuck, TargetKind::thermistor, "stuck", on_off_words,
         "it stands still at the temperature it had, whatever its cells do"),
    needing(ModuleNeed::board_sensor,
            make(Property::board_thermistor_state, TargetKind::board_thermistor, "state", thermistor_words,
                 "of a sensor on the board; a unit that cannot see its board does not balance")),
    needing(ModuleNeed::board_sensor,
            make(Property::board_thermistor_stuck, TargetKind::board_thermistor, "stuck", on_off_words,
                 "it stands still at the temperature it had, whatever its board does")),
    make(Property::sensor_silent, TargetKind::sensor, "silent", "this result is no longer sent"),
    make(Property::sensor_talking, TargetKind::sensor, "talking", "and is sent again"),
    make(Property::sensor_offset_current, TargetKind::sensor, "offset_mA", -1e6, 1e6, "error of the measurement",
         ValueKind::number, "current current_2"),
    make(Property::sensor_value_current, TargetKind::sensor, "value_mA", -1e6, 1e6, "what it says, whatever flows",
         automatic, "current current_2"),
    make(Property::sensor_offset_voltage, TargetKind::sensor, "offset_mV", -1e6, 1e6, "error of the measurement",
         ValueKind::number, "pack_voltage link_voltage"),
    make(Property::sensor_value_voltage, TargetKind::sensor, "value_mV", -1e6, 1e6, "what it says, whatever is there",
         automatic, "pack_voltage link_voltage"),
    make(Property::sensor_gain, TargetKind::sensor, "gain_permille", 500, 1500,
         "of what it measures: a shunt or a divider that drifts, over time with a ramp"),
    make(Property::sensor_stuck, TargetKind::sensor, "stuck", on_off_words,
         "for ever the value sent last, to the last digit; its counter goes on"),
    make(Property::sensor_inverted, TargetKind::sensor, "inverted", on_off_words, "connected the wrong way round",
         "current current_2"),
    make(Property::sensor_error, TargetKind::sensor, "error", on_off_words, "its measurement-error flag"),
    make(Property::sensor_unit_restart, TargetKind::sensor_unit, "restart",
         "the sensor that can be configured (`sensor/protocol`) loses power for a moment: 0.1 s of silence, then it "
         "says "
         "that it is alive and goes on with what it has stored"),
    make(Property::sensor_unit_answers, TargetKind::sensor_unit, "answers", on_off_words,
         "to commands; off, it obeys all the same"),
    make(Property::sensor_unit_byte_order, TargetKind::sensor_unit, "byte_order", byte_order_words,
         "somebody gives its results this one, and stores it"),
    make(Property::sensor_unit_sign, TargetKind::sensor_unit, "current_sign", sign_words,
         "the same with the sign of its current"),
    make(Property::sensor_unit_period, TargetKind::sensor_unit, "current_period_ms", 1, 1000,
         "the same with the period of its current", count),
    make(Property::pdu_silent, TargetKind::pdu, "silent", "sends nothing; still obeys"),
    make(Property::pdu_talking, TargetKind::pdu, "talking", "and sends again"),
    make(Property::pdu_damaged_frames, TargetKind::pdu, "damaged_frames", on_off_words,
         "its frames have a wrong checksum"),
    make(Property::pdu_throttle, TargetKind::pdu, "throttle_permille", 0, 1000, "the pedal; auto: not fitted",
         automatic),
    make(Property::pdu_intake_air, TargetKind::pdu, "intake_air_dC", -500, 1000,
         "a sensor in the intake air; auto: none", automatic),
    ours(make(Property::pdu_alarm_loop, TargetKind::pdu, "alarm_loop", on_off_words,
              "on: the modules' alarm outputs are in its enable loop; it opens by itself when one opens")),
    make(Property::contactor_welded, TargetKind::contactor, "welded", "closed, whatever the coil does"),
    make(Property::contactor_stuck_open, TargetKind::contactor, "stuck_open", "never closes"),
    make(Property::contactor_ok, TargetKind::contactor, "ok", "repaired"),
    make(Property::contactor_feedback, TargetKind::contactor, "feedback", feedback_words,
         "its auxiliary contact: follows, or hangs"),
    make(Property::estop_pressed, TargetKind::estop, "pressed", "emergency stop"),
    make(Property::estop_released, TargetKind::estop, "released", "and pulled out again"),
    make(Property::interlock_open, TargetKind::interlock, "open", "a plug or cover is off"),
    make(Property::interlock_closed, TargetKind::interlock, "closed", "all plugs and covers on"),
    make(Property::insulation_resistance, TargetKind::insulation, "resistance_kOhm", 0, 65533,
         "to the chassis; below 500 Ohm for each volt of the full pack the monitor is not OK"),
    make(Property::insulation_monitor, TargetKind::insulation, "monitor", monitor_words,
         "state of the monitor itself; normal begins with 2 s of speed start; only these two can be OK"),
    make(Property::insulation_frequency, TargetKind::insulation, "pwm_frequency_Hz", 0, 100,
         "of its signal, whatever its state; 0: no pulses", automatic),
    make(Property::insulation_duty, TargetKind::insulation, "pwm_duty_permille", 0, 1000,
         "of its signal, whatever it measures; 0 and 1000: no pulses, low and high", automatic),
    make(Property::insulation_wire, TargetKind::insulation, "wire", signal_wire_words,
         "of its signal; open: low, shorted: to supply, high"),
    make(Property::insulation_self_test, TargetKind::insulation, "self_test", self_test_state_words,
         "of a monitor on a bus (`insulation/protocol`); running, it tells no value"),
    make(Property::link_capacitance, TargetKind::link, "capacitance_uF", 1, 1e6, "behind the contactors"),
    make(Property::link_bleed, TargetKind::link, "bleed_Ohm", 0.1, 1e9,
         "what discharges the link; small: a short or load that spoils the precharge"),
    make(Property::precharge_resistance, TargetKind::precharge, "resistance_Ohm", 0.1, 1e9,
         "of the precharge resistor; very large: burnt out"),
    make(Property::resume_button_pressed, TargetKind::resume_button, "pressed", "input \"resume\""),
    make(Property::resume_button_released, TargetKind::resume_button, "released", "and let go"),
    make(Property::master_clear, TargetKind::master, "clear",
         "`bmuctl clear`: ends faults that wait for it and whose cause is gone; with `--with-master` only"),
    make(Property::master_clear_authorised, TargetKind::master, "clear_authorised",
         "`bmuctl clear --authorised`: also clears faults that require an inspection of the pack"),
    make(Property::master_wake, TargetKind::master, "wake",
         "`bmuctl wake`: wakes the modules from sleep after an undervoltage"),
    make(Property::master_balancing, TargetKind::master, "balancing", on_off_words,
         "`bmuctl balance --off` and `--on`: stops all bleeding; returns to the setting of the pack file"),
    make(Property::master_accept_modules, TargetKind::master, "accept_modules",
         "`bmuctl modules accept`: registers the modules found at their nodes; only while open and without close "
         "request"),
};

static_assert(rows_are_in_order(properties, &PropertySpec::property), "properties[] is indexed by Property");

}  // namespace

std::span<const TargetSpec> target_table() {
  return targets;
}
std::span<const PropertySpec> property_table() {
  return properties;
}
std::string_view to_text(ModuleNeed need) {
  switch (need) {
    case ModuleNeed::any: break;
    case ModuleNeed::ours: return "only our own modules";
    case ModuleNeed::foreign: return "only modules of other makers";
    case ModuleNeed::protection: return "only modules whose frames have a checksum";
    case ModuleNeed::board_sensor: return "only modules with a sensor on their board";
    case ModuleNeed::errors: return "only modules of other makers that report errors";
  }
  return "any modules";
}
const PropertySpec& spec_of(Property property) {
  return properties[static_cast<std::size_t>(property)];
}

// --- documentation --------------------------------------------------------------------------------------------------

namespace {

std::string target_form(const TargetSpec& target, std::string_view only_for) {
  std::string name(target.name);
  switch (target.address) {
    case Address::none: return name;
    case Address::node: return name + " N";
    case Address::node_cell: return name + " N.CELL";
    case Address::node_slot: return name + " N.SENSOR";
    case Address::word: break;
  }
  std::string words;
  for (const std::string_view word : target.words) {
    if (!only_for.empty() && !has_word(only_for, word)) continue;
    words += (words.empty() ? "" : "\\|") + std::string(word);
  }
  return name + " " + words;
}

std::string value_form(const PropertySpec& property) {
  std::string range = number_text(property.min) + " to " + number_text(property.max);
  switch (property.kind) {
    case ValueKind::none: return "";
    case ValueKind::number: return range;
    case ValueKind::number_or_auto: return range + ", auto";
    case ValueKind::count: return range + ", whole";
    case ValueKind::count_or_auto: return range + ", whole; auto";
    case ValueKind::word: return listed(property.words);
  }
  return "";
}

std::string need_form(ModuleNeed need) {
  return need == ModuleNeed::any ? "" : "; " + std::string(to_text(need));
}

}  // namespace

std::string property_table_markdown() {
  std::string text = "| target | property | value | meaning |\n|---|---|---|---|\n";
  for (const PropertySpec& property : properties) {
    const TargetSpec& target = targets[static_cast<std::size_t>(property.target)];
    text += "| `" + target_form(target, property.only_for) + "` | `" + std::string(property.name) + "` | " +
            value_form(property) + " | " + std::string(property.meaning) + need_form(property.need) + " |\n";
  }
  return text;
}

std::string state_table_markdown() {
  const std::array<std::string, 5> asked{"", "a number", "a phase", "a cause", listed(unit_mode_names)};
  std::string text = "| target | state | compared with | meaning |\n|---|---|---|---|\n";
  for (const StateSpec& state : state_table()) {
    const TargetSpec& target = targets[static_cast<std::size_t>(state.target)];
    text += "| `" + target_form(target, "") + "` | `" + std::string(state.name) + "` | " +
            asked[static_cast<std::size_t>(state.kind)] + " | " + std::string(state.meaning) + " |\n";
  }
  return text;
}

}  // namespace bmu

// Effect of every property of the script language on the world: one row each, in the order of the enumerators.
#include <algorithm>
#include <cmath>

#include "mmu/scenario/world.hpp"
#include "protocol/row_order.hpp"

namespace bmu {

namespace {

constexpr double kelvin_to_tenths = 10.0;

/// Application of a value to a property. `set` gets the number, the word's index, or a meaningless 0; `release` is
/// `auto`; `get` gives the start of a ramp without one.
struct Handler {
  Property property;
  void (*set)(World&, ScenarioPlace, double);
  double (*get)(const World&, ScenarioPlace) = nullptr;
  void (*release)(World&, ScenarioPlace) = nullptr;
};

template <class Change>
void for_all_cells(World& world, Change change) {
  for (std::size_t cell = 0; cell < world.plant.cell_count(); ++cell) change(cell);
}

CellSense& cell_sense(World& world, ScenarioPlace place) {
  return world.cell_senses[world.cell_of(place)];
}
const CellSense& cell_sense(const World& world, ScenarioPlace place) {
  return world.cell_senses[world.cell_of(place)];
}
ModuleSense& module_sense(World& world, ScenarioPlace place) {
  return world.module_senses[world.module_of(place)];
}
const ModuleSense& module_sense(const World& world, ScenarioPlace place) {
  return world.module_senses[world.module_of(place)];
}
const PlantCell& plant_cell(const World& world, ScenarioPlace place) {
  return world.plant.cell(world.cell_of(place));
}
Contactor& contactor(World& world, ScenarioPlace place) {
  return world.plant.contactor(static_cast<ContactorName>(place.index));
}

void set_estop(World& world, ScenarioPlace place, bool is_released) {
  (place.index == 0 ? world.inputs.estop_1_released : world.inputs.estop_2_released) = is_released;
}

void set_stuck(ThermistorSense& sense, bool is_stuck) {
  sense.is_stuck = is_stuck;
  if (!is_stuck) sense.held_Ohm.reset();
}

template <Property property>
void order(World& world, ScenarioPlace, double word) {
  world.orders.push_back({property, static_cast<std::uint8_t>(word)});
}

double sensor_real(const World& world, ScenarioPlace place) {
  const std::array<double, scripted_results> real{world.plant.current_A(), world.plant.pack_V(), world.plant.link_V(),
                                                  world.plant.current_A()};
  return world.sensor_senses[place.index].value.value_or(real[place.index] * 1e3);
}
void set_sensor_value(World& world, ScenarioPlace place, double value) {
  world.sensor_senses[place.index].value = value;
}
void release_sensor_value(World& world, ScenarioPlace place) {
  world.sensor_senses[place.index].value.reset();
}
/// Changes and stores a setting, as another tool would.
template <class Change>
void give(World& world, std::size_t channel, Change change) {
  SensorSetting setting = world.sensor_unit.setting(channel);
  change(setting);
  world.sensor_unit.give(channel, setting);
}
template <class Change>
void give_current(World& world, Change change) {
  give(world, 0, change);
}
template <class Change>
void give_all(World& world, Change change) {
  for (std::size_t channel = 0; channel < sensor_channels_max; ++channel) give(world, channel, change);
}
void set_sensor_offset(World& world, ScenarioPlace place, double value) {
  world.sensor_senses[place.index].offset = value;
}
double sensor_offset(const World& world, ScenarioPlace place) {
  return world.sensor_senses[place.index].offset;
}

ModuleWireFaults& module_wire(World& world, ScenarioPlace place) {
  return module_sense(world, place).wire;
}
const ModuleWireFaults& module_wire(const World& world, ScenarioPlace place) {
  return module_sense(world, place).wire;
}
const MmuConfig& module_config(const World& world, ScenarioPlace place) {
  return world.modules[world.module_of(place)];
}
void set_wire(World& world, ScenarioPlace place, SenseWire wire) {
  CellSense& sense = cell_sense(world, place);
  if (wire != sense.wire) sense.opened_at = world.now;
  sense.wire = wire;
}
void set_undervoltage_flag(World& world, ScenarioPlace place, bool is_set) {
  CellMask& flags = module_wire(world, place).undervoltage_flags;
  const CellMask cell = cell_bit(place.index);
  flags = static_cast<CellMask>(is_set ? flags | cell : flags & ~cell);
}
std::uint8_t small_number(double value) {
  return static_cast<std::uint8_t>(std::lround(value));
}

/// Bit of the charger trouble with this keyword index; the first keyword is `none`.
std::uint16_t trouble_bits(double word) {
  const std::uint8_t number = small_number(word);
  return number == 0 ? std::uint16_t{0} : bit_of(static_cast<ChargerTrouble>(number - 1));
}

constexpr std::array<Validity, 3> thermistor_states{Validity::valid, Validity::open_circuit, Validity::short_circuit};
constexpr std::array<AuxiliaryContact, 3> auxiliary_states{AuxiliaryContact::follows, AuxiliaryContact::stays_open,
                                                           AuxiliaryContact::stays_closed};

using W = World;
using P = ScenarioPlace;
constexpr std::array<Handler, property_count> handlers{{
    {Property::vehicle_on, [](W& w, P, double) { w.inputs.vehicle_on = true; }},
    {Property::vehicle_off, [](W& w, P, double) { w.inputs.vehicle_on = false; }},
    {Property::vehicle_asks, [](W& w, P, double word) { w.requester.ask(static_cast<std::size_t>(word)); }},
    {Property::vehicle_asks_about,
     [](W& w, P, double number) { w.requester.number = static_cast<std::uint8_t>(number); }},
    {Property::charger_connected, [](W& w, P, double) { w.inputs.charger_connected = true; }},
    {Property::charger_disconnected, [](W& w, P, double) { w.inputs.charger_connected = false; }},
    {Property::charger_current, [](W& w, P, double v) { w.charger_A = v; }, [](const W& w, P) { return w.charger_A; }},
    {Property::charger_runaway, [](W& w, P, double v) { w.is_charger_runaway = v > 0.0; }},
    {Property::charger_unstoppable, [](W& w, P, double v) { w.is_charger_unstoppable = v > 0.0; }},
    {Property::charger_obeys, [](W& w, P, double v) { w.obeys_master = v == 0.0; }},
    {Property::charger_mains, [](W& w, P, double v) { w.can_chargers.has_mains = v > 0.0; }},
    {Property::charger_post, [](W& w, P, double v) { w.can_chargers.is_post = v > 0.0; }},
    {Property::charger_units, [](W& w, P, double v) { w.can_chargers.live_count = small_number(v); }},
    {Property::charger_trouble, [](W& w, P, double v) { w.can_chargers.troubles = trouble_bits(v); }},
    {Property::charger_lead, [](W& w, P, double v) { w.plant.set_charger_lead_Ohm(v / 1e3); },
     [](const W& w, P) { return w.plant.charger_lead_Ohm() * 1e3; }},
    {Property::charger_voltage, [](W& w, P, double v) { w.plant.set_charger_voltage_V(v); },
     [](const W& w, P) { return w.plant.charger_V(); }, [](W& w, P) { w.plant.set_charger_voltage_V(0.0); }},
    {Property::charger_senses, [](W& w, P, double v) { w.plant.set_charger_senses_terminals(v > 0.0); }},
    {Property::inverter_current, [](W& w, P, double v) { w.inverter.demand_A = v; },
     [](const W& w, P) { return w.inverter.demand_A; }},
    {Property::inverter_obeys, [](W& w, P, double v) { w.inverter.obeys = v == 0.0; }},
    {Property::inverter_silent, [](W& w, P, double) { w.inverter.is_silent = true; }},
    {Property::inverter_talking, [](W& w, P, double) { w.inverter.is_silent = false; }},
    {Property::inverter_failed, [](W& w, P, double v) { w.inverter.has_failed = v > 0.0; }},
    {Property::second_pack_soc,
     [](W& w, P, double v) {
       w.second_pack.soc_permille = v;
       w.second_pack.knows_soc = true;
     },
     [](const W& w, P) { return w.second_pack.soc_permille; }, [](W& w, P) { w.second_pack.knows_soc = false; }},
    {Property::second_pack_voltage, [](W& w, P, double v) { w.second_pack.voltage_mV = v; },
     [](const W& w, P) { return w.second_pack.voltage_mV.value_or(w.second_pack_rest_mV()); },
     [](W& w, P) { w.second_pack.voltage_mV.reset(); }},
    {Property::second_pack_current, [](W& w, P, double v) { w.second_pack.current_A = v; },
     [](const W& w, P) { return w.second_pack.current_A; }},
    {Property::second_pack_temperature, [](W& w, P, double v) { w.second_pack.temperature_dC = v; },
     [](const W& w, P) { return w.second_pack.temperature_dC; }},
    {Property::second_pack_state,
     [](W& w, P, double v) { w.second_pack.state = static_cast<SecondPackState>(v); }},
    {Property::second_pack_silent, [](W& w, P, double) { w.second_pack.is_silent = true; }},
    {Property::second_pack_talking, [](W& w, P, double) { w.second_pack.is_silent = false; }},
    {Property::load_current,
     [](W& w, P, double v) {
       w.load_A = v;
       w.profile = LoadProfile::none;
     },
     [](const W& w, P) { return w.load_A; }},
    {Property::load_profile,
     [](W& w, P place, double v) {
       w.cancel_ramps(Property::load_current, place);
       w.load_A = 0.0;
       w.profile = static_cast<LoadProfile>(v);
       w.profile_began_at = w.now;
     }},
    {Property::pack_soc,
     [](W& w, P, double v) { for_all_cells(w, [&](std::size_t cell) { w.plant.set_cell_soc(cell, v / 1e3); }); },
     [](const W& w, P) { return w.plant.cell(0).soc * 1e3; }},
    {Property::pack_ambient, [](W& w, P, double v) { w.plant.set_ambient_C(v / kelvin_to_tenths); },
     [](const W& w, P) { return w.plant.ambient_C() * kelvin_to_tenths; }},
    {Property::pack_temperature,
     [](W& w, P, double v) {
       for_all_cells(w, [&](std::size_t cell) {
         w.plant.hold_cell_temperature_C(cell, v / kelvin_to_tenths);
         w.plant.release_cell_temperature(cell);
       });
     },
     [](const W& w, P) { return w.plant.cell(0).temperature_C * kelvin_to_tenths; }},
    {Property::cell_voltage, [](W& w, P p, double v) { cell_sense(w, p).voltage_mV = v; },
     [](const W& w, P p) { return w.sensed_mV(w.cell_of(p)); }, [](W& w, P p) { cell_sense(w, p).voltage_mV.reset(); }},
    {Property::cell_offset, [](W& w, P p, double v) { cell_sense(w, p).offset_mV = v; },
     [](const W& w, P p) { return cell_sense(w, p).offset_mV; }},
    {Property::cell_soc, [](W& w, P p, double v) { w.plant.set_cell_soc(w.cell_of(p), v / 1e3); },
     [](const W& w, P p) { return plant_cell(w, p).soc * 1e3; }},
    {Property::cell_capacity,
     [](W& w, P p, double v) {
       w.plant.set_cell_capacity_As(w.cell_of(p), w.plant.config().cell.capacity_As * v / 1e3);
     },
     [](const W& w, P p) { return 1e3 / (plant_cell(w, p).soc_per_As * w.plant.config().cell.capacity_As); },
     [](W& w, P p) { w.plant.set_cell_capacity_As(w.cell_of(p), w.plant.config().cell.capacity_As); }},
    {Property::cell_resistance, [](W& w, P p, double v) { w.plant.set_cell_resistance_Ohm(w.cell_of(p), v / 1e3); },
     [](const W& w, P p) { return plant_cell(w, p).series_resistance_Ohm * 1e3; },
     [](W& w, P p) { w.plant.set_cell_resistance_Ohm(w.cell_of(p), w.plant.config().cell.series_resistance_Ohm); }},
    {Property::cell_leak, [](W& w, P p, double v) { w.plant.set_cell_leak_siemens(w.cell_of(p), 1.0 / v); },
     [](const W& w, P p) { return 1.0 / std::max(plant_cell(w, p).leak_siemens, 1e-9); },
     [](W& w, P p) { w.plant.set_cell_leak_siemens(w.cell_of(p), 0.0); }},
    {Property::cell_temperature,
     [](W& w, P p, double v) { w.plant.hold_cell_temperature_C(w.cell_of(p), v / kelvin_to_tenths); },
     [](const W& w, P p) { return plant_cell(w, p).temperature_C * kelvin_to_tenths; },
     [](W& w, P p) { w.plant.release_cell_temperature(w.cell_of(p)); }},
    {Property::cell_wire, [](W& w, P p, double v) { set_wire(w, p, static_cast<SenseWire>(v)); }},
    {Property::cell_stuck, [](W& w, P p, double v) { cell_sense(w, p).is_stuck = v > 0.0; }},
    {Property::cell_out_of_range, [](W& w, P p, double v) { cell_sense(w, p).is_out_of_range = v > 0.0; }},
    {Property::cell_balancing_switch,
     [](W& w, P p, double v) { cell_sense(w, p).balancing_switch = static_cast<BalancingSwitch>(v); }},
    {Property::cell_undervoltage_flag, [](W& w, P p, double v) { set_undervoltage_flag(w, p, v > 0.0); }},
    {Property::module_silent, [](W& w, P p, double) { module_wire(w, p).is_silent = true; }},
    {Property::module_talking, [](W& w, P p, double) { module_wire(w, p).is_silent = false; }},
    {Property::module_restart, [](W& w, P p, double) { module_sense(w, p).is_restart_wanted = true; }},
    {Property::module_crc_errors, [](W& w, P p, double v) { module_sense(w, p).has_crc_errors = v > 0.0; }},
    {Property::module_crc_error_rate, [](W& w, P p, double v) { module_sense(w, p).crc_error_permille = v; },
     [](const W& w, P p) { return module_sense(w, p).crc_error_permille; }},
    {Property::module_crc_wrong_bits,
     [](W& w, P p, double v) { module_sense(w, p).wrong_bits = static_cast<unsigned>(std::lround(v)); },
     [](const W& w, P p) -> double { return module_sense(w, p).wrong_bits; }},
    {Property::module_damaged_frames, [](W& w, P p, double v) { module_wire(w, p).has_damaged_frames = v > 0.0; }},
    {Property::module_stuck, [](W& w, P p, double v) { module_wire(w, p).is_stuck = v > 0.0; }},
    {Property::module_frozen_counter, [](W& w, P p, double v) { module_wire(w, p).has_frozen_counter = v > 0.0; }},
    {Property::module_replay, [](W& w, P p, double v) { module_wire(w, p).is_replaying = v > 0.0; }},
    {Property::module_omits, [](W& w, P p, double v) { module_wire(w, p).omitted = static_cast<OmittedFrames>(v); }},
    {Property::module_delay,
     [](W& w, P p, double v) { module_wire(w, p).delay = std::chrono::milliseconds(std::lround(v)); },
     [](const W& w, P p) { return static_cast<double>(to_ms(module_wire(w, p).delay)); }},
    {Property::module_sends_as_node, [](W& w, P p, double v) { module_wire(w, p).node = small_number(v); },
     [](const W& w, P p) -> double { return module_wire(w, p).node.value_or(p.node); },
     [](W& w, P p) { module_wire(w, p).node.reset(); }},
    {Property::module_cell_count, [](W& w, P p, double v) { module_wire(w, p).cell_count = small_number(v); },
     [](const W& w, P p) -> double { return module_wire(w, p).cell_count.value_or(module_config(w, p).cell_count); },
     [](W& w, P p) { module_wire(w, p).cell_count.reset(); }},
    {Property::module_temperature_sensor_count,
     [](W& w, P p, double v) { module_wire(w, p).temperature_sensor_count = small_number(v); },
     [](const W& w, P p) -> double {
       return module_wire(w, p).temperature_sensor_count.value_or(module_config(w, p).temperature_sensor_count);
     },
     [](W& w, P p) { module_wire(w, p).temperature_sensor_count.reset(); }},
    {Property::module_protocol_version,
     [](W& w, P p, double v) { module_wire(w, p).protocol_version = small_number(v); },
     [](const W& w, P p) -> double {
       return module_wire(w, p).protocol_version.value_or(internal_bus::protocol_version);
     },
     [](W& w, P p) { module_wire(w, p).protocol_version.reset(); }},
    {Property::module_serial_number,
     [](W& w, P p, double v) { module_wire(w, p).serial_number = static_cast<std::uint32_t>(std::llround(v)); },
     [](const W& w, P p) -> double {
       return module_wire(w, p).serial_number.value_or(module_config(w, p).serial_number);
     },
     [](W& w, P p) { module_wire(w, p).serial_number.reset(); }},
    {Property::module_commands, [](W& w, P p, double v) { module_sense(w, p).ignores_commands = v > 0.0; }},
    {Property::module_self_test, [](W& w, P p, double v) { module_sense(w, p).is_self_test_failed = v > 0.0; }},
    {Property::module_front_end_faults,
     [](W& w, P p, double v) { module_sense(w, p).reports_front_end_faults = v <= 0.0; }},
    {Property::module_front_end_supply,
     [](W& w, P p, double v) { module_sense(w, p).is_front_end_supply_low = v > 0.0; }},
    {Property::module_front_end_shutdown,
     [](W& w, P p, double v) { module_sense(w, p).is_front_end_shut_down = v > 0.0; }},
    {Property::module_errors,
     [](W& w, P p, double v) { module_sense(w, p).errors = static_cast<std::uint32_t>(std::llround(v)); },
     [](const W& w, P p) -> double { return module_sense(w, p).errors; }},
    {Property::module_board_temperature, [](W& w, P p, double v) { module_sense(w, p).board_temperature_dC = v; },
     [](const W& w, P p) {
       return module_sense(w, p).board_temperature_dC.value_or(w.plant.board_C(w.module_of(p)) * kelvin_to_tenths);
     },
     [](W& w, P p) { module_sense(w, p).board_temperature_dC.reset(); }},
    {Property::module_external_supply, [](W& w, P p, double v) { module_sense(w, p).external_supply_mV = v; },
     [](const W& w, P p) { return module_sense(w, p).external_supply_mV; }},
    {Property::module_talks_on_own_supply,
     [](W& w, P p, double v) { module_sense(w, p).talks_on_own_supply = v > 0.0; }},
    {Property::module_converts,
     [](W& w, P p, double v) { w.modules[w.module_of(p)].thermistor_curve = static_cast<ThermistorCurve>(v); }},
    {Property::module_thermistor_curve,
     [](W& w, P p, double v) { module_sense(w, p).thermistor_curve = static_cast<ThermistorCurve>(v); }},
    {Property::stranger_connected, [](W& w, P p, double) { w.has_stranger[p.node] = true; }},
    {Property::stranger_disconnected, [](W& w, P p, double) { w.has_stranger[p.node] = false; }},
    {Property::thermistor_state,
     [](W& w, P p,
        double v) { module_sense(w, p).thermistors[p.index].state = thermistor_states[static_cast<std::size_t>(v)]; }},
    {Property::thermistor_stuck,
     [](W& w, P p, double v) { set_stuck(module_sense(w, p).thermistors[p.index], v > 0.0); }},
    {Property::board_thermistor_state,
     [](W& w, P p,
        double
            v) { module_sense(w, p).board_thermistors[p.index].state = thermistor_states[static_cast<std::size_t>(v)]; }},
    {Property::board_thermistor_stuck,
     [](W& w, P p, double v) { set_stuck(module_sense(w, p).board_thermistors[p.index], v > 0.0); }},
    {Property::sensor_silent, [](W& w, P p, double) { w.sensor_senses[p.index].is_silent = true; }},
    {Property::sensor_talking, [](W& w, P p, double) { w.sensor_senses[p.index].is_silent = false; }},
    {Property::sensor_offset_current, set_sensor_offset, sensor_offset},
    {Property::sensor_value_current, set_sensor_value, sensor_real, release_sensor_value},
    {Property::sensor_offset_voltage, set_sensor_offset, sensor_offset},
    {Property::sensor_value_voltage, set_sensor_value, sensor_real, release_sensor_value},
    {Property::sensor_gain, [](W& w, P p, double v) { w.sensor_senses[p.index].gain = v / 1e3; },
     [](const W& w, P p) { return w.sensor_senses[p.index].gain * 1e3; }},
    {Property::sensor_stuck, [](W& w, P p, double v) { w.sensor_senses[p.index].is_stuck = v > 0.0; }},
    {Property::sensor_inverted, [](W& w, P p, double v) { w.sensor_senses[p.index].is_inverted = v > 0.0; }},
    {Property::sensor_error, [](W& w, P p, double v) { w.sensor_senses[p.index].has_error = v > 0.0; }},
    {Property::sensor_unit_restart, [](W& w, P, double) { w.sensor_unit.restart(w.now); }},
    {Property::sensor_unit_answers, [](W& w, P, double v) { w.sensor_unit.answers = v > 0.0; }},
    {Property::sensor_unit_byte_order,
     [](W& w, P, double v) { give_all(w, [v](SensorSetting& setting) { setting.is_little_endian = v > 0.0; }); }},
    {Property::sensor_unit_sign,
     [](W& w, P, double v) { give_current(w, [v](SensorSetting& setting) { setting.is_inverted = v > 0.0; }); }},
    {Property::sensor_unit_period,
     [](W& w, P, double v) {
       give_current(w, [v](SensorSetting& setting) { setting.period_ms = static_cast<std::int32_t>(std::lround(v)); });
     }},
    {Property::pdu_silent, [](W& w, P, double) { w.is_pdu_silent = true; }},
    {Property::pdu_talking, [](W& w, P, double) { w.is_pdu_silent = false; }},
    {Property::pdu_damaged_frames, [](W& w, P, double v) { w.has_pdu_damaged_frames = v > 0.0; }},
    {Property::pdu_throttle, [](W& w, P, double v) { w.throttle_permille = v; },
     [](const W& w, P) { return w.throttle_permille.value_or(0.0); }, [](W& w, P) { w.throttle_permille.reset(); }},
    {Property::pdu_intake_air, [](W& w, P, double v) { w.intake_air_dC = v; },
     [](const W& w, P) { return w.intake_air_dC.value_or(0.0); }, [](W& w, P) { w.intake_air_dC.reset(); }},
    {Property::pdu_alarm_loop, [](W& w, P, double v) { w.has_alarm_loop = v > 0.0; }},
    {Property::contactor_welded, [](W& w, P p, double) { contactor(w, p).set_fault(ContactorFault::welded); }},
    {Property::contactor_stuck_open, [](W& w, P p, double) { contactor(w, p).set_fault(ContactorFault::stuck_open); }},
    {Property::contactor_ok, [](W& w, P p, double) { contactor(w, p).set_fault(ContactorFault::none); }},
    {Property::contactor_feedback,
     [](W& w, P p, double v) { contactor(w, p).set_auxiliary(auxiliary_states[static_cast<std::size_t>(v)]); }},
    {Property::estop_pressed, [](W& w, P p, double) { set_estop(w, p, false); }},
    {Property::estop_released, [](W& w, P p, double) { set_estop(w, p, true); }},
    {Property::interlock_open, [](W& w, P, double) { w.inputs.interlock_closed = false; }},
    {Property::interlock_closed, [](W& w, P, double) { w.inputs.interlock_closed = true; }},
    {Property::insulation_resistance, [](W& w, P, double v) { w.insulation.resistance_kOhm = v; },
     [](const W& w, P) { return w.insulation.resistance_kOhm; }},
    {Property::insulation_monitor,
     [](W& w, P, double v) {
       w.insulation.set_state(static_cast<InsulationMonitor>(v), w.now);
       w.can_insulation.state = static_cast<InsulationMonitor>(v);
     }},
    {Property::insulation_frequency, [](W& w, P, double v) { w.insulation.frequency_Hz = v; },
     [](const W& w, P) { return w.insulation.pwm.frequency_mHz / 1e3; },
     [](W& w, P) { w.insulation.frequency_Hz.reset(); }},
    {Property::insulation_duty, [](W& w, P, double v) { w.insulation.duty_permille = v; },
     [](const W& w, P) { return static_cast<double>(w.insulation.pwm.duty_permille); },
     [](W& w, P) { w.insulation.duty_permille.reset(); }},
    {Property::insulation_wire, [](W& w, P, double v) { w.insulation.wire = static_cast<SignalWire>(v); }},
    {Property::insulation_self_test,
     [](W& w, P, double v) { w.can_insulation.self_test = static_cast<SelfTest>(v); }},
    {Property::link_capacitance, [](W& w, P, double v) { w.plant.set_link_capacitance_F(v / 1e6); },
     [](const W& w, P) { return w.plant.link_capacitance_F() * 1e6; }},
    {Property::link_bleed, [](W& w, P, double v) { w.plant.set_link_bleed_Ohm(v); },
     [](const W& w, P) { return w.plant.link_bleed_Ohm(); }},
    {Property::precharge_resistance, [](W& w, P, double v) { w.plant.set_precharge_resistance_Ohm(v); },
     [](const W& w, P) { return w.plant.precharge_resistance_Ohm(); }},
    {Property::resume_button_pressed, [](W& w, P, double) { w.inputs.resume_button = true; }},
    {Property::resume_button_released, [](W& w, P, double) { w.inputs.resume_button = false; }},
    {Property::master_clear, order<Property::master_clear>},
    {Property::master_clear_authorised, order<Property::master_clear_authorised>},
    {Property::master_wake, order<Property::master_wake>},
    {Property::master_balancing, order<Property::master_balancing>},
    {Property::master_accept_modules, order<Property::master_accept_modules>},
}};

static_assert(rows_are_in_order(handlers, &Handler::property), "handlers[] is indexed by Property");

const Handler& handler_of(Property property) {
  return handlers[static_cast<std::size_t>(property)];
}

}  // namespace

void World::apply(const ScenarioEvent& event, TimePoint time) {
  now = time;
  const Handler& handler = handler_of(event.property);
  const ScenarioValue& value = event.value;
  cancel_ramps(event.property, event.place);
  switch (value.kind) {
    case ScenarioValue::Kind::none: handler.set(*this, event.place, 0.0); break;
    case ScenarioValue::Kind::number: handler.set(*this, event.place, value.number); break;
    case ScenarioValue::Kind::word: handler.set(*this, event.place, value.word); break;
    case ScenarioValue::Kind::automatic: handler.release(*this, event.place); break;
    case ScenarioValue::Kind::ramp:
    case ScenarioValue::Kind::ramp_from_present: {
      const bool has_start = value.kind == ScenarioValue::Kind::ramp;
      const double from = has_start ? value.from : handler.get(*this, event.place);
      ramps_.push_back({event.property, event.place, from, value.number, time, value.over});
      handler.set(*this, event.place, from);
      break;
    }
  }
}

void World::cancel_ramps(Property property, ScenarioPlace place) {
  std::erase_if(ramps_, [&](const Ramp& ramp) { return ramp.property == property && ramp.place == place; });
}

void World::step_ramps() {
  for (const Ramp& ramp : ramps_) {
    const double share = std::min(to_s(now - ramp.began_at) / to_s(ramp.over), 1.0);
    handler_of(ramp.property).set(*this, ramp.place, ramp.from + (ramp.to - ramp.from) * share);
  }
  std::erase_if(ramps_, [this](const Ramp& ramp) { return now - ramp.began_at >= ramp.over; });
}

}  // namespace bmu

// Readers for the sensor, the power distribution unit and its inputs, insulation, contactors, buses, and the daemon
// itself.
#include <algorithm>
#include <bit>
#include <cstdlib>
#include <limits>

#include "daemon/core/faults/fault_reader_parts.hpp"
#include "daemon/core/types/contactors.hpp"

namespace bmu::fault_readers {

namespace {

constexpr std::int64_t insulation_max_Ohm = std::numeric_limits<std::int32_t>::max();

/// No usable value within its maximum age; a value that was never received counts as lost once the start is over.
Reading lost(const FaultInputs& in, const Measured<std::int32_t>& value, Duration age_max) {
  if (!in.has_started) return unknown_reading;
  return condition(!value.is_usable(in.now, age_max), value.taken_at);
}

/// The first reading if it is bad, otherwise the second.
Reading worse_of(const Reading& one, const Reading& other) {
  return one.is_known && one.value != 0 ? one : other;
}

/// The PDU state if it is usable, otherwise null. Its loss is a fault of its own.
const PduState* pdu_of(const FaultInputs& in) {
  const Measured<PduState>& pdu = in.sensors->pdu;
  return pdu.is_usable(in.now, in.config->ages.pdu_status) ? &pdu.value : nullptr;
}
Reading input(const FaultInputs& in, bool PduState::*healthy) {
  const PduState* pdu = pdu_of(in);
  return pdu == nullptr ? unknown_reading : condition(!(pdu->*healthy), in.sensors->pdu.taken_at);
}

/// Condition: a bit is set; the first one gives the number of the input.
Reading lines(const FaultInputs& in, std::uint16_t PduState::*bad, std::uint8_t first_number) {
  const PduState* pdu = pdu_of(in);
  if (pdu == nullptr) return unknown_reading;
  const std::uint16_t mask = pdu->*bad;
  const auto number = static_cast<std::uint8_t>(first_number + std::countr_zero(mask));
  return condition(mask != 0, in.sensors->pdu.taken_at, {.input = mask != 0 ? number : std::uint8_t{0}});
}

/// Resistance reported by the insulation monitor. A value above its range counts as the maximum, and so does an unknown
/// value in a usable PDU state unless measuring is configured.
Reading insulation(const FaultInputs& in) {
  const PduState* pdu = pdu_of(in);
  const bool is_measured = in.config->insulation.monitoring == InsulationMonitoring::measured;
  if (!is_measured && pdu != nullptr && !knows_insulation(*pdu)) return {true, insulation_max_Ohm, {}, in.now};
  if (pdu == nullptr || !knows_insulation(*pdu)) return unknown_reading;
  const SignalValue& resistance = pdu->insulation_resistance_Ohm;
  const std::int64_t value_Ohm = resistance.is_valid() ? resistance.value : insulation_max_Ohm;
  const bool is_heard_itself = in.config->insulation.is_heard_itself();
  return {true, value_Ohm, {}, is_heard_itself ? in.sensors->insulation.taken_at : in.sensors->pdu.taken_at};
}

/// The monitor reports too little voltage to measure, in a closed pack that does not have empty cells.
bool denies_the_voltage(const FaultInputs& in, const PduState& pdu) {
  const Measured<std::int32_t>& pack = in.pack->pack_voltage_mV;
  const std::int64_t empty_mV = mV_from_uV(std::int64_t{in.config->limits.cell_undervoltage.open} *
                                           static_cast<std::int64_t>(cell_count(*in.config)));
  return pdu.insulation_state == InsulationState::undervoltage && in.flags.closed_since != TimePoint{} &&
         pack.is_valid() && pack.value > empty_mV;
}

bool has_silent_inverter(const FaultInputs& in) {
  return in.inverter != nullptr && in.inverter->is_silent(in.now, in.flags.closed_since);
}
bool opens_without_inverter(const FaultInputs& in) {
  return in.inverter->config().when_silent == SilentInverter::open;
}

bool is_for_driving(const FaultInputs& in) {
  return in.flags.is_driving && !in.config->insulation.opens_while_driving;
}

}  // namespace

// --- sensor, power distribution unit, inputs ------------------------------------------------------------------------

Reading current_sensor_lost(const FaultInputs& in) {
  const Duration age_max = in.config->ages.pack_current;
  const Reading first = lost(in, in.sensors->current_mA, age_max);
  if (!in.config->sensor.has_second_current) return first;
  return worse_of(first, lost(in, in.sensors->current_2_mA, age_max));
}
Reading voltage_sensor_lost(const FaultInputs& in) {
  const Duration age_max = in.config->ages.pack_voltage;
  return worse_of(lost(in, in.sensors->pack_voltage_mV, age_max), lost(in, in.sensors->link_voltage_mV, age_max));
}
Reading sensor_not_set_up(const FaultInputs& in) {
  return condition(in.flags.sensor_not_set_up, in.now);
}
/// If GPIO lines of this host supply some inputs and cannot be read, the merged state is unknown (merge_inputs), and
/// that is lines_failed alone: a PDU that is received is not lost because of it.
Reading pdu_lost(const FaultInputs& in) {
  if (!in.has_started) return unknown_reading;
  const Measured<PduState>& word = in.sensors->pdu_word;
  const bool is_unit_heard = in.config->contactors.has_pdu && word.is_usable(in.now, in.config->ages.pdu_status);
  if (in.flags.lines_failed && is_unit_heard) return condition(false, word.taken_at);
  return condition(pdu_of(in) == nullptr, in.sensors->pdu.taken_at);
}
Reading pdu_opened_by_itself(const FaultInputs& in) {
  const PduState* pdu = pdu_of(in);
  if (pdu == nullptr) return unknown_reading;
  return condition(in.flags.closing_is_commanded && (pdu->opened_by_timeout || in.flags.pdu_restarted),
                   in.sensors->pdu.taken_at);
}
/// Unknown while the PDU is lost and before the start is over; a PDU without such a loop never reports it as open.
/// Modules that sleep until the daemon has started keep it open.
Reading alarm_loop_open(const FaultInputs& in) {
  const PduState* pdu = pdu_of(in);
  if (!in.has_started || pdu == nullptr) return unknown_reading;
  return condition(pdu->alarm_loop_open, in.sensors->pdu.taken_at);
}
Reading emergency_stop(const FaultInputs& in) {
  Reading first = input(in, &PduState::estop_1_released);
  first.element.input = 1;
  Reading second = input(in, &PduState::estop_2_released);
  second.element.input = 2;
  // Those on GPIO lines of this host are numbered after the PDU's two.
  return worse_of(worse_of(first, second), lines(in, &PduState::estops_pressed, 3));
}
Reading interlock_open(const FaultInputs& in) {
  Reading unit = input(in, &PduState::interlock_closed);
  unit.element.input = 1;
  return worse_of(unit, lines(in, &PduState::interlocks_open, 2));
}
Reading supply_low(const FaultInputs& in) {
  return input(in, &PduState::supply_ok);
}
Reading lines_failed(const FaultInputs& in) {
  return condition(in.flags.lines_failed, in.now);
}

// --- insulation -----------------------------------------------------------------------------------------------------

Reading insulation_not_ok(const FaultInputs& in) {
  return input(in, &PduState::insulation_monitor_ok);
}
Reading insulation_Ohm(const FaultInputs& in) {
  return is_for_driving(in) ? unknown_reading : insulation(in);
}
Reading insulation_driving_Ohm(const FaultInputs& in) {
  if (is_for_driving(in)) return insulation(in);
  return {true, insulation_max_Ohm, {}, in.now};
}

/// A monitor that measures reports this repeatedly. After its start, or that of the daemon, the first value may take
/// `first_value_max`; after the first value, an unknown value counts as lost. The row's confirm time tolerates one or
/// two such reports. While a first self-test is awaited, which has a timeout of its own, the reading is unknown: it
/// neither raises nor clears. For a monitor that has reported a value, a later self-test counts as lost.
Reading insulation_monitor_lost(const FaultInputs& in) {
  constexpr Duration first_value_max = 20s;
  if (in.config->insulation.monitoring != InsulationMonitoring::measured) return condition(false, in.now);
  const PduState* pdu = pdu_of(in);
  const bool awaits_first_test = in.sensors->insulation.awaits_first_test && !in.sensors->insulation_told;
  if (pdu == nullptr || awaits_first_test) return unknown_reading;
  const InsulationState state = pdu->insulation_state;
  const bool says_bad = state == InsulationState::no_signal || state == InsulationState::device_error ||
                        state == InsulationState::earth_fault || state == InsulationState::undefined;
  const bool may_be_starting =
      !in.sensors->insulation_told && in.now - in.sensors->insulation_known_at <= first_value_max;
  const bool is_silent = !knows_insulation(*pdu) && !may_be_starting;
  return condition(says_bad || is_silent || denies_the_voltage(in, *pdu), in.sensors->pdu.taken_at);
}

Reading insulation_monitor_untested(const FaultInputs& in) {
  return condition(in.flags.insulation_untested, in.now);
}

// --- contactors -----------------------------------------------------------------------------------------------------

Reading precharge_too_slow(const FaultInputs& in) {
  return condition(in.flags.precharge_failure == PrechargeFailure::too_slow, in.now);
}
Reading precharge_too_fast(const FaultInputs& in) {
  return condition(in.flags.precharge_failure == PrechargeFailure::too_fast, in.now);
}
Reading precharge_overcurrent(const FaultInputs& in) {
  return condition(in.flags.precharge_failure == PrechargeFailure::overcurrent, in.now);
}
Reading contactor_not_following(const FaultInputs& in) {
  return condition(in.flags.contactor_not_following != 0, in.now, {.contactor = in.flags.contactor_not_following});
}
Reading contactor_welded(const FaultInputs& in) {
  return condition(in.flags.contactor_welded != 0, in.now, {.contactor = in.flags.contactor_welded});
}

/// Auxiliary contacts that are closed and a DC link voltage that contradicts them: the voltage decides. False in an
/// open pack.
Reading link_not_following(const FaultInputs& in) {
  const Measured<std::int32_t>& pack = in.pack->pack_voltage_mV;
  const Measured<std::int32_t>& link = in.pack->link_voltage_mV;
  const TimePoint closed_since = in.flags.closed_since;
  if (closed_since == TimePoint{}) return condition(false, in.now);
  const bool is_known =
      pack.is_valid() && link.is_valid() && pack.taken_at > closed_since && link.taken_at > closed_since;
  if (!is_known) return unknown_reading;
  const std::int64_t apart_mV = unexplained_mV(in, pack, link, pack_resistance_uOhm(*in.config));
  return condition(apart_mV > link_apart_max_mV(pack.value, in.config->contactors), link.taken_at);
}

/// The opposite: all contactors are open, but the DC link stays at pack voltage, which no capacitor does for long. Both
/// voltages are of the open pack and sampled together: a pack voltage from before the opening may be one under load.
Reading link_not_discharging(const FaultInputs& in) {
  const Measured<std::int32_t>& pack = in.pack->pack_voltage_mV;
  const Measured<std::int32_t>& link = in.pack->link_voltage_mV;
  if (in.flags.open_since == TimePoint{}) return condition(false, in.now);
  const TimePoint judged_from = in.flags.open_since + in.config->contactors.link_decay + 1ns;
  const bool is_known =
      pack.is_valid() && link.is_valid() && are_taken_together_since(judged_from, pack.taken_at, link.taken_at);
  if (!is_known) return unknown_reading;
  return condition(link_follows(pack.value, link.value, in.config->contactors), link.taken_at);
}

// --- buses and the daemon itself ------------------------------------------------------------------------------------

/// Dated by the last values that the charger sent.
Reading charger_silent(const FaultInputs& in) {
  const std::uint8_t unit = in.charger_watch != nullptr ? in.charger_watch->silent_unit() : std::uint8_t{0};
  if (unit == 0) return condition(false, in.now);
  const bool is_there = unit <= in.chargers->unit_count();  // a recorded core may name a unit that this pack lacks
  return condition(true, is_there ? in.chargers->unit(unit - 1U).values_at : TimePoint{});
}
/// The amount is given by ChargerWatch::excess().
Reading charger_runaway(const FaultInputs& in) {
  const ChargerWatch* const watch = in.charger_watch;
  return condition(watch != nullptr && watch->runs_away(), watch != nullptr ? watch->runs_away_at() : in.now);
}
Reading charger_keeps_on(const FaultInputs& in) {
  return condition(in.charger_watch != nullptr && in.charger_watch->keeps_on(), in.pack->current_mA.taken_at);
}
/// Reports of missing pack, mains or commands do not count while nothing is requested of the charger.
Reading charger_trouble(const FaultInputs& in) {
  if (in.charger_watch == nullptr || !in.chargers->is_there()) return condition(false, in.now);
  const bool is_asked = in.charger_watch->is_asked(in.now, in.chargers->driver().settle);
  return condition(in.chargers->troubles(in.now, is_asked).bits != 0, in.now);
}
Reading charger_contradicts(const FaultInputs& in) {
  return condition(in.charger_watch != nullptr && in.charger_watch->contradicts(), in.now);
}
/// A single command is proof enough; it counts for reporter_memory, so that a tick cannot miss it.
Reading foreign_charger_command(const FaultInputs& in, bool while_plugged_in) {
  const bool is_plugged_in = in.charger_watch != nullptr && in.charger_watch->is_plugged_in();
  const bool is_asked = in.chargers != nullptr && is_plugged_in == while_plugged_in;
  const TimePoint at = is_asked ? in.chargers->foreign_command_at() : TimePoint{};
  return condition(at != TimePoint{} && in.now - at <= BusWatch::reporter_memory, at);
}
/// While no charger is plugged in another master's command does no harm, and a driven pack must be able to brake.
Reading foreign_charger_master(const FaultInputs& in) {
  return foreign_charger_command(in, true);
}
Reading foreign_charger_commands(const FaultInputs& in) {
  return foreign_charger_command(in, false);
}
Reading inverter_silent(const FaultInputs& in) {
  const bool is_silent = has_silent_inverter(in) && !opens_without_inverter(in);
  return condition(is_silent, is_silent ? in.inverter->heard_at() : in.now);
}
Reading inverter_lost(const FaultInputs& in) {
  const bool is_lost = has_silent_inverter(in) && opens_without_inverter(in);
  return condition(is_lost, is_lost ? in.inverter->heard_at() : in.now);
}
Reading inverter_trouble(const FaultInputs& in) {
  return condition(in.inverter != nullptr && in.inverter->has_trouble(in.now), in.now);
}
/// The other battery may report full charge current where this one permits none.
Reading foreign_battery(const FaultInputs& in) {
  if (in.inverter == nullptr) return condition(false, in.now);
  return condition(in.inverter->has_foreign_battery(in.now), in.inverter->foreign_at());
}
Reading foreign_master(const FaultInputs& in) {
  return condition(in.flags.foreign_master_seen, in.now);
}
Reading foreign_reporter(const FaultInputs& in) {
  return condition(in.watchers->bus.has_foreign_report(in.now), in.watchers->bus.foreign_report_at());
}
Reading second_pack_silent(const FaultInputs& in) {
  const bool is_silent = in.second_pack != nullptr && in.second_pack->is_silent(in.now);
  return condition(is_silent, is_silent ? in.second_pack->heard_at() : in.now);
}
Reading internal_bus_down(const FaultInputs& in) {
  return condition(!in.flags.internal_bus_up, in.now);
}
Reading bus_off_storm(const FaultInputs& in) {
  return condition(in.watchers->bus.is_storm(in.now), in.now);
}
Reading bus_error_passive(const FaultInputs& in) {
  return condition(in.watchers->bus.is_error_passive(), in.now);
}
Reading command_not_on_bus(const FaultInputs& in) {
  return condition(in.flags.closing_is_commanded && in.flags.command_not_on_bus, in.now);
}
Reading frames_lost(const FaultInputs& in) {
  return condition(in.flags.frames_lost_seen, in.now);
}
Reading loop_gap(const FaultInputs& in) {
  return condition(in.flags.loop_gap_seen, in.now);
}
Reading tick_overrun(const FaultInputs& in) {
  return condition(in.flags.tick_was_late, in.now);
}
Reading store_unreadable(const FaultInputs& in) {
  return condition(in.flags.health.store_unreadable, in.now);
}
Reading store_write_failed(const FaultInputs& in) {
  return condition(in.flags.health.store_write_failed, in.now);
}

Reading history_write_failed(const FaultInputs& in) {
  return condition(in.flags.health.history_write_failed, in.now);
}
Reading clock_jump(const FaultInputs& in) {
  return condition(in.flags.clock_jumped, in.now);
}
Reading memory_low(const FaultInputs& in) {
  return condition(in.flags.health.memory_low, in.now);
}
Reading disk_low(const FaultInputs& in) {
  return condition(in.flags.health.disk_low, in.now);
}

}  // namespace bmu::fault_readers

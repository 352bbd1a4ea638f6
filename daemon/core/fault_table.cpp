#include "daemon/core/fault_table.hpp"

#include <algorithm>
#include <cstdlib>

#include "daemon/core/contactor_sequence.hpp"
#include "protocol/assert.hpp"

namespace bmu {

std::string_view to_text(Reaction reaction) {
  switch (reaction) {
    case Reaction::warn: return "warn";
    case Reaction::open_after_grace: return "open after grace";
    case Reaction::open_now: return "open now";
  }
  return "?";
}

std::string_view to_text(Latch latch) {
  switch (latch) {
    case Latch::none: return "none";
    case Latch::until_cleared: return "until cleared";
  }
  return "?";
}

namespace {

// --- what the rows read
// -----------------------------------------------------------------------------------------------

Reading lowest(const Spread& spread) {
  return {spread.is_known(), spread.min, spread.min_at, spread.min_taken_at, !spread.is_complete()};
}
Reading highest(const Spread& spread) {
  return {spread.is_known(), spread.max, spread.max_at, spread.max_taken_at, !spread.is_complete()};
}
Reading condition(bool is_true, TimePoint seen_at, const Element& element = {}) {
  return {true, is_true ? 1 : 0, element, seen_at};
}
constexpr Reading unknown_reading{};

Reading read_cell_voltage_min(const FaultInputs& in) {
  return lowest(in.pack->cell_voltage_uV);
}
Reading read_cell_voltage_max(const FaultInputs& in) {
  return highest(in.pack->cell_voltage_uV);
}
Reading read_cell_temperature_max(const FaultInputs& in) {
  return highest(in.pack->cell_temperature_dC);
}
Reading read_cell_temperature_min(const FaultInputs& in) {
  return lowest(in.pack->cell_temperature_dC);
}

Reading read_discharge_current(const FaultInputs& in) {
  const Measured<std::int32_t>& current = in.pack->current_mA;
  return {current.is_valid(), current.value, {}, current.taken_at};
}
Reading read_charge_current(const FaultInputs& in) {
  const Measured<std::int32_t>& current = in.pack->current_mA;
  return {current.is_valid(), -std::int64_t{current.value}, {}, current.taken_at};
}

/// How far apart two voltages are that were not taken at the same moment, less what the current explains: twice what
/// the model's resistance makes of its swing since the older one. Cold cells have more than their data sheet says.
std::int64_t unexplained_mV(const FaultInputs& in, const Measured<std::int32_t>& one,
                            const Measured<std::int32_t>& other) {
  constexpr std::int64_t products_per_mV = 1'000'000;  // of mA and uOhm
  const TimePoint since = one.taken_at < other.taken_at ? one.taken_at : other.taken_at;
  const std::int64_t swing_mA = in.sensors->current_window.swing_mA(since);
  const std::int64_t explained_mV = 2 * swing_mA * pack_resistance_uOhm(*in.config) / products_per_mV;
  return std::max<std::int64_t>(std::llabs(std::int64_t{one.value} - other.value) - explained_mV, 0);
}

Reading read_voltage_mismatch(const FaultInputs& in) {
  const Measured<std::int32_t>& sum = in.pack->cell_voltage_sum_mV;
  const Measured<std::int32_t>& pack = in.pack->pack_voltage_mV;
  if (!sum.is_valid() || !pack.is_valid()) return unknown_reading;
  const TimePoint taken_at = sum.taken_at > pack.taken_at ? sum.taken_at : pack.taken_at;
  return {true, unexplained_mV(in, sum, pack), {}, taken_at};
}

/// First module for which `is_bad` holds. `seen_at` tells when that was last heard of.
template <class IsBad, class SeenAt>
Reading first_module(const FaultInputs& in, IsBad is_bad, SeenAt seen_at) {
  for (const ModuleRecord& module : in.modules->modules()) {
    if (is_bad(module)) return condition(true, seen_at(module), {.module_node = module.config.node});
  }
  return condition(false, in.now);
}

Reading read_module_lost(const FaultInputs& in) {
  if (!in.has_started) return unknown_reading;
  return first_module(
      in, [&in](const ModuleRecord& module) { return !is_answering(module, in.config->ages, in.now); },
      [](const ModuleRecord& module) { return module.last_answer_at; });
}

/// First value of a group that is no number, or did not come.
template <class Values>
Reading first_invalid(const ModuleRecord& module, const Values& values, std::uint8_t count, Duration age_max,
                      TimePoint now) {
  for (std::uint8_t index = 0; index < count; ++index) {
    const Measured<std::int32_t>& value = values[index];
    const bool is_fresh = value.is_fresh(now, age_max);
    if (!value.is_valid() || !is_fresh) {
      // What does not come at all has no samples to count; there every look is one.
      return condition(true, is_fresh ? value.taken_at : now,
                       {.module_node = module.config.node, .number = static_cast<std::uint8_t>(index + 1)});
    }
  }
  return condition(false, now);
}

Reading read_cell_not_measured(const FaultInputs& in) {
  if (!in.has_started) return unknown_reading;
  Reading good = condition(false, in.now);
  for (const ModuleRecord& module : in.modules->modules()) {
    if (!is_answering(module, in.config->ages, in.now)) {  // that is module_lost
      good.is_partial = true;
      continue;
    }
    const Reading reading =
        first_invalid(module, module.cell_voltage_uV, module.config.cell_count, in.config->ages.cell_voltage, in.now);
    if (reading.value != 0) return reading;
  }
  return good;
}

Reading read_temperature_not_measured(const FaultInputs& in) {
  if (!in.has_started) return unknown_reading;
  for (const ModuleRecord& module : in.modules->modules()) {
    Reading reading = first_invalid(module, module.cell_temperature_dC, module.config.temperature_sensor_count,
                                    in.config->ages.temperature, in.now);
    reading.element.is_temperature_sensor = true;
    if (reading.value != 0) return reading;
  }
  return condition(false, in.now);
}

bool says_failed(const ModuleRecord& module) {
  const ModuleStatus& said = module.status.value;
  return module.status.is_valid() &&
         (said.undervoltage_cells != 0 || said.overvoltage_cells != 0 || said.open_cell_wire || said.self_test_failed);
}

Reading read_module_reports_fault(const FaultInputs& in) {
  return first_module(
      in, [](const ModuleRecord& module) { return says_failed(module) || module.open_wire_cells != 0; },
      // The mask of open wires comes with the module voltage.
      [](const ModuleRecord& module) {
        return says_failed(module) ? module.status.taken_at : module.module_voltage_mV.taken_at;
      });
}

/// What wears or misleads but endangers nothing yet; a value that is missing because of it has a fault of its own.
Reading read_module_warning(const FaultInputs& in) {
  return first_module(
      in,
      [](const ModuleRecord& module) {
        const ModuleStatus& said = module.status.value;
        return module.status.is_valid() && (said.board_too_hot || said.external_supply_low ||
                                            said.temperature_sensor_fault || said.front_end_crc_errors);
      },
      [](const ModuleRecord& module) { return module.status.taken_at; });
}

Reading read_module_mismatch(const FaultInputs& in) {
  return first_module(
      in,
      [&in](const ModuleRecord& module) {
        const bool wrong_count = module.status.is_valid() && module.status.value.cell_count != module.config.cell_count;
        const ModuleIdentity& identity = module.identity.value;
        const bool wrong_identity =
            module.identity.is_valid() && (identity.protocol_version != internal_bus::protocol_version ||
                                           identity.cell_count != module.config.cell_count ||
                                           identity.temperature_sensor_count < module.config.temperature_sensor_count);
        const bool has_rival = module.rival_seen_at != TimePoint{} && in.now - module.rival_seen_at <= conflict_memory;
        return wrong_count || wrong_identity || has_rival;
      },
      [](const ModuleRecord& module) { return module.status.taken_at; });
}

/// A sensor that has no usable word within its age; before it was ever heard that counts once starting is over.
Reading lost(const FaultInputs& in, const Measured<std::int32_t>& value, Duration age_max) {
  if (!in.has_started) return unknown_reading;
  return condition(!value.is_usable(in.now, age_max), value.taken_at);
}

Reading read_current_sensor_lost(const FaultInputs& in) {
  return lost(in, in.sensors->current_mA, in.config->ages.pack_current);
}
Reading read_voltage_sensor_lost(const FaultInputs& in) {
  const Reading pack = lost(in, in.sensors->pack_voltage_mV, in.config->ages.pack_voltage);
  return pack.is_known && pack.value != 0 ? pack : lost(in, in.sensors->link_voltage_mV, in.config->ages.pack_voltage);
}
Reading read_pdu_lost(const FaultInputs& in) {
  if (!in.has_started) return unknown_reading;
  return condition(!in.sensors->pdu.is_usable(in.now, in.config->ages.pdu_status), in.sensors->pdu.taken_at);
}

/// An input of a PDU that was heard. Its loss is a fault of its own.
template <class IsBad>
Reading input(const FaultInputs& in, IsBad is_bad) {
  const Measured<PduState>& pdu = in.sensors->pdu;
  if (!pdu.is_usable(in.now, in.config->ages.pdu_status)) return unknown_reading;
  return condition(is_bad(pdu.value), pdu.taken_at);
}

Reading read_emergency_stop(const FaultInputs& in) {
  return input(in, [](const PduState& pdu) { return !pdu.estop_1_released || !pdu.estop_2_released; });
}
Reading read_interlock(const FaultInputs& in) {
  return input(in, [](const PduState& pdu) { return !pdu.interlock_closed; });
}
Reading read_insulation(const FaultInputs& in) {
  return input(in, [](const PduState& pdu) { return !pdu.insulation_monitor_ok; });
}

Reading read_pdu_opened_by_itself(const FaultInputs& in) {
  return input(in, [&in](const PduState& pdu) {
    return in.flags.closing_is_commanded && (pdu.opened_by_timeout || in.flags.pdu_restarted);
  });
}
Reading read_command_not_on_bus(const FaultInputs& in) {
  return condition(in.flags.closing_is_commanded && in.flags.command_not_on_bus, in.now);
}

Reading read_precharge_failed(const FaultInputs& in) {
  return condition(in.flags.precharge_failed, in.now);
}
Reading read_contactor_feedback(const FaultInputs& in) {
  return condition(in.flags.contactors_disobey, in.now);
}
/// Contacts that say closed and a link that says otherwise: believed is the link. An open pack has nothing to follow.
Reading read_link_not_following(const FaultInputs& in) {
  const Measured<std::int32_t>& pack = in.pack->pack_voltage_mV;
  const Measured<std::int32_t>& link = in.pack->link_voltage_mV;
  const TimePoint closed_since = in.flags.closed_since;
  if (closed_since == TimePoint{}) return condition(false, in.now);
  const bool is_known =
      pack.is_valid() && link.is_valid() && pack.taken_at > closed_since && link.taken_at > closed_since;
  if (!is_known) return unknown_reading;
  const bool is_apart = unexplained_mV(in, pack, link) > link_apart_max_mV(pack.value, in.config->contactors);
  return condition(is_apart, link.taken_at);
}

Reading read_foreign_master(const FaultInputs& in) {
  return condition(in.flags.foreign_master_seen, in.now);
}
Reading read_internal_bus_down(const FaultInputs& in) {
  return condition(!in.flags.internal_bus_up, in.now);
}
Reading read_loop_gap(const FaultInputs& in) {
  return condition(in.flags.loop_gap_seen, in.now);
}
Reading read_frames_lost(const FaultInputs& in) {
  return condition(in.flags.frames_lost_seen, in.now);
}

// --- the table
// --------------------------------------------------------------------------------------------------------

using enum Reaction;
using enum Sense;

// Longest reactions by the project's budgets: voltage and current 450 ms, temperature 950 ms, a silent module 400 ms,
// a silent sensor or PDU 300 ms, inputs at once. Ages and confirm times add up to less.
constexpr std::array<FaultRow, fault_count> table{{
    {.id = FaultId::cell_undervoltage,
     .name = "cell_undervoltage",
     .meaning = "a cell's voltage is too low",
     .unit = Unit::uV,
     .sense = at_or_below,
     .read = read_cell_voltage_min,
     .limit = &LimitsConfig::cell_undervoltage,
     .samples = 2,
     .latch = Latch::until_cleared},
    {.id = FaultId::cell_overvoltage,
     .name = "cell_overvoltage",
     .meaning = "a cell's voltage is too high",
     .unit = Unit::uV,
     .read = read_cell_voltage_max,
     .limit = &LimitsConfig::cell_overvoltage,
     .samples = 2,
     .latch = Latch::until_cleared},
    {.id = FaultId::cell_overtemperature,
     .name = "cell_overtemperature",
     .meaning = "a cell is too hot",
     .unit = Unit::dC,
     .read = read_cell_temperature_max,
     .limit = &LimitsConfig::cell_overtemperature,
     .samples = 2,
     .latch = Latch::until_cleared},
    {.id = FaultId::cell_undertemperature,
     .name = "cell_undertemperature",
     .meaning = "a cell is too cold",
     .unit = Unit::dC,
     .sense = at_or_below,
     .read = read_cell_temperature_min,
     .limit = &LimitsConfig::cell_undertemperature,
     .samples = 2,
     .reaction = open_after_grace,
     .grace = 250ms,
     .dtc = 3},
    {.id = FaultId::discharge_overcurrent,
     .name = "discharge_overcurrent",
     .meaning = "too much current out of the pack",
     .unit = Unit::mA,
     .read = read_discharge_current,
     .limit = &LimitsConfig::discharge_overcurrent,
     .samples = 2,
     .latch = Latch::until_cleared},
    {.id = FaultId::charge_overcurrent,
     .name = "charge_overcurrent",
     .meaning = "too much current into the pack",
     .unit = Unit::mA,
     .read = read_charge_current,
     .limit = &LimitsConfig::charge_overcurrent,
     .samples = 2,
     .latch = Latch::until_cleared},
    {.id = FaultId::pack_voltage_mismatch,
     .name = "pack_voltage_mismatch",
     .meaning = "the sum of the cells is not the pack voltage",
     .unit = Unit::mV,
     .read = read_voltage_mismatch,
     .limit = &LimitsConfig::pack_voltage_mismatch,
     .samples = 2,
     .latch = Latch::until_cleared},
    {.id = FaultId::module_lost,
     .name = "module_lost",
     .meaning = "a module does not answer, or not completely",
     .read = read_module_lost,
     .latch = Latch::until_cleared},
    {.id = FaultId::cell_not_measured,
     .name = "cell_not_measured",
     .meaning = "a module answers but does not know a cell's voltage",
     .read = read_cell_not_measured,
     .confirm = 150ms,
     .samples = 2,
     .latch = Latch::until_cleared},
    {.id = FaultId::temperature_not_measured,
     .name = "temperature_not_measured",
     .meaning = "a temperature is missing, or its sensor open or shorted",
     .read = read_temperature_not_measured,
     .confirm = 150ms,
     .samples = 2,
     .latch = Latch::until_cleared},
    {.id = FaultId::module_reports_fault,
     .name = "module_reports_fault",
     .meaning = "a module reports a failed cell, an open wire or a failed self-test",
     .read = read_module_reports_fault,
     .confirm = 150ms,
     .samples = 2},  // the module latches it itself, until our clear command reaches it
    {.id = FaultId::module_warning,
     .name = "module_warning",
     .meaning = "a module warns of its board, supply, temperature sensors or front end",
     .read = read_module_warning,
     .confirm = 150ms,
     .samples = 2,
     .reaction = warn},
    {.id = FaultId::module_mismatch,
     .name = "module_mismatch",
     .meaning = "a module is not the one the configuration describes, or two share a node number",
     .read = read_module_mismatch,
     .latch = Latch::until_cleared},
    {.id = FaultId::current_sensor_lost,
     .name = "current_sensor_lost",
     .meaning = "no usable current from the sensor",
     .read = read_current_sensor_lost,
     .latch = Latch::until_cleared},
    {.id = FaultId::voltage_sensor_lost,
     .name = "voltage_sensor_lost",
     .meaning = "no usable pack or link voltage from the sensor",
     .read = read_voltage_sensor_lost,
     .latch = Latch::until_cleared},
    {.id = FaultId::pdu_lost,
     .name = "pdu_lost",
     .meaning = "no word from the power distribution unit",
     .read = read_pdu_lost,
     .latch = Latch::until_cleared},
    {.id = FaultId::pdu_opened_by_itself,
     .name = "pdu_opened_by_itself",
     .meaning = "the power distribution unit missed commands or restarted, and opened by itself",
     .read = read_pdu_opened_by_itself,
     .latch = Latch::until_cleared},
    {.id = FaultId::emergency_stop,
     .name = "emergency_stop",
     .meaning = "an emergency stop is pressed",
     .read = read_emergency_stop,
     .latch = Latch::until_cleared},
    {.id = FaultId::interlock_open,
     .name = "interlock_open",
     .meaning = "the interlock loop is open",
     .read = read_interlock,
     .latch = Latch::until_cleared},
    {.id = FaultId::insulation_fault,
     .name = "insulation_fault",
     .meaning = "the insulation monitor does not say OK",
     .read = read_insulation,
     .confirm = 500ms,
     .latch = Latch::until_cleared},
    {.id = FaultId::precharge_failed,
     .name = "precharge_failed",
     .meaning = "the link did not follow the pack in time",
     .read = read_precharge_failed,
     .latch = Latch::until_cleared},
    {.id = FaultId::contactor_feedback,
     .name = "contactor_feedback",
     .meaning = "an auxiliary contact does not follow its command",
     .read = read_contactor_feedback,
     .confirm = tick_period,  // one flicker of an auxiliary contact is none of the contactor
     .latch = Latch::until_cleared},
    {.id = FaultId::link_not_following,
     .name = "link_not_following",
     .meaning = "the contactors are closed, but the link voltage is not the pack voltage",
     .read = read_link_not_following,
     .confirm = 150ms,
     .samples = 2,
     .latch = Latch::until_cleared},
    {.id = FaultId::foreign_master,
     .name = "foreign_master",
     .meaning = "somebody else sends what only the master may send",
     .read = read_foreign_master,
     .latch = Latch::until_cleared},
    {.id = FaultId::internal_bus_down,
     .name = "internal_bus_down",
     .meaning = "the internal bus is down or gone",
     .read = read_internal_bus_down},
    {.id = FaultId::command_not_on_bus,
     .name = "command_not_on_bus",
     .meaning = "the contactor commands do not get onto the bus",
     .read = read_command_not_on_bus},
    {.id = FaultId::control_loop_gap,
     .name = "control_loop_gap",
     .meaning = "the daemon was stopped or starved",
     .read = read_loop_gap},
    {.id = FaultId::frames_lost,
     .name = "frames_lost",
     .meaning = "received frames were lost on this machine",
     .read = read_frames_lost,
     .reaction = warn},
}};

consteval bool rows_are_in_order() {
  for (std::size_t index = 0; index < table.size(); ++index) {
    if (static_cast<std::size_t>(table[index].id) != index) return false;
  }
  return true;
}
consteval bool grace_where_it_is_used() {
  for (const FaultRow& row : table) {
    if ((row.reaction == open_after_grace) != (row.grace > 0ns)) return false;
  }
  return true;
}
/// One bad sample alone never trips a limit.
consteval bool limits_take_two_samples() {
  for (const FaultRow& row : table) {
    if (row.limit != nullptr && row.samples < 2) return false;
  }
  return true;
}
consteval bool every_row_reads() {
  for (const FaultRow& row : table) {
    if (row.read == nullptr || row.name.empty() || row.meaning.empty()) return false;
  }
  return true;
}
static_assert(rows_are_in_order());
static_assert(grace_where_it_is_used());
static_assert(limits_take_two_samples());
static_assert(every_row_reads());

}  // namespace

const std::array<FaultRow, fault_count>& fault_table() {
  return table;
}

const FaultRow& row_of(FaultId id) {
  BMU_ASSERT(static_cast<std::size_t>(id) < table.size());
  return table[static_cast<std::size_t>(id)];
}

}  // namespace bmu

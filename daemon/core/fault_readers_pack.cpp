// Cells, temperatures, current, one measurement against another, and the modules that bring them.
#include <algorithm>
#include <bit>
#include <cstdlib>

#include "daemon/core/fault_reader_parts.hpp"
#include "daemon/core/permission.hpp"

namespace bmu::fault_readers {

namespace {

Reading lowest(const Spread& spread) {
  return {spread.is_known(), spread.min, spread.min_at, spread.min_taken_at, !spread.is_complete()};
}
Reading highest(const Spread& spread) {
  return {spread.is_known(), spread.max, spread.max_at, spread.max_taken_at, !spread.is_complete()};
}
/// Highest less lowest, at the one that is further from the average.
Reading width(const Spread& spread) {
  const bool is_low_out = std::int64_t{spread.average} - spread.min > std::int64_t{spread.max} - spread.average;
  return {spread.is_known(), std::int64_t{spread.max} - spread.min, is_low_out ? spread.min_at : spread.max_at,
          std::max(spread.min_taken_at, spread.max_taken_at), !spread.is_complete()};
}
/// The module's own cells, added up; not known if one is missing.
Measured<std::int32_t> sum_of_cells_mV(const ModuleRecord& module, const AgeConfig& ages, TimePoint now) {
  std::int64_t sum_uV = 0;
  TimePoint oldest = now;
  for (std::size_t cell = 0; cell < module.config.cell_count; ++cell) {
    const Measured<std::int32_t>& voltage = module.cell_voltage_uV[cell];
    if (!voltage.is_usable(now, ages.cell_voltage)) return {};
    sum_uV += voltage.value;
    oldest = std::min(oldest, voltage.taken_at);
  }
  return {mV_from_uV(sum_uV), oldest, Validity::valid};
}

/// Whether a share of what is allowed is all of it.
Reading beyond_permille(const Reading& share) {
  constexpr std::int64_t all_permille = 1'000;
  if (!share.is_known) return unknown_reading;
  return condition(share.value >= all_permille, share.taken_at, share.element);
}

/// First module for which `is_bad` holds. `seen_at` tells when that was last heard of.
template <class IsBad, class SeenAt>
Reading first_module(const FaultInputs& in, IsBad is_bad, SeenAt seen_at) {
  for (const ModuleRecord& module : in.modules->modules()) {
    if (is_bad(module)) return condition(true, seen_at(module), {.module_node = module.config.node});
  }
  return condition(false, in.now);
}
TimePoint status_seen_at(const ModuleRecord& module) {
  return module.status.taken_at;
}

TimePoint front_end_seen_at(const ModuleRecord& module) {
  return module.front_end.taken_at;
}

Reading module_in_mode(const FaultInputs& in, internal_bus::Mode mode) {
  return first_module(
      in,
      [&in, mode](const ModuleRecord& module) {
        return module.status.is_usable(in.now, in.config->ages.module_status) && module.status.value.mode == mode;
      },
      status_seen_at);
}

/// A current that flows although it was forbidden, seen after it had its time to end.
Reading forbidden_current(const FaultInputs& in, TimePoint forbidden_since, std::int64_t current_mA,
                          std::int32_t tolerated_mA) {
  const Measured<std::int32_t>& current = in.pack->current_mA;
  if (forbidden_since == TimePoint{}) return condition(false, in.now);
  if (!current.is_valid()) return unknown_reading;
  const bool had_its_time = current.taken_at > forbidden_since + in.config->contactors.zero_current_grace;
  return condition(had_its_time && current_mA > tolerated_mA, current.taken_at);
}

/// An open sense wire moves two neighbours the same way apart: what one cell seems to lose, the next seems to gain.
std::uint8_t open_wire_pair(const ModuleRecord& module, const AgeConfig& ages, TimePoint now) {
  constexpr std::int64_t apart_min_uV = 400'000;
  const Measured<std::int32_t> sum_mV = sum_of_cells_mV(module, ages, now);
  if (!sum_mV.is_valid() || module.config.cell_count < 3) return 0;
  const std::int64_t average_uV = std::int64_t{sum_mV.value} * 1'000 / module.config.cell_count;
  for (std::uint8_t cell = 0; cell + 1 < module.config.cell_count; ++cell) {
    const std::int64_t one_uV = module.cell_voltage_uV[cell].value - average_uV;
    const std::int64_t next_uV = module.cell_voltage_uV[cell + 1U].value - average_uV;
    const std::int64_t smaller_uV = std::min(std::llabs(one_uV), std::llabs(next_uV));
    // On the same side of the average their sum is twice the smaller one and more.
    if (smaller_uV >= apart_min_uV && 4 * std::llabs(one_uV + next_uV) <= smaller_uV) {
      return static_cast<std::uint8_t>(cell + 1);
    }
  }
  return 0;
}

/// Good only once everybody has said who he is.
Reading out_of_place(const FaultInputs& in, const ModuleRecord* module) {
  if (module != nullptr) return condition(true, module->identity.taken_at, {.module_node = module->config.node});
  Reading good = condition(false, in.now);
  if (!are_modules_ours(*in.config)) return good;  // nobody ever says so
  good.is_partial = std::any_of(in.modules->modules().begin(), in.modules->modules().end(),
                                [](const ModuleRecord& one) { return !one.identity.is_valid(); });
  return good;
}

bool says_failed(const ModuleRecord& module) {
  const ModuleStatus& said = module.status.value;
  return module.status.is_valid() && (said.overvoltage_cells != 0 || said.self_test_failed);
}
bool says_empty(const ModuleRecord& module) {
  return module.status.is_valid() && module.status.value.undervoltage_cells != 0;
}

}  // namespace

// --- cells and temperatures -----------------------------------------------------------------------------------------

Reading cell_voltage_min_uV(const FaultInputs& in) {
  return lowest(in.pack->cell_voltage_uV);
}
Reading cell_voltage_max_uV(const FaultInputs& in) {
  return highest(in.pack->cell_voltage_uV);
}
Reading cell_voltage_spread_uV(const FaultInputs& in) {
  return width(in.pack->cell_voltage_uV);
}
Reading cell_resistance_permille(const FaultInputs& in) {
  return in.watchers->steps.worst_cell_permille();
}
Reading pack_resistance_permille(const FaultInputs& in) {
  return in.watchers->steps.average_permille();
}
Reading cell_temperature_max_dC(const FaultInputs& in) {
  return highest(in.pack->cell_temperature_dC);
}
Reading cell_temperature_min_dC(const FaultInputs& in) {
  return lowest(in.pack->cell_temperature_dC);
}
Reading board_temperature_max_dC(const FaultInputs& in) {
  return highest(in.pack->board_temperature_dC);
}
Reading board_temperature_min_dC(const FaultInputs& in) {
  return lowest(in.pack->board_temperature_dC);
}
Reading temperature_rise_mK_per_s(const FaultInputs& in) {
  Reading reading = in.watchers->trend.fastest_mK_per_s(*in.modules);
  reading.is_partial = !in.pack->cell_temperature_dC.is_complete();
  return reading;
}
Reading temperature_spread_dC(const FaultInputs& in) {
  return width(in.pack->cell_temperature_dC);
}

// --- current --------------------------------------------------------------------------------------------------------

Reading discharge_current_mA(const FaultInputs& in) {
  const Measured<std::int32_t>& current = in.pack->current_mA;
  return {current.is_valid(), current.value, {}, current.taken_at};
}
Reading charge_current_mA(const FaultInputs& in) {
  const Measured<std::int32_t>& current = in.pack->current_mA;
  return {current.is_valid(), -std::int64_t{current.value}, {}, current.taken_at};
}
Reading discharge_overload_permille(const FaultInputs& in) {
  const OverloadCounter& overload = in.watchers->overload;
  return {in.pack->current_mA.is_valid(), overload.discharge_used_permille(), {}, overload.counted_at()};
}
Reading charge_overload_permille(const FaultInputs& in) {
  const OverloadCounter& overload = in.watchers->overload;
  return {in.pack->current_mA.is_valid(), overload.charge_used_permille(), {}, overload.counted_at()};
}
Reading discharge_not_allowed(const FaultInputs& in) {
  return forbidden_current(in, in.flags.discharge_forbidden_since, in.pack->current_mA.value,
                           in.config->contactors.charge_only_discharge_mA);
}
Reading charge_not_allowed(const FaultInputs& in) {
  return forbidden_current(in, in.flags.charge_forbidden_since, -std::int64_t{in.pack->current_mA.value},
                           small_current_mA);
}
Reading current_while_open(const FaultInputs& in) {
  const Measured<std::int32_t>& current = in.pack->current_mA;
  if (in.flags.open_since == TimePoint{}) return condition(false, in.now);
  const bool is_of_open_pack = current.taken_at > in.flags.open_since + in.config->contactors.feedback_timeout;
  if (!current.is_valid() || !is_of_open_pack) return unknown_reading;
  return condition(current.value > small_current_mA || current.value < -small_current_mA, current.taken_at);
}

// --- one measurement against another --------------------------------------------------------------------------------

Reading pack_voltage_mismatch_mV(const FaultInputs& in) {
  const Measured<std::int32_t>& sum = in.pack->cell_voltage_sum_mV;
  const Measured<std::int32_t>& pack = in.pack->pack_voltage_mV;
  if (!sum.is_valid() || !pack.is_valid()) return unknown_reading;
  return {
      true, unexplained_mV(in, sum, pack, pack_resistance_uOhm(*in.config)), {}, std::max(sum.taken_at, pack.taken_at)};
}

Reading module_voltage_mismatch_mV(const FaultInputs& in) {
  Reading worst{.is_known = true};
  for (const ModuleRecord& module : in.modules->modules()) {
    const Measured<std::int32_t> cells = sum_of_cells_mV(module, in.config->ages, in.now);
    const Measured<std::int32_t>& stack = module.module_voltage_mV;
    if (stack.validity == Validity::not_fitted) continue;  // a foreign module that measures none
    if (!cells.is_valid() || !stack.is_usable(in.now, in.config->ages.cell_voltage)) {
      worst.is_partial = true;
      continue;
    }
    const std::int64_t resistance_uOhm = cell_resistance_uOhm(*in.config) * module.config.cell_count;
    const std::int64_t apart_mV = unexplained_mV(in, cells, stack, resistance_uOhm);
    if (apart_mV <= worst.value) continue;
    worst.value = apart_mV;
    worst.element = {.module_node = module.config.node};
    worst.taken_at = std::max(cells.taken_at, stack.taken_at);
  }
  return worst;
}

Reading stuck_values_ms(const FaultInputs& in) {
  return in.watchers->stuck.longest_ms(*in.modules);
}
Reading current_contradicts_voltage(const FaultInputs& in) {
  // Without a current there is nothing to contradict: an open pack can be cleared, and tried again.
  if (in.flags.open_since != TimePoint{}) return condition(false, in.now);
  return in.watchers->steps.contradiction();
}
Reading current_sensors_apart_mA(const FaultInputs& in) {
  // A lock of a time when there were two can be cleared.
  if (!in.config->sensor.has_second_current) return {true, 0, {}, in.now};
  const Measured<std::int32_t>& one = in.sensors->current_mA;
  const Measured<std::int32_t>& other = in.sensors->current_2_mA;
  const Duration age_max = in.config->ages.pack_current;
  if (!one.is_usable(in.now, age_max) || !other.is_usable(in.now, age_max)) return unknown_reading;
  return {true, std::llabs(std::int64_t{one.value} - other.value), {}, std::max(one.taken_at, other.taken_at)};
}
Reading soc_methods_disagree(const FaultInputs& in) {
  return beyond_permille(in.soc_disagreement_permille);
}
Reading cell_model_mismatch(const FaultInputs& in) {
  return beyond_permille(in.cell_misfit_permille);
}

// --- modules --------------------------------------------------------------------------------------------------------

Reading module_lost(const FaultInputs& in) {
  if (!in.has_started) return unknown_reading;
  return first_module(
      in, [&in](const ModuleRecord& module) { return !is_answering(module, in.config->ages, in.now); },
      [](const ModuleRecord& module) { return module.last_answer_at; });
}

Reading cell_not_measured(const FaultInputs& in) {
  if (!in.has_started) return unknown_reading;
  Reading good = condition(false, in.now);
  for (const ModuleRecord& module : in.modules->modules()) {
    if (!is_answering(module, in.config->ages, in.now)) {  // that is module_lost
      good.is_partial = true;
      continue;
    }
    for (std::uint8_t index = 0; index < module.config.cell_count; ++index) {
      const Measured<std::int32_t>& voltage = module.cell_voltage_uV[index];
      if (voltage.is_valid()) continue;
      return condition(true, voltage.taken_at,
                       {.module_node = module.config.node, .number = static_cast<std::uint8_t>(index + 1)});
    }
  }
  return good;
}

/// Sensors of the cells by the pack file, those of the boards by what the modules have. One in doubt is measured, or
/// not: the others may be bad news meanwhile, and there is no good.
Reading temperature_not_measured(const FaultInputs& in) {
  if (!in.has_started) return unknown_reading;
  Reading good = condition(false, in.now);
  const auto is_bad = [&in, &good](const Measured<std::int32_t>& value) {
    const bool is_fresh = value.is_fresh(in.now, in.config->ages.temperature);
    const bool is_doubtful = is_fresh && value.validity == Validity::doubtful;
    good.is_partial = good.is_partial || is_doubtful;
    return !is_doubtful && !(is_fresh && value.is_valid());
  };
  const auto missing = [&in](const ModuleRecord& module, const Measured<std::int32_t>& value, std::uint8_t number) {
    const Element element{.module_node = module.config.node, .number = number, .is_temperature_sensor = true};
    return condition(true, value.is_fresh(in.now, in.config->ages.temperature) ? value.taken_at : in.now, element);
  };
  for (const ModuleRecord& module : in.modules->modules()) {
    for (std::uint8_t index = 0; index < module.config.temperature_sensor_count; ++index) {
      const Measured<std::int32_t>& value = module.cell_temperature_dC[index];
      if (is_bad(value)) return missing(module, value, static_cast<std::uint8_t>(index + 1));
    }
    for (std::uint8_t index = 0; index < internal_bus::board_temperatures_per_module; ++index) {
      const Measured<std::int32_t>& value = module.board_temperature_dC[index];
      if (has_board_sensor(module, index) && is_bad(value)) return missing(module, value, board_sensor_number(index));
    }
  }
  return good;
}

Reading open_wire(const FaultInputs& in) {
  for (const ModuleRecord& module : in.modules->modules()) {
    const bool is_flagged = module.status.is_valid() && module.status.value.open_cell_wire;
    if (is_flagged) return condition(true, module.status.taken_at, {.module_node = module.config.node});
    // The mask of open wires comes with the module voltage.
    if (module.open_wire_cells != 0) {
      return condition(true, module.module_voltage_mV.taken_at, {.module_node = module.config.node});
    }
    const std::uint8_t cell = open_wire_pair(module, in.config->ages, in.now);
    if (cell == 0) continue;
    return condition(true, module.cell_voltage_uV[cell].taken_at, {.module_node = module.config.node, .number = cell});
  }
  return condition(false, in.now);
}

/// Bad from the third damaged frame among ten on, good again after ten sound ones in a row.
Reading module_disturbed(const FaultInputs& in) {
  constexpr int damaged_max = 3;
  Reading good = condition(false, in.now);
  for (const ModuleRecord& module : in.modules->modules()) {
    const int damaged = std::popcount(module.damaged_frames);
    if (damaged >= damaged_max) return condition(true, module.damaged_at, {.module_node = module.config.node});
    good.is_partial = good.is_partial || damaged > 0;
  }
  return good;
}

Reading module_reports_fault(const FaultInputs& in) {
  return first_module(in, says_failed, status_seen_at);
}

Reading module_reports_undervoltage(const FaultInputs& in) {
  return first_module(in, says_empty, status_seen_at);
}

/// What wears or misleads but endangers nothing yet; a value that is missing because of it has a fault of its own.
Reading module_warning(const FaultInputs& in) {
  return first_module(
      in,
      [](const ModuleRecord& module) {
        const ModuleStatus& said = module.status.value;
        return module.status.is_valid() &&
               (said.board_too_hot || said.external_supply_low || said.temperature_sensor_fault ||
                said.front_end_crc_errors || said.maker_errors != 0);
      },
      status_seen_at);
}

/// The mode in a STATUS that counts; an old one is `module_lost`. While nobody is asked nobody is starting or going to
/// sleep against anybody's will.
Reading module_starting(const FaultInputs& in) {
  return in.has_started ? module_in_mode(in, internal_bus::Mode::starting) : unknown_reading;
}
Reading module_going_to_sleep(const FaultInputs& in) {
  return in.has_started ? module_in_mode(in, internal_bus::Mode::going_to_sleep) : unknown_reading;
}
Reading module_alone(const FaultInputs& in) {
  return first_module(
      in,
      [&in](const ModuleRecord& module) {
        const ModuleStatus& said = module.status.value;
        return module.status.is_usable(in.now, in.config->ages.module_status) && !said.on_module_supply &&
               said.mode == internal_bus::Mode::autonomous;
      },
      status_seen_at);
}
/// Its cells feed it: most modules are silent then (module_lost), as their CAN side has no power; this one still sends.
Reading module_supply_lost(const FaultInputs& in) {
  return first_module(
      in,
      [&in](const ModuleRecord& module) {
        return module.status.is_usable(in.now, in.config->ages.module_status) && module.status.value.on_module_supply;
      },
      status_seen_at);
}

// A report that was never received has no bit set; a stale one keeps its bits, and the fault.
Reading front_end_supply_low(const FaultInputs& in) {
  return first_module(
      in,
      [](const ModuleRecord& module) {
        const FrontEndStatus& front_end = module.front_end.value;
        return front_end.is_reported && front_end.is_supply_low;
      },
      front_end_seen_at);
}
Reading front_end_overtemperature(const FaultInputs& in) {
  return first_module(
      in,
      [](const ModuleRecord& module) {
        const FrontEndStatus& front_end = module.front_end.value;
        return front_end.is_reported && front_end.is_shut_down;
      },
      front_end_seen_at);
}
/// Only for modules whose pack file asks for the report. One that does not answer is module_lost, and no good either.
Reading front_end_faults_missing(const FaultInputs& in) {
  if (!in.has_started) return unknown_reading;
  Reading good = condition(false, in.now);
  for (const ModuleRecord& module : in.modules->modules()) {
    if (!module.config.must_report_front_end) continue;
    const bool is_usable = module.front_end.is_usable(in.now, in.config->ages.module_status);
    good.is_partial = good.is_partial || !is_usable;
    if (!is_usable || module.front_end.value.is_reported) continue;
    return condition(true, module.front_end.taken_at, {.module_node = module.config.node});
  }
  return good;
}

Reading balancing_stays_on(const FaultInputs& in) {
  return in.watchers->switches.stays_on();
}
Reading balancing_stays_off(const FaultInputs& in) {
  return in.watchers->switches.stays_off();
}
Reading balancing_refused(const FaultInputs& in) {
  const std::uint8_t node = in.flags.balancing_refused;
  return condition(node != 0, in.now, {.module_node = node});
}

Reading module_mismatch(const FaultInputs& in) {
  return first_module(
      in,
      [](const ModuleRecord& module) {
        const ModuleIdentity& identity = module.identity.value;
        return module.identity.is_valid() &&
               (identity.protocol_version != internal_bus::protocol_version ||
                identity.temperature_sensor_count != module.config.temperature_sensor_count);
      },
      status_seen_at);
}

Reading wrong_cell_count(const FaultInputs& in) {
  return first_module(
      in,
      [](const ModuleRecord& module) {
        const std::uint8_t expected = module.config.cell_count;
        return (module.status.is_valid() && module.status.value.cell_count != expected) ||
               (module.identity.is_valid() && module.identity.value.cell_count != expected);
      },
      status_seen_at);
}

Reading module_exchanged(const FaultInputs& in) {
  const ModuleRecord* module = in.watchers->roster.first_with(ModulePlace::exchanged, *in.modules, in.now);
  if (module == nullptr) module = in.watchers->roster.first_with(ModulePlace::misplaced, *in.modules, in.now);
  return out_of_place(in, module);
}

Reading modules_swapped(const FaultInputs& in) {
  return out_of_place(in, in.watchers->roster.first_with(ModulePlace::swapped, *in.modules, in.now));
}

Reading module_not_set_up(const FaultInputs& in) {
  if (!in.has_started) return unknown_reading;
  const std::uint8_t node = in.flags.module_not_set_up;
  return condition(node != 0, in.now, {.module_node = node});
}

Reading duplicate_node(const FaultInputs& in) {
  return first_module(
      in, [&in](const ModuleRecord& module) { return has_rival(module, in.now); }, status_seen_at);
}

Reading unknown_module(const FaultInputs& in) {
  const std::uint8_t node = in.watchers->bus.unknown_module(in.now);
  return condition(node != 0, in.watchers->bus.unknown_module_at(), {.module_node = node});
}

}  // namespace bmu::fault_readers

#include "daemon/core/faults/likely_cause.hpp"

#include <algorithm>
#include <array>

#include "daemon/core/plausibility/link_decay.hpp"

namespace bmu {

namespace {

struct CauseRow {
  FaultId fault;
  WrongKey key;
};

// The first matching row counts: it explains more than the later ones.
constexpr std::array cause_table{
    CauseRow{FaultId::module_lost, WrongKey::buses},
    CauseRow{FaultId::pdu_lost, WrongKey::buses},
    CauseRow{FaultId::current_sensor_lost, WrongKey::buses},
    CauseRow{FaultId::voltage_sensor_lost, WrongKey::buses},
    CauseRow{FaultId::current_sensor_lost, WrongKey::little_endian},
    CauseRow{FaultId::voltage_sensor_lost, WrongKey::little_endian},
    CauseRow{FaultId::charge_overcurrent, WrongKey::invert_current_by_step},
    CauseRow{FaultId::charge_overload, WrongKey::invert_current_by_step},
    CauseRow{FaultId::charge_not_allowed, WrongKey::invert_current_by_step},
    CauseRow{FaultId::charge_overcurrent, WrongKey::invert_current},
    CauseRow{FaultId::charge_overload, WrongKey::invert_current},
    CauseRow{FaultId::charge_not_allowed, WrongKey::invert_current},
    CauseRow{FaultId::discharge_overcurrent, WrongKey::invert_current_by_step},
    CauseRow{FaultId::discharge_overload, WrongKey::invert_current_by_step},
    CauseRow{FaultId::discharge_not_allowed, WrongKey::invert_current_by_step},
    CauseRow{FaultId::discharge_overcurrent, WrongKey::invert_current_by_charger},
    CauseRow{FaultId::discharge_overload, WrongKey::invert_current_by_charger},
    CauseRow{FaultId::discharge_not_allowed, WrongKey::invert_current_by_charger},
    CauseRow{FaultId::charger_contradicts, WrongKey::invert_current_by_charger},
    CauseRow{FaultId::current_contradicts_voltage, WrongKey::both_signs},
    CauseRow{FaultId::current_contradicts_voltage, WrongKey::invert_current_by_cells},
    CauseRow{FaultId::current_sensors_disagree, WrongKey::both_signs},
    CauseRow{FaultId::current_sensors_disagree, WrongKey::second_is_reversed},
    CauseRow{FaultId::link_not_discharging, WrongKey::link_decay},
    CauseRow{FaultId::precharge_too_fast, WrongKey::precharge_min},
    CauseRow{FaultId::precharge_failed, WrongKey::precharge_energy},
    CauseRow{FaultId::precharge_failed, WrongKey::precharge_timeout},
};

bool speaks_for(WrongKey key, const SeenBeside& seen) {
  switch (key) {
    case WrongKey::none: return false;
    case WrongKey::invert_current: return seen.is_without_charger && !seen.do_cells_follow_steps;
    case WrongKey::invert_current_by_cells: return seen.do_cells_move_against_current;
    case WrongKey::invert_current_by_step: return seen.do_cells_oppose_steps;
    case WrongKey::invert_current_by_charger: return seen.is_charger_mirrored && !seen.do_cells_follow_steps;
    case WrongKey::second_is_reversed: return seen.are_sensors_mirrored;
    case WrongKey::both_signs: return seen.are_sensors_mirrored && seen.do_cells_oppose_steps;
    case WrongKey::little_endian: return seen.are_results_out_of_range;
    case WrongKey::buses: return seen.are_buses_swapped;
    case WrongKey::link_decay: return seen.link_time_constant.has_value();
    case WrongKey::precharge_min: return seen.link_followed_after.has_value();
    case WrongKey::precharge_energy: return seen.slow_rise && seen.slow_rise->is_ended_by_heat;
    case WrongKey::precharge_timeout: return seen.slow_rise.has_value();
  }
  return false;
}

LikelyCause with_values(WrongKey key, const SeenBeside& seen, const ContactorConfig& contactors) {
  switch (key) {
    case WrongKey::link_decay:
      return {.key = key,
              .measured = *seen.link_time_constant,
              .found = contactors.link_decay,
              .would_do = link_decay_that_would_do(*seen.link_time_constant, contactors)};
    case WrongKey::precharge_min:
      return {.key = key,
              .measured = *seen.link_followed_after,
              .found = contactors.precharge_min,
              .would_do = precharge_min_that_would_do(*seen.link_followed_after)};
    case WrongKey::precharge_energy:
    case WrongKey::precharge_timeout:
      return {.key = key,
              .measured = seen.slow_rise->time_constant,
              .found = contactors.precharge_timeout,
              .would_do = precharge_timeout_that_would_do(*seen.slow_rise, contactors),
              .found_J = contactors.precharge_energy_J,
              .would_do_J = precharge_energy_that_would_do_J(*seen.slow_rise, contactors)};
    default: return {.key = key};
  }
}

}  // namespace

LikelyCause likely_cause(FaultId fault, const SeenBeside& seen, const ContactorConfig& contactors) {
  const auto* const row = std::find_if(cause_table.begin(), cause_table.end(), [&](const CauseRow& one) {
    return one.fault == fault && speaks_for(one.key, seen);
  });
  return row == cause_table.end() ? LikelyCause{} : with_values(row->key, seen, contactors);
}

}  // namespace bmu

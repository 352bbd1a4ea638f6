#include "daemon/core/likely_cause.hpp"

#include <algorithm>
#include <array>

#include "daemon/core/link_decay.hpp"

namespace bmu {

namespace {

struct CauseRow {
  FaultId fault;
  WrongKey key;
};

// What comes first explains more.
constexpr std::array cause_table{
    CauseRow{FaultId::module_lost, WrongKey::buses},
    CauseRow{FaultId::pdu_lost, WrongKey::buses},
    CauseRow{FaultId::current_sensor_lost, WrongKey::buses},
    CauseRow{FaultId::voltage_sensor_lost, WrongKey::buses},
    CauseRow{FaultId::current_sensor_lost, WrongKey::little_endian},
    CauseRow{FaultId::voltage_sensor_lost, WrongKey::little_endian},
    CauseRow{FaultId::charge_overcurrent, WrongKey::invert_current},
    CauseRow{FaultId::charge_overload, WrongKey::invert_current},
    CauseRow{FaultId::charge_not_allowed, WrongKey::invert_current},
    CauseRow{FaultId::current_contradicts_voltage, WrongKey::invert_current_by_cells},
    CauseRow{FaultId::link_not_discharging, WrongKey::link_decay},
};

bool speaks_for(WrongKey key, const SeenBeside& seen) {
  switch (key) {
    case WrongKey::none: return false;
    case WrongKey::invert_current: return seen.is_without_charger;
    case WrongKey::invert_current_by_cells: return seen.do_cells_move_against_current;
    case WrongKey::little_endian: return seen.are_results_out_of_range;
    case WrongKey::buses: return seen.are_buses_swapped;
    case WrongKey::link_decay: return seen.link_time_constant.has_value();
  }
  return false;
}

}  // namespace

LikelyCause likely_cause(FaultId fault, const SeenBeside& seen, const ContactorConfig& contactors) {
  const auto* const row = std::find_if(cause_table.begin(), cause_table.end(), [&](const CauseRow& one) {
    return one.fault == fault && speaks_for(one.key, seen);
  });
  if (row == cause_table.end()) return {};
  LikelyCause cause{.key = row->key};
  if (cause.key != WrongKey::link_decay) return cause;
  cause.time_constant = *seen.link_time_constant;
  cause.found = contactors.link_decay;
  cause.would_do = link_decay_that_would_do(cause.time_constant, contactors);
  return cause;
}

}  // namespace bmu

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
    CauseRow{FaultId::link_not_discharging, WrongKey::link_decay},
};

bool speaks_for(WrongKey key, const SeenBeside& seen) {
  switch (key) {
    case WrongKey::none: return false;
    case WrongKey::invert_current: return seen.is_without_charger;
    case WrongKey::little_endian: return seen.are_results_out_of_range;
    case WrongKey::buses: return seen.are_buses_swapped;
    case WrongKey::link_decay: return seen.link_time_constant.has_value();
  }
  return false;
}

std::string seconds_text(Duration span) {
  return std::to_string(std::chrono::round<std::chrono::seconds>(span).count()) + " s";
}

std::string link_text(const LikelyCause& cause) {
  const std::string falls = "the link falls, with a time constant of " + seconds_text(cause.time_constant) + ": ";
  const std::string value = std::to_string(to_ms(cause.would_do));
  if (cause.would_do > link_decay_max) {
    return falls + "contactors/link_decay_ms would have to be " + value + ", and may be " +
           std::to_string(to_ms(link_decay_max)) + "; it needs a discharge resistor";
  }
  return falls + "contactors/link_decay_ms " + value + " would do, found " + std::to_string(to_ms(cause.found));
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

std::string to_text(const LikelyCause& cause) {
  switch (cause.key) {
    case WrongKey::none: return "";
    case WrongKey::invert_current:
      return "no charger is plugged in: where no motor brakes either, sensor/invert_current is the wrong way round";
    case WrongKey::little_endian:
      return "the sensor's results are out of range, as they are in the other byte order: sensor/little_endian";
    case WrongKey::buses:
      return "modules or power distribution unit send on the vehicle bus: buses/internal and buses/vehicle are swapped";
    case WrongKey::link_decay: return link_text(cause);
  }
  return "";
}

}  // namespace bmu

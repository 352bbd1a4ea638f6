// Events to be logged: declared in one place, with severity and text. The core returns events, the shell logs each
// once. An event carries numbers, never text; to_text() makes the line.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "daemon/core/contactors/contactor_sequence.hpp"
#include "daemon/core/contactors/permission.hpp"
#include "daemon/core/faults/fault_table.hpp"
#include "daemon/core/faults/likely_cause.hpp"
#include "daemon/core/measurement/sensor_setup.hpp"
#include "daemon/core/types/observation.hpp"
#include "daemon/core/types/opening_cause.hpp"

namespace bmu {

enum class EventId : std::uint8_t {
  fault_warned,
  fault_warning_over,
  fault_confirmed,
  fault_cause_gone,
  fault_cleared,
  phase_changed,
  precharge_done,
  precharge_gave_up,
  opened,
  close_requested,
  close_request_over,
  close_refused,
  rest_changed,
  soc_started,
  former_charges,
  module_identified,
  module_out_of_place,
  module_accepted,
  module_given_node,
  module_node_not_taken,
  module_restarted,
  module_limits_set,
  module_refused_limits,
  balancing_began,
  balancing_stopped,
  module_refused_balancing,
  module_ignores_balancing,
  modules_stay_awake,
  charge_stage_changed,
  sensor_set_up,
  sensor_set_up_failed,
  sensor_restarted,
  port_up,
  port_down,
  loop_gap,
  gate_refused,
  shutting_down,
  shut_down_unconfirmed,
};
inline constexpr std::size_t event_count = 38;

enum class Severity : std::uint8_t { debug, info, warning, error };

struct EventRow {
  EventId id;
  std::string_view name;
  Severity severity;
};

[[nodiscard]] const EventRow& row_of(EventId id);

[[nodiscard]] std::string_view to_text(OpeningCause cause);

struct Event {
  EventId id{};
  TimePoint at{};
  FaultId fault{};
  Reading reading;
  std::int64_t threshold = 0;
  Phase phase_from{};
  Phase phase_to{};
  OpeningCause cause = OpeningCause::none;
  Port port{};
  // For an aborted precharge, reading and threshold are DC link and pack voltage, in mV.
  // Node, serial number, milliseconds, permille, identifier, Blocker or the like, depending on the event; for a charger
  // that runs away the value given, with the value requested as `threshold`: mA, or mV where the reading's value is 2.
  std::int64_t number = 0;
  LikelyCause likely;        // for a confirmed fault
  bool is_stricter = false;  // the pack file gives the fault a stricter reaction than the fault table

  /// Whether `number` is a valid enumerator in events that use it as one.
  [[nodiscard]] bool are_fields_possible() const;
};

/// Severity of the row, but no more than info for an intended opening (end of the close request, shutdown), and no more
/// than warning for a fault with a reaction that is only a warning.
[[nodiscard]] Severity severity_of(const Event& event);

/// A fault that is decided by DC link and pack voltage, with a reading that only gives its presence.
[[nodiscard]] bool is_about_link(FaultId fault);

/// Reason for refusing a close request, with the values that decided it: those of a RefusalRecord.
[[nodiscard]] std::string refusal_text(Blocker blocker, FaultId fault, const Reading& reading, std::int64_t threshold);

/// One line of the log, without time and severity.
[[nodiscard]] std::string to_text(const Event& event);

/// "cell 2.7 (no. 19)", "module 3", "" for the pack.
[[nodiscard]] std::string to_text(const Element& element);

/// "no charger is plugged in: ...", with the path of the key; "" for none.
[[nodiscard]] std::string to_text(const LikelyCause& cause);

/// "U1: found every 100 ms, wanted every 60 ms", "I: no answer".
[[nodiscard]] std::string to_text(const SensorSetupProblem& problem);

/// A value with the row's unit, for display: "2.8710 V".
[[nodiscard]] std::string value_text(Unit unit, std::int64_t value);

/// "35.000 A given, 20.000 A asked for".
[[nodiscard]] std::string excess_text(Unit unit, std::int64_t given, std::int64_t asked);

}  // namespace bmu

// What is worth telling: declared in one place, with severity and text. The core returns events, the shell logs each
// once. An event carries numbers, never text; to_text makes the line.
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
  // Link and pack voltage of a precharge that was given up are reading and threshold, in mV.
  // Node, serial number, milliseconds, permille, identifier, Blocker or the like, as the event says; of a charger that
  // runs away what it gives, with what it was asked for as `threshold`: mA, or mV where the reading's value is 2.
  std::int64_t number = 0;
  LikelyCause likely;        // of a fault that is confirmed
  bool is_stricter = false;  // the fault does more in this pack than the fault table has it do

  /// Where `number` is one of an enumeration.
  [[nodiscard]] bool are_fields_possible() const;
};

/// The row's, but what is meant to happen, or does no more than warn, is told as no more than that: an opening because
/// nobody asks for a closed pack any more, a fault whose reaction is a warning.
[[nodiscard]] Severity severity_of(const Event& event);

/// A fault that is decided by link and pack voltage, and reads no more than that it is there.
[[nodiscard]] bool is_about_link(FaultId fault);

/// Why a request to close was refused, with the values that it was decided by: those of a RefusalRecord.
[[nodiscard]] std::string refusal_text(Blocker blocker, FaultId fault, const Reading& reading, std::int64_t threshold);

/// One line for people, without time and severity.
[[nodiscard]] std::string to_text(const Event& event);

/// "cell 2.7 (no. 19)", "module 3", "" for the pack.
[[nodiscard]] std::string to_text(const Element& element);

/// "no charger is plugged in: ...", with the key by its path; "" for none.
[[nodiscard]] std::string to_text(const LikelyCause& cause);

/// "U1: found every 100 ms, wanted every 60 ms", "I: no answer".
[[nodiscard]] std::string to_text(const SensorSetupProblem& problem);

/// A value in the row's unit as people read it: "2.8710 V".
[[nodiscard]] std::string value_text(Unit unit, std::int64_t value);

/// "35.000 A given, 20.000 A asked for".
[[nodiscard]] std::string excess_text(Unit unit, std::int64_t given, std::int64_t asked);

}  // namespace bmu

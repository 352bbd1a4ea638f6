// What is worth telling: declared in one place, with severity and text. The core returns events, the shell logs each
// once. An event carries numbers, never text; to_text makes the line.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "daemon/core/contactor_sequence.hpp"
#include "daemon/core/fault_table.hpp"
#include "daemon/core/observation.hpp"

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
  port_up,
  port_down,
  loop_gap,
  gate_refused,
  shutting_down,
  shut_down_unconfirmed,
};
inline constexpr std::size_t event_count = 34;

enum class Severity : std::uint8_t { debug, info, warning, error };

struct EventRow {
  EventId id;
  std::string_view name;
  Severity severity;
};

[[nodiscard]] const EventRow& row_of(EventId id);

/// Why the contactors opened.
enum class OpeningCause : std::uint8_t {
  none,
  fault,
  request_over,  // vehicle off and charger gone
  shut_down,
  precharge_retry,  // too slow, but there is another try
  permission,       // withdrawn for a reason that is not (yet) a fault: see the blocker
};

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
  // Node, serial number, milliseconds, permille, identifier, Blocker or the like, as the event says.
  std::int64_t number = 0;

  /// Where `number` is one of an enumeration.
  [[nodiscard]] bool are_fields_possible() const;
};

/// One line for people, without time and severity.
[[nodiscard]] std::string to_text(const Event& event);

/// "cell 2.7 (no. 19)", "module 3", "" for the pack.
[[nodiscard]] std::string to_text(const Element& element);

/// A value in the row's unit as people read it: "2.8710 V".
[[nodiscard]] std::string value_text(Unit unit, std::int64_t value);

}  // namespace bmu

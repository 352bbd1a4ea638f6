// A decision that keeps something closed is carried out at once, or not at all.
//
// Between a decision and its frame the process may be stopped or starved for longer than the power distribution unit
// waits: the unit opens by itself, the frame goes out when we wake, and the unit obeys it, past the precharge. So the
// clock is asked once more just before. What is late is not sent, the core hears that sending failed and decides anew;
// whether the time away was long enough to open is the core's to say. To open is never too late.
//
// What is left is the way from that look at the clock into the kernel: a few instructions.
#pragma once

#include "daemon/core/contactors/output_gate.hpp"
#include "daemon/core/decisions.hpp"
#include "protocol/tables/internal_bus.hpp"

namespace bmu {

/// Far more than a decision takes, and far less than the unit's patience lacks when a command is due.
inline constexpr Duration closing_decision_life = 30ms;

[[nodiscard]] constexpr bool is_too_late(const ContactorOutputs& outputs, Duration since_decided) {
  return outputs.any_contactor() && since_decided > closing_decision_life;
}

[[nodiscard]] inline bool is_too_late(const OutgoingFrame& outgoing, Duration since_decided) {
  const bool is_command =
      outgoing.port == Port::internal && outgoing.frame.id == internal_bus::contactor_command.base_id;
  return is_command && is_too_late(outputs_of(outgoing.frame), since_decided);
}

}  // namespace bmu

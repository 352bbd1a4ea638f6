// Age check: a decision that keeps a contactor closed is executed at once, or not at all.
//
// Between a decision and its frame the process may be stopped or starved for longer than the timeout of the power
// distribution unit (PDU): the PDU opens by itself, the frame is sent when the process continues, and the PDU follows
// it, without a precharge. So the clock is read again just before sending. A late frame is not sent; the core observes
// that sending failed and decides again; whether the stall was long enough to open is the core's decision. A command to
// open is never too late.
//
// Residual risk: a stall between that reading of the clock and the kernel, which takes a few instructions.
#pragma once

#include "daemon/core/contactors/output_gate.hpp"
#include "daemon/core/decisions.hpp"
#include "protocol/tables/internal_bus.hpp"

namespace bmu {

/// Much longer than a decision takes, and much shorter than the remaining timeout of the PDU when a command is due.
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

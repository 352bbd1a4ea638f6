// The one door everything sent passes, and which can say no: only messages that are ours to send, in their right form,
// and never a contactor command that closes more than the decision of this tick allows.
#pragma once

#include <cstdint>
#include <string_view>

#include "daemon/core/contactor_sequence.hpp"
#include "daemon/core/observation.hpp"
#include "protocol/frame.hpp"

namespace bmu {

enum class GateVerdict : std::uint8_t {
  pass,
  not_ours,       // no such message, or not one of the master's, on this bus
  malformed,      // wrong length, checksum or complement
  not_permitted,  // a contactor command that goes beyond what was decided
};

[[nodiscard]] std::string_view to_text(GateVerdict verdict);

struct GateRules {
  std::uint16_t vehicle_base_id = 0x620;
  bool may_stay_closed = false;  // this tick's permission
  ContactorOutputs decided;      // this tick's outputs
};

[[nodiscard]] GateVerdict judge_output(Port port, const CanFrame& frame, const GateRules& rules);

/// The CONTACTOR_COMMAND that says this.
[[nodiscard]] CanFrame contactor_command_frame(const ContactorOutputs& outputs, std::uint8_t counter);
[[nodiscard]] ContactorOutputs outputs_of(const CanFrame& contactor_command);

}  // namespace bmu

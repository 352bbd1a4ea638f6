// The commanded outputs, the auxiliary contacts and the inputs, as JSON: as they are now, and as they were when a fault
// was confirmed. Each is one member, with its name here.
#pragma once

#include "daemon/core/contactors/contactor_sequence.hpp"
#include "daemon/core/measurement/sensor_table.hpp"
#include "daemon/core/types/core_config.hpp"
#include "daemon/shell/json/json_text.hpp"

namespace bmu {

void put_outputs(JsonText& to, const ContactorOutputs& outputs);
/// `missing`: lines of this machine that cannot be read; their values are null, whatever the PDU reports. Null: none
/// are.
void put_feedback(JsonText& to, const PduState& pdu, const LinesConfig* missing = nullptr);
/// `estops_pressed` and `interlocks_open` are those on lines of this machine, by their number.
void put_inputs(JsonText& to, const PduState& pdu, const LinesConfig* missing = nullptr);

}  // namespace bmu

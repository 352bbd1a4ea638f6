// What bmuctl is told about the running daemon, as JSON. Keys carry the unit tokens of the code; what is not known, too
// old or not valid is null, with its validity and age beside it. Reads the core, changes nothing.
#pragma once

#include "daemon/shell/status_view.hpp"

namespace bmu {

/// The whole at a glance: state, pack values, limits, faults by name, buses, modules, last closing and opening.
[[nodiscard]] Json status_json(const StatusView& view);
/// Every cell: voltages, temperatures, balancing and ages by module, with the limits they are judged by.
[[nodiscard]] Json cells_json(const StatusView& view);
/// What is commanded, by name.
[[nodiscard]] Json outputs_json(const ContactorOutputs& outputs);
/// The auxiliary contacts, by the same names.
[[nodiscard]] Json feedback_json(const PduState& pdu);
/// The inputs of the unit; `estops_pressed` and `interlocks_open` are those on lines of this machine, by their number.
[[nodiscard]] Json inputs_json(const PduState& pdu);
/// Every row of the fault table with what was seen and what is remembered; times of the wall clock are ms since 1970,
/// null where nobody had told it. In faults_json.cpp.
[[nodiscard]] Json faults_json(const StatusView& view);

}  // namespace bmu

// What bmuctl is told about the running daemon, as JSON: the members of an answer. Keys carry the unit tokens of the
// code; what is not known, too old or not valid is null, with its validity and age beside it. Reads the core, changes
// nothing.
#pragma once

#include "daemon/shell/status/status_view.hpp"

namespace bmu {

/// The whole at a glance: state, pack values, limits, faults by name, buses, modules, last closing and opening.
void put_status(JsonText& to, const StatusView& view);
/// Every cell: voltages, temperatures, balancing and ages by module, with the limits they are judged by. In
/// cells_json.cpp.
void put_cells(JsonText& to, const StatusView& view);
/// Every row of the fault table with what was seen and what is remembered; times of the wall clock are ms since 1970,
/// null where nobody had told it. In faults_json.cpp.
void put_faults(JsonText& to, const StatusView& view);

}  // namespace bmu

// Status of the running daemon for bmuctl, as JSON: the members of a reply. Keys carry the unit tokens of the code; a
// value that is unknown, stale or invalid is null, with its validity and age beside it. Reads the core, changes
// nothing.
#pragma once

#include "daemon/shell/status/status_view.hpp"

namespace bmu {

/// The overview: state, pack values, limits, faults by name, buses, modules, last closing and opening.
void put_status(JsonText& to, const StatusView& view);
/// Every cell: voltages, temperatures, balancing and ages by module, with the limits that apply to them. In
/// cells_json.cpp.
void put_cells(JsonText& to, const StatusView& view);
/// Every row of the fault table with its readings and records; times of the wall clock are ms since 1970, null where it
/// was unknown. In faults_json.cpp.
void put_faults(JsonText& to, const StatusView& view);

}  // namespace bmu

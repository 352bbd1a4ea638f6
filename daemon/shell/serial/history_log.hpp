// The minutes of a history as lines for the serial console's LogReq, the oldest first:
//
//   2026-03-01 17:01:00 I:21.350A U:189.55V SOC:80.0% SOH:98.2% C:3.9848,3.9851,... T:25.1,25.0,... E:cell_undervoltage
//
// Each has the averages over the minute (BMS_F.5): the current, positive out of the pack; the voltage of each cell;
// each temperature; and SOC and SOH at its end, and its faults. An unknown value is "-".
//
// Reads the database beside its writer, as any process may (history_reader.hpp), in pieces, on the console's thread.
#pragma once

#include <string>

#include "daemon/history/history_row.hpp"
#include "daemon/shell/serial/log_source.hpp"

namespace bmu {

/// Log of the database at `path`; empty path: there is none, and the log is empty.
[[nodiscard]] LogSource history_log(std::string path);

[[nodiscard]] std::string log_line(const HistoryRow& row);

}  // namespace bmu

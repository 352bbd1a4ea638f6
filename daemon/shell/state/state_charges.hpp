// The charge missing in each cell (daemon/core/estimation/cell_charge_record.hpp) as JSON, for the state file:
//
//   {"unix_time_ms":1700000000000,"capacity_uAs":360000000000,
//    "modules":{"1":{"serial_number":4711,"cells_uAs":[[missing,uncertainty],...]}}}
//
// null: no charges are kept. In a file from before there were any, the key is missing.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "daemon/core/estimation/cell_charge_record.hpp"
#include "protocol/result.hpp"

namespace bmu {

[[nodiscard]] nlohmann::ordered_json charges_json(const CellChargeRecords& records);
/// The error names the key, the value found and the one expected. Never throws. CellChargeBook decides whether the
/// numbers can be those of this pack.
[[nodiscard]] Result<CellChargeRecords, std::string> parse_charges(const nlohmann::ordered_json& json);

}  // namespace bmu

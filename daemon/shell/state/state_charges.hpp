// What was missing in each cell (daemon/core/estimation/cell_charge_record.hpp) as JSON, for the state file:
//
//   {"unix_time_ms":1700000000000,"capacity_uAs":360000000000,
//    "modules":{"1":{"serial_number":4711,"cells_uAs":[[missing,uncertainty],...]}}}
//
// null: no book is kept. Of a file from before there was one, the key is missing.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "daemon/core/estimation/cell_charge_record.hpp"
#include "protocol/result.hpp"

namespace bmu {

[[nodiscard]] nlohmann::ordered_json charges_json(const CellChargeRecords& records);
/// The error names the key, what was found and what was wanted. Never throws. Whether the numbers can be this pack's
/// is for the book to say.
[[nodiscard]] Result<CellChargeRecords, std::string> parse_charges(const nlohmann::ordered_json& json);

}  // namespace bmu

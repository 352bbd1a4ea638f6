// The states of charge of the cells (daemon/core/estimation/soc_record.hpp) as JSON, for the state file:
//
//   {"unix_time_ms":1700000000000,"is_last":true,"capacity_uAs":360000000000,"told_ppm":600000,
//    "modules":{"1":{"serial_number":4711,"cells":[[soc_ppm,sigma_ppm,hysteresis_permille,
//                capacity_ppm,capacity_sigma_ppm,resistance_ppm,resistance_sigma_ppm],...]}}}
//
// The last four are the health of the cell, 0 if unknown; a file from before they were kept has three numbers. null:
// none are kept. In a file from before there were any, the key is missing.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "daemon/core/estimation/soc_record.hpp"
#include "protocol/result.hpp"

namespace bmu {

[[nodiscard]] nlohmann::ordered_json soc_json(const SocRecords& records);
/// The error names the key, the value found and the one expected. Never throws.
[[nodiscard]] Result<SocRecords, std::string> parse_soc(const nlohmann::ordered_json& json);

}  // namespace bmu

#include "daemon/shell/state/state_charges.hpp"

#include <cstdint>
#include <utility>

#include "daemon/shell/state/state_modules.hpp"
#include "daemon/shell/state/state_parts.hpp"

namespace bmu {

namespace {

using Json = nlohmann::ordered_json;

constexpr const char* cells_key = "cells_uAs";
/// Far above any capacity, and far below the overflow of a sum.
constexpr std::int64_t charge_max_uAs = std::int64_t{1} << 60;

std::string parse_cell(const Json& json, const std::string& place, CellChargeRecord& cell) {
  const bool is_pair = json.is_array() && json.size() == 2;
  const auto missing = is_pair ? number_from(json[0], -charge_max_uAs, charge_max_uAs) : std::nullopt;
  const auto uncertainty = is_pair ? number_from(json[1], 0, charge_max_uAs) : std::nullopt;
  if (!missing || !uncertainty) return wrong_in_state(place, json, "two charges, the second not below 0");
  cell = {.missing_uAs = *missing, .uncertainty_uAs = *uncertainty};
  return {};
}

std::string parse_all(const Json& json, CellChargeRecords& records) {
  const auto unix_time_ms = number_from(value_at(json, "unix_time_ms"), 1, unix_time_max_ms);
  if (!unix_time_ms) {
    return wrong_in_state("cell_charges/unix_time_ms", value_at(json, "unix_time_ms"), "milliseconds since 1970");
  }
  const auto capacity_uAs = number_from(value_at(json, "capacity_uAs"), 1, charge_max_uAs);
  if (!capacity_uAs) {
    return wrong_in_state("cell_charges/capacity_uAs", value_at(json, "capacity_uAs"), "a charge above 0");
  }
  records.unix_time_ms = *unix_time_ms;
  records.capacity_uAs = *capacity_uAs;
  return parse_state_modules(value_at(json, "modules"), "cell_charges/modules", cells_key, parse_cell, records);
}

}  // namespace

Json charges_json(const CellChargeRecords& records) {
  if (records.unix_time_ms == 0) return nullptr;
  Json modules = state_modules_json(records, cells_key, [](const CellChargeRecord& cell) {
    return Json::array({cell.missing_uAs, cell.uncertainty_uAs});
  });
  return {
      {"unix_time_ms", records.unix_time_ms}, {"capacity_uAs", records.capacity_uAs}, {"modules", std::move(modules)}};
}

Result<CellChargeRecords, std::string> parse_charges(const Json& json) {
  return parse_state_part<CellChargeRecords>(json, parse_all);
}

}  // namespace bmu

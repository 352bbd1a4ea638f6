#include "daemon/shell/state_charges.hpp"

#include <charconv>
#include <cstdint>
#include <utility>

#include "daemon/shell/state_parts.hpp"

namespace bmu {

namespace {

using Json = nlohmann::ordered_json;

/// Far above any capacity, and far below what a sum could overflow with.
constexpr std::int64_t charge_max_uAs = std::int64_t{1} << 60;

std::string parse_cell(const Json& json, const std::string& place, CellChargeRecord& cell) {
  const bool is_pair = json.is_array() && json.size() == 2;
  const auto missing = is_pair ? number_from(json[0], -charge_max_uAs, charge_max_uAs) : std::nullopt;
  const auto uncertainty = is_pair ? number_from(json[1], 0, charge_max_uAs) : std::nullopt;
  if (!missing || !uncertainty) return wrong_in_state(place, json, "two charges, the second not below 0");
  cell = {.missing_uAs = *missing, .uncertainty_uAs = *uncertainty};
  return {};
}

std::string parse_module(const Json& json, const std::string& place, ModuleChargeRecord& module) {
  const auto serial_number = number_from(value_at(json, "serial_number"), 0, UINT32_MAX);
  if (!serial_number) {
    return wrong_in_state(place + "/serial_number", value_at(json, "serial_number"), "0 to 4294967295");
  }
  const Json& cells = value_at(json, "cells_uAs");
  if (!cells.is_array() || cells.empty() || cells.size() > module.cells.size()) {
    return wrong_in_state(place + "/cells_uAs", cells, "1 to 12 cells");
  }
  module.serial_number = static_cast<std::uint32_t>(*serial_number);
  for (const Json& cell : cells) {
    const std::string cell_place = place + "/cells_uAs/" + std::to_string(module.cell_count);
    std::string problem = parse_cell(cell, cell_place, module.cells[module.cell_count]);
    if (!problem.empty()) return problem;
    ++module.cell_count;
  }
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
  const Json& modules = value_at(json, "modules");
  if (!modules.is_object()) return wrong_in_state("cell_charges/modules", modules, "modules by their node numbers");
  records.unix_time_ms = *unix_time_ms;
  records.capacity_uAs = *capacity_uAs;
  for (const auto& [name, module] : modules.items()) {
    const std::string place = "cell_charges/modules/" + name;
    const std::optional<std::size_t> node = node_from_text(name);
    if (!node) return place + " is no node number, wanted 1 to 63";
    std::string problem = parse_module(module, place, records.modules[*node]);
    if (!problem.empty()) return problem;
  }
  return {};
}

}  // namespace

std::optional<std::size_t> node_from_text(std::string_view text) {
  std::size_t node = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), node);
  const bool is_node =
      error == std::errc{} && end == text.data() + text.size() && node >= 1 && node <= internal_bus::node_count_max;
  return is_node ? std::optional(node) : std::nullopt;
}

Json charges_json(const CellChargeRecords& records) {
  if (records.unix_time_ms == 0) return nullptr;
  Json modules = Json::object();
  for (std::size_t node = 1; node < records.modules.size(); ++node) {
    const ModuleChargeRecord& module = records.modules[node];
    if (module.cell_count == 0) continue;
    Json cells = Json::array();
    for (std::size_t cell = 0; cell < module.cell_count; ++cell) {
      cells.push_back(Json::array({module.cells[cell].missing_uAs, module.cells[cell].uncertainty_uAs}));
    }
    modules[std::to_string(node)] = {{"serial_number", module.serial_number}, {"cells_uAs", std::move(cells)}};
  }
  return {
      {"unix_time_ms", records.unix_time_ms}, {"capacity_uAs", records.capacity_uAs}, {"modules", std::move(modules)}};
}

Result<CellChargeRecords, std::string> parse_charges(const Json& json) {
  CellChargeRecords records;
  if (json.is_null()) return records;
  std::string problem = parse_all(json, records);
  if (!problem.empty()) return failure(std::move(problem));
  return records;
}

}  // namespace bmu

// The modules in those parts of the state file that hold data of each cell, by their node numbers:
//
//   {"1":{"serial_number":4711,"CELLS":[cell,...]},...}
//
// The records of a part have an array `modules` by node number, each with its `serial_number`, `cell_count` and
// `cells`; the part defines the form of a cell, and the key of the cells.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <nlohmann/json.hpp>

#include "daemon/shell/state/state_parts.hpp"
#include "protocol/number_text.hpp"
#include "protocol/tables/internal_bus.hpp"

namespace bmu {

/// "1" to "63"; no value for any other text.
[[nodiscard]] inline std::optional<std::size_t> node_from_text(std::string_view text) {
  const auto node = number_of_text<std::size_t>(text);
  return node && *node >= 1 && *node <= internal_bus::node_count_max ? node : std::nullopt;
}

/// `parse_cell(json, place, cell)` returns the error, or "". So does this function.
template <class Module, class ParseCell>
[[nodiscard]] std::string parse_state_module(const nlohmann::ordered_json& json, const std::string& place,
                                             const char* cells_key, ParseCell parse_cell, Module& module) {
  const auto serial_number = number_from(value_at(json, "serial_number"), 0, UINT32_MAX);
  if (!serial_number) {
    return wrong_in_state(place + "/serial_number", value_at(json, "serial_number"), "0 to 4294967295");
  }
  const std::string cells_place = place + "/" + cells_key;
  const nlohmann::ordered_json& cells = value_at(json, cells_key);
  if (!cells.is_array() || cells.empty() || cells.size() > module.cells.size()) {
    return wrong_in_state(cells_place, cells, "1 to 12 cells");
  }
  module.serial_number = static_cast<std::uint32_t>(*serial_number);
  for (const nlohmann::ordered_json& cell : cells) {
    const std::string cell_place = cells_place + "/" + std::to_string(module.cell_count);
    std::string problem = parse_cell(cell, cell_place, module.cells[module.cell_count]);
    if (!problem.empty()) return problem;
    ++module.cell_count;
  }
  return {};
}

/// `json`: all modules. `place`: their key in the state.
template <class Records, class ParseCell>
[[nodiscard]] std::string parse_state_modules(const nlohmann::ordered_json& json, const std::string& place,
                                              const char* cells_key, ParseCell parse_cell, Records& records) {
  if (!json.is_object()) return wrong_in_state(place, json, "modules by their node numbers");
  for (const auto& [name, module] : json.items()) {
    std::string module_place = place;
    module_place.append("/").append(name);
    const std::optional<std::size_t> node = node_from_text(name);
    if (!node) return module_place + " is not a node number, expected 1 to 63";
    std::string problem = parse_state_module(module, module_place, cells_key, parse_cell, records.modules[*node]);
    if (!problem.empty()) return problem;
  }
  return {};
}

/// The modules that have cells. `cell_json(cell)`: the JSON of one cell.
template <class Records, class CellJson>
[[nodiscard]] nlohmann::ordered_json state_modules_json(const Records& records, const char* cells_key,
                                                        CellJson cell_json) {
  nlohmann::ordered_json modules = nlohmann::ordered_json::object();
  for (std::size_t node = 1; node < records.modules.size(); ++node) {
    const auto& module = records.modules[node];
    if (module.cell_count == 0) continue;
    nlohmann::ordered_json cells = nlohmann::ordered_json::array();
    for (std::size_t cell = 0; cell < module.cell_count; ++cell) cells.push_back(cell_json(module.cells[cell]));
    modules[std::to_string(node)] = {{"serial_number", module.serial_number}, {cells_key, std::move(cells)}};
  }
  return modules;
}

}  // namespace bmu

#include "config/cell_count.hpp"

#include <algorithm>

#include "config/json/json_reader.hpp"

namespace bmu {

namespace {

/// Number of modules for `cell_count` cells; if the limit is too low, one module gets more cells than the reader
/// accepts.
std::size_t module_count(const PackConfig& pack, std::size_t cell_count) {
  constexpr std::size_t most = internal_bus::cells_per_module_max;
  const auto allowed = static_cast<std::size_t>(pack.serial.modules_max);
  return std::clamp<std::size_t>((cell_count + most - 1) / most, 1, allowed);
}

/// Entry of the file for the `index`-th of `count` modules.
JsonValue entry_for(const JsonValue& first, std::uint8_t node, std::size_t index, std::size_t count,
                    std::size_t cell_count) {
  JsonValue entry = first;
  entry["cells"] = cell_count / count + (index < cell_count % count ? 1 : 0);
  if (index == 0) return entry;
  for (const char* key : {"nodes", "serial_number", "serial_numbers"}) entry.erase(key);
  entry["node"] = node + index;
  return entry;
}

}  // namespace

Result<PackConfig, ConfigProblems> with_cell_count(const PackConfig& pack, std::size_t cell_count) {
  ProblemList problems;
  auto tree = parse_json(pack.sources.pack_text, pack.sources.pack_name, problems);
  if (!tree) return failure(problems.take());
  JsonValue& modules = tree->at("modules");
  const JsonValue first = modules.at(0);
  const std::size_t count = module_count(pack, cell_count);
  modules = JsonValue::array();
  for (std::size_t index = 0; index < count; ++index) {
    modules.push_back(entry_for(first, pack.core.modules[0].node, index, count, cell_count));
  }
  PackSources sources = pack.sources;
  sources.pack_text = tree->dump();
  return parse_pack_config(sources);
}

}  // namespace bmu

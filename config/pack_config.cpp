#include "config/pack_config.hpp"

#include <array>
#include <cstdint>
#include <optional>
#include <system_error>

#include "config/cell_file/cell_config.hpp"
#include "config/checks/charger_checks.hpp"
#include "config/checks/inverter_checks.hpp"
#include "config/checks/pack_checks.hpp"
#include "config/checks/pack_defaults.hpp"
#include "config/fields/gpio_section.hpp"
#include "config/fields/pack_fields.hpp"
#include "config/fields/part_reader.hpp"
#include "config/fields/reaction_reader.hpp"
#include "config/json/json_reader.hpp"
#include "config/json/read_file.hpp"
#include "protocol/fnv.hpp"

namespace bmu {
namespace {

// --- cell -----------------------------------------------------------------------------------------------------------

/// The cell that the key "cell" names or holds, and the location of its keys for problems.
struct CellSource {
  Place place;
  CellFile cell{};
  std::string bytes{};  // of its file, for the hash
};

/// Source of the text of a cell's file.
struct CellOrigin {
  std::filesystem::path directory;     // base of its relative name
  const PackSources* given = nullptr;  // instead of a file
};

Result<std::string, std::string> cell_text(const std::filesystem::path& file, const CellOrigin& origin) {
  if (origin.given == nullptr) return read_file(file);
  if (origin.given->cell_name.empty()) return failure(std::string("no such text was given"));
  return origin.given->cell_text;
}

/// Reads a cell from a file of its own.
CellSource load_cell(const JsonValue& name, const Place& key_place, const CellOrigin& origin, ProblemList& problems) {
  const FieldInfo file_name{.key = "cell", .min = 1, .max = 4'096, .type = FieldType::text};
  CellSource source{.place = key_place};
  const auto text = read_value(name, file_name, key_place, problems);
  if (!text) return source;
  const std::filesystem::path file = origin.directory / std::get<std::string>(*text);
  const auto bytes = cell_text(file, origin);
  if (!bytes) {
    std::error_code ignored;
    const std::string looked_at = std::filesystem::absolute(file, ignored).lexically_normal().string();
    problems.add(key_place, shown(name) + " (" + in_quotes(looked_at) + ": " + bytes.error() + ")",
                 std::string(wanted_file) + ", named relative to the folder of the pack file");
    return source;
  }
  source.place = {file.string(), ""};
  source.bytes = *bytes;
  const auto tree = parse_json(*bytes, source.place.file, problems);
  if (tree) read_cell(*tree, source.place, source.cell, problems);
  return source;
}

CellSource read_cell_source(const JsonValue& root, const Place& root_place, const CellOrigin& origin,
                            ProblemList& problems) {
  CellSource source{.place = root_place.at("cell")};
  const JsonValue* cell = find_value(root, root_place, "cell", true, problems);
  if (cell == nullptr) return source;
  if (cell->is_string()) return load_cell(*cell, source.place, origin, problems);
  if (cell->is_object()) {
    read_cell(*cell, source.place, source.cell, problems);
  } else {
    problems.add(source.place, shown(*cell), "the name of a cell file, or an object that describes the cell");
  }
  return source;
}

// --- modules --------------------------------------------------------------------------------------------------------

/// Reads the modules in order, and tracks which element uses which node.
class ModuleReader {
 public:
  ModuleReader(FixedVector<ModuleConfig, modules_max>& modules, ProblemList& problems)
      : modules_(modules), problems_(problems) {}

  void read(const JsonValue& value, const Place& place) {
    if (!is_object(value, place, problems_)) return;
    std::vector<std::string_view> keys = keys_of(module_fields());
    keys.emplace_back("nodes");
    keys.emplace_back("serial_numbers");
    check_keys(value, place, keys, problems_);
    ModuleEntry entry;
    read_fields(value, place, module_fields(), entry, problems_);
    if (value.contains("node") == value.contains("nodes")) {
      problems_.add(place, shown(value), "either \"node\" or \"nodes\"");
    } else if (value.contains("node")) {
      if (value.contains("serial_numbers")) {
        problems_.add(place.at("serial_numbers"), shown(value.at("serial_numbers")),
                      "\"serial_number\" beside \"node\"");
      }
      add(value.at("node"), entry, place.at("node"));
    } else {
      if (value.contains("serial_number")) {
        problems_.add(place.at("serial_number"), shown(value.at("serial_number")),
                      "\"serial_numbers\" beside \"nodes\", one for each");
      }
      read_nodes(value, entry, place);
    }
  }

 private:
  void read_nodes(const JsonValue& value, ModuleEntry entry, const Place& value_place) {
    const JsonValue& nodes = value.at("nodes");
    const Place place = value_place.at("nodes");
    if (!nodes.is_array() || nodes.empty()) {
      problems_.add(place, shown(nodes), "a list of node numbers, [1, 2, 3]");
      return;
    }
    const std::vector<std::optional<std::uint32_t>> serials = read_serials(value, nodes.size(), value_place);
    for (std::size_t index = 0; index < nodes.size(); ++index) {
      const FieldInfo node{.key = "node", .min = 1, .max = node_max};
      const auto read = read_value(nodes[index], node, place.at(index), problems_);
      if (!read) continue;
      entry.node = static_cast<std::uint8_t>(std::get<double>(*read));
      entry.serial_number = serials[index];
      add(nodes[index], entry, place.at(index));
    }
  }

  /// Serial numbers, one for each node in their order; null if the module is to be registered.
  std::vector<std::optional<std::uint32_t>> read_serials(const JsonValue& value, std::size_t count,
                                                         const Place& value_place) {
    std::vector<std::optional<std::uint32_t>> serials(count);
    if (!value.contains("serial_numbers")) return serials;
    const JsonValue& list = value.at("serial_numbers");
    const Place place = value_place.at("serial_numbers");
    if (!list.is_array() || list.size() != count) {
      problems_.add(place, list.is_array() ? std::to_string(list.size()) + " serial numbers" : shown(list),
                    "as many as \"nodes\" has, " + std::to_string(count) + ", null for one that is to be remembered");
      return serials;
    }
    for (std::size_t index = 0; index < count; ++index) {
      if (list[index].is_null()) continue;
      const FieldInfo info{.key = "serial_number", .min = 0, .max = serial_number_max};
      const auto read = read_value(list[index], info, place.at(index), problems_);
      if (read) serials[index] = static_cast<std::uint32_t>(std::get<double>(*read));
    }
    return serials;
  }

  /// The capacity suffices: more than 63 modules cannot have different nodes.
  void add(const JsonValue& shown_node, const ModuleEntry& entry, const Place& place) {
    if (entry.node == 0) return;  // was reported as out of range
    std::string& owner = owner_of_node_.at(entry.node);
    if (!owner.empty()) {
      problems_.add(place, shown(shown_node), "a node number no other module has; it is taken by " + owner);
      return;
    }
    owner = place.path;
    const auto has_serial = [&entry](const ModuleConfig& other) {
      return entry.serial_number && other.serial_number == entry.serial_number;
    };
    if (const auto* const other = std::find_if(modules_.begin(), modules_.end(), has_serial); other != modules_.end()) {
      problems_.add(place, "serial number " + std::to_string(*entry.serial_number),
                    "one that no other module has; node " + std::to_string(other->node) + " has it");
      return;
    }
    modules_.push_back({entry.node, entry.cell_count, entry.temperature_sensor_count, entry.serial_number,
                        entry.must_report_front_end});
  }

  FixedVector<ModuleConfig, modules_max>& modules_;
  ProblemList& problems_;
  std::array<std::string, modules_max + 1> owner_of_node_;
};

std::size_t module_count_in(const JsonValue& list) {
  std::size_t count = 0;
  for (const JsonValue& entry : list) {
    const bool has_nodes = entry.is_object() && entry.contains("nodes") && entry.at("nodes").is_array();
    count += has_nodes ? entry.at("nodes").size() : 1;
  }
  return count;
}

void read_modules(const JsonValue& root, const Place& root_place, CoreConfig& core, ProblemList& problems) {
  const JsonValue* list = find_value(root, root_place, "modules", true, problems);
  if (list == nullptr) return;
  const Place place = root_place.at("modules");
  if (!list->is_array() || list->empty()) {
    problems.add(place, shown(*list), "a list of modules, [{ ... }]");
    return;
  }
  const std::size_t count = module_count_in(*list);
  if (count > modules_max) {
    problems.add(place, std::to_string(count) + " modules", "at most " + std::to_string(modules_max));
    return;
  }
  ModuleReader reader(core.modules, problems);
  for (std::size_t index = 0; index < list->size(); ++index) reader.read((*list)[index], place.at(index));
}

// --- other sections --------------------------------------------------------------------------------------------------

template <class Target>
void read_section(const JsonValue& parent, const Place& parent_place, const SectionInfo& section,
                  std::span<const Field<Target>> fields, Target& target, ProblemList& problems) {
  const JsonValue* object = find_value(parent, parent_place, section.key, section.is_required, problems);
  const Place place = parent_place.at(section.key);
  if (object == nullptr || !is_object(*object, place, problems)) return;
  check_keys(*object, place, keys_of(fields), problems);
  read_fields(*object, place, fields, target, problems);
}

void read_limits(const JsonValue& root, const Place& root_place, LimitsConfig& limits, ProblemList& problems) {
  const JsonValue* object = find_value(root, root_place, "limits", true, problems);
  const Place place = root_place.at("limits");
  if (object == nullptr || !is_object(*object, place, problems)) return;
  std::vector<std::string_view> keys;
  for (const LimitRow& row : limit_rows()) {
    keys.push_back(row.key);
    read_section(*object, place, SectionInfo{.key = row.key, .is_required = row.is_required, .meaning = row.meaning},
                 row.fields, limits.*row.member, problems);
  }
  check_keys(*object, place, keys, problems);
}

/// Reads everything but the cell. The keys of the top level are those of the tables, so that none can be missing here.
void read_pack(const JsonValue& root, const Place& place, PackConfig& pack, ProblemList& problems) {
  std::vector<std::string_view> keys = keys_of(pack_fields());
  keys.insert(keys.end(), std::begin(composite_keys), std::end(composite_keys));
  visit_sections(pack, [&](const SectionInfo& section, auto fields, auto& target) {
    keys.push_back(section.key);
    read_section(root, place, section, fields, target, problems);
  });
  check_keys(root, place, keys, problems);
  read_fields(root, place, pack_fields(), pack, problems);
  read_modules(root, place, pack.core, problems);
  read_limits(root, place, pack.core.limits, problems);
  read_reactions(root, place, pack.core, problems);
  read_parts(root, place, pack.core, problems);
  read_gpio(root, place, pack, problems);
}

Result<PackConfig, ConfigProblems> parse_pack(std::string_view text, std::string_view file_name,
                                              const CellOrigin& origin) {
  ProblemList problems;
  const Place place{std::string(file_name), ""};
  const auto root = parse_json(text, place.file, problems);
  if (!root || !is_object(*root, place, problems)) return failure(problems.take());

  PackConfig pack;
  read_pack(*root, place, pack, problems);
  const CellSource source = read_cell_source(*root, place, origin, problems);
  pack.cell_name = source.cell.name;
  pack.core.cell = source.cell.model;
  pack.core.dynamics = source.cell.dynamics;
  pack.core.derating = source.cell.derating;
  pack.core.charge_plateau = source.cell.charge_plateau;
  pack.core.intake_air = pack.intake_air.core();
  set_buses(pack, BusNames(pack.buses));
  check_cell(pack.core.cell, source.place, problems);
  check_pack(pack, place, source.place, problems);
  complete_defaults(pack.core);
  pack.poll_in_file = pack.core.poll;
  complete_paces(pack);
  if (problems.empty()) {
    check_completed_charger(pack, place, problems);
    check_completed_inverter(pack, place, problems);
  }
  if (!problems.empty()) return failure(problems.take());
  pack.core.hash = continue_fnv(continue_fnv(fnv_start, text), source.bytes);
  pack.sources = {.pack_name = place.file,
                  .pack_text = std::string(text),
                  .cell_name = source.place.file == place.file ? "" : source.place.file,
                  .cell_text = source.bytes};
  return pack;
}

}  // namespace

void set_buses(PackConfig& pack, const BusNames& names) {
  pack.buses = names;
  pack.core.served_by = served_by(names);
}

Result<PackConfig, ConfigProblems> parse_pack_config(std::string_view text, std::string_view file_name,
                                                     const std::filesystem::path& directory) {
  return parse_pack(text, file_name, {.directory = directory});
}

Result<PackConfig, ConfigProblems> parse_pack_config(const PackSources& sources) {
  return parse_pack(sources.pack_text, sources.pack_name, {.given = &sources});
}

Result<PackConfig, ConfigProblems> load_pack_config(const std::filesystem::path& file) {
  ProblemList problems;
  const Place place{file.string(), ""};
  const auto bytes = read_file(file);
  if (!bytes) {
    problems.add(place, bytes.error(), wanted_file);
    return failure(problems.take());
  }
  return parse_pack_config(*bytes, place.file, file.parent_path());
}

}  // namespace bmu

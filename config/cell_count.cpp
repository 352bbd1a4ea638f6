#include "config/cell_count.hpp"

#include "config/json_reader.hpp"

namespace bmu {

Result<PackConfig, ConfigProblems> with_cell_count(const PackConfig& pack, std::size_t cell_count) {
  ProblemList problems;
  auto tree = parse_json(pack.sources.pack_text, pack.sources.pack_name, problems);
  if (!tree) return failure(problems.take());
  for (JsonValue& module : tree->at("modules")) module["cells"] = cell_count;
  PackSources sources = pack.sources;
  sources.pack_text = tree->dump();
  return parse_pack_config(sources);
}

}  // namespace bmu

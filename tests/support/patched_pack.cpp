#include "tests/support/patched_pack.hpp"

#include <fstream>
#include <stdexcept>
#include <string>

#include <nlohmann/json.hpp>

#include "config/pack_config.hpp"
#include "tests/support/folders.hpp"

namespace bmu::test {

CoreConfig patched_pack(std::string_view patch, std::string_view name) {
  const std::string folder = in_source("config/packs");
  const std::string path = folder + "/" + std::string(name);
  std::ifstream file(path);
  if (!file) throw std::runtime_error(path + ": cannot be read");
  nlohmann::json pack = nlohmann::json::parse(file, nullptr, true, true);
  pack.merge_patch(nlohmann::json::parse(patch));
  const auto read = parse_pack_config(pack.dump(), path, folder);
  if (read) return read->core;
  std::string problems;
  for (const ConfigProblem& problem : read.error()) problems += to_text(problem) + "\n";
  throw std::runtime_error(problems);
}

}  // namespace bmu::test

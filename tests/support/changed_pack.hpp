// The demonstration pack with any of its keys changed, and the problems found when it is read: for tests of the pack
// file.
#pragma once

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "config/pack_config.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/folders.hpp"

namespace bmu {

using Json = nlohmann::json;

inline const std::filesystem::path packs_directory = test::in_source("config/packs");
inline const std::filesystem::path cells_directory = test::in_source("config/cells");

inline std::string bytes_of(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  REQUIRE(stream);
  std::ostringstream bytes;
  bytes << stream.rdbuf();
  return bytes.str();
}

/// The demonstration pack as a tree with its cell in place, so that a test can change any key of either.
inline Json valid_pack() {
  Json pack = Json::parse(bytes_of(packs_directory / "demo-48s.json"), nullptr, true, true);
  pack["cell"] = Json::parse(bytes_of(cells_directory / "nmc-30ah-10p.json"), nullptr, true, true);
  return pack;
}

inline Result<PackConfig, ConfigProblems> parse(const std::string& text) {
  return parse_pack_config(text, "pack.json", packs_directory);
}

inline ConfigProblems problems_of(const std::string& text) {
  const auto result = parse(text);
  return result ? ConfigProblems{} : result.error();
}

inline std::string all_text(const ConfigProblems& problems) {
  std::string text;
  for (const ConfigProblem& problem : problems) text += to_text(problem) + "\n";
  return text;
}

using Change = std::pair<std::string, Json>;  // JSON pointer, value

inline Json changed(const std::vector<Change>& changes) {
  Json pack = valid_pack();
  for (const auto& [pointer, value] : changes) pack[Json::json_pointer(pointer)] = value;
  return pack;
}

inline Json without(const std::string& parent, const std::string& key) {
  Json pack = valid_pack();
  pack[Json::json_pointer(parent)].erase(key);
  return pack;
}

inline void accepts(const std::vector<Change>& changes) {
  const ConfigProblems problems = problems_of(changed(changes).dump());
  INFO(all_text(problems));
  CHECK(problems.empty());
}

/// Exactly one problem, at this path, with these words in its text.
inline void refuses_text(const std::string& text, const std::string& path, const std::string& words) {
  const ConfigProblems problems = problems_of(text);
  INFO(all_text(problems));
  REQUIRE(problems.size() == 1);
  CHECK(problems.front().path == path);
  CHECK(to_text(problems.front()).find(words) != std::string::npos);
}

inline void refuses(const std::vector<Change>& changes, const std::string& path, const std::string& words) {
  refuses_text(changed(changes).dump(), path, words);
}

/// GPIO lines of this machine for every use that a line can have.
inline Json gpio_section() {
  return Json::parse(R"({
    "chip": "/dev/gpiochip0",
    "outputs": {"main_positive": {"line": 3, "active_low": true}, "main_negative": {"line": 4}, "precharge": {"line": 5},
                "fan": {"line": 6}, "watchdog": {"line": 2}},
    "feedback": {"main_positive": {"line": 13, "active_low": true}, "main_negative": {"line": 14, "debounce_ms": 0}},
    "inputs": [{"name": "cockpit", "kind": "estop", "line": 7, "active_low": true, "debounce_ms": 20},
               {"name": "rear", "kind": "estop", "line": 8}, {"name": "key", "kind": "vehicle_on", "line": 9}]})");
}

/// The section with these changes, paths relative to it.
inline Json with_gpio(const std::vector<Change>& changes) {
  Json gpio = gpio_section();
  for (const auto& [pointer, value] : changes) gpio[Json::json_pointer(pointer)] = value;
  return changed({{"/gpio", gpio}});
}

}  // namespace bmu

// Words joined to one text.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace bmu::command_line {

/// `between`: separator of the words.
[[nodiscard]] inline std::string joined(const std::vector<std::string>& words, std::string_view between) {
  std::string all;
  for (const std::string& word : words) all += (all.empty() ? "" : std::string(between)) + word;
  return all;
}

}  // namespace bmu::command_line

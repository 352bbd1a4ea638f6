// A problem in a file, and its location.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace bmu {

/// Position in a text, counted from 1; a column is a byte.
struct TextPosition {
  std::size_t line = 0;
  std::size_t column = 0;
};

/// One problem in a file.
struct ConfigProblem {
  std::string file;
  std::string path;                  // JSON pointer, "/limits/cell_overvoltage/open_mV"; empty for the file itself
  std::string found;                 // "4300"
  std::string wanted;                // "at most 4250, the absolute maximum of the cell"
  std::optional<TextPosition> at{};  // only if the text is not JSON at all
};

/// "pack.json: /modules/2/node: found 1, wanted a node number no other module has"
/// "pack.json:14:24: found a syntax error ..., wanted JSON, comments allowed"
[[nodiscard]] std::string to_text(const ConfigProblem& problem);

using ConfigProblems = std::vector<ConfigProblem>;

}  // namespace bmu

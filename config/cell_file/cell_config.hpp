// A cell in a file of its own (config/cells/) or in a pack file: what is read of it, and what must fit together in it.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "config/json/json_reader.hpp"
#include "config/types/cell_file.hpp"
#include "protocol/result.hpp"

namespace bmu {

/// Reads and checks a cell file by itself. Never throws; reports all problems, not the first.
[[nodiscard]] Result<CellFile, ConfigProblems> load_cell_file(const std::filesystem::path& file);

/// The same from text.
[[nodiscard]] Result<CellFile, ConfigProblems> parse_cell_file(std::string_view text, std::string_view file_name);

/// Fills the cell from its object; what is missing or wrong leaves its member as it was.
void read_cell(const JsonValue& object, const Place& place, CellFile& cell, ProblemList& problems);

/// What no key of the cell can say alone. A value that was already refused is left out.
void check_cell(const CellModel& cell, const Place& place, ProblemList& problems);

}  // namespace bmu

// Reading and checking of a cell, in a file of its own (config/cells/) or in a pack file.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "config/json/json_reader.hpp"
#include "config/types/cell_file.hpp"
#include "protocol/result.hpp"

namespace bmu {

/// Reads and checks a cell file by itself. Never throws; reports all problems, not only the first.
[[nodiscard]] Result<CellFile, ConfigProblems> load_cell_file(const std::filesystem::path& file);

/// The same from text.
[[nodiscard]] Result<CellFile, ConfigProblems> parse_cell_file(std::string_view text, std::string_view file_name);

/// Fills the cell from its object; a missing or wrong key leaves its member unchanged.
void read_cell(const JsonValue& object, const Place& place, CellFile& cell, ProblemList& problems);

/// Checks keys of the cell against each other. A value that was already rejected is not checked.
void check_cell(const CellModel& cell, const Place& place, ProblemList& problems);

}  // namespace bmu

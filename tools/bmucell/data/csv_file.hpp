// A CSV file, compressed with gzip or not: recordings, and tables of test benches. Its contents: csv_table.hpp.
#pragma once

#include <filesystem>
#include <string>

#include "protocol/result.hpp"
#include "tools/bmucell/data/csv_table.hpp"

namespace bmu::cell {

/// The error is one line: file, line if there is one, column, found and expected value.
[[nodiscard]] Result<CsvTable, std::string> read_csv(const std::filesystem::path& file, const CsvSpec& spec);

/// Reads a table that must be complete: a last line that may be truncated is refused.
[[nodiscard]] Result<CsvTable, std::string> read_whole_csv(const std::filesystem::path& file, const CsvSpec& spec);

}  // namespace bmu::cell

// A CSV file, packed with gzip or not: recordings, and tables of test benches. What is read of it: csv_table.hpp.
#pragma once

#include <filesystem>
#include <string>

#include "protocol/result.hpp"
#include "tools/bmucell/data/csv_table.hpp"

namespace bmu::cell {

/// The error is one line: file, line if there is one, column, what was found and what was expected.
[[nodiscard]] Result<CsvTable, std::string> read_csv(const std::filesystem::path& file, const CsvSpec& spec);

/// The same of a table that is whole: a last line that may be cut off is refused.
[[nodiscard]] Result<CsvTable, std::string> read_whole_csv(const std::filesystem::path& file, const CsvSpec& spec);

}  // namespace bmu::cell

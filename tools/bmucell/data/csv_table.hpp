// Numbers from the text of a CSV file, for readers with a fixed list of columns. Only text with an unambiguous meaning
// is accepted:
//
//   separator     the one with which the first line has the required names: comma, semicolon, tab or blanks
//   first line    a line "sep=;" before it, and lines without any text anywhere, are skipped
//   row names     as R writes them: a quoted name before the values, and none for it in the first line
//   numbers       a plus sign is permitted; empty, "nan" and "NA" mean not measured; not "inf"
//   last line     without a line end it may be truncated, also within its last number, which then has another value;
//                 it is omitted, unless all its fields are there and the last one is in quotes
//   decimal mark  comma, if no number of the file has a point and at least one cannot be a number of thousands
//
// The error is the end of a message, after the name of the file: line, column, found and expected value, and for a
// first line without the required names its beginning and the remedy. Cost: linear in the text.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/result.hpp"

namespace bmu::cell {

/// The columns to read.
struct CsvSpec {
  std::vector<std::string> names{};  // in any order in the file; other columns are ignored
  std::size_t required = 0;          // number of leading names that must be in the file; at least 1
  std::size_t never_empty = 0;       // number of leading names that must have a number in every row
  std::string head{};                // the expected first line, for messages
};

struct CsvTable {
  std::vector<bool> has_column{};    // by column of the spec
  std::vector<double> values{};      // row by row, by column of the spec; not a number where nothing was measured
  std::vector<std::size_t> lines{};  // lines of the file in which the rows start, from 1
  std::size_t torn_line = 0;         // the last line, omitted since it may be truncated; 0: none

  [[nodiscard]] std::size_t row_count() const { return lines.size(); }
  [[nodiscard]] std::span<const double> row(std::size_t at) const {
    return std::span(values).subspan(at * has_column.size(), has_column.size());
  }
};

/// `text`: UTF-8, as utf8_text() returns it.
[[nodiscard]] Result<CsvTable, std::string> parse_csv(std::string_view text, const CsvSpec& spec);

}  // namespace bmu::cell

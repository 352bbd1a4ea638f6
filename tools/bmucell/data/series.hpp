// A recorded test of a cell: CSV as exported by test benches (csv_table.hpp), compressed with gzip or not.
//
// The first line names the columns, in any order; other columns are ignored:
//   time_s       required; may be uneven, and a row at which it does not rise is kept (the estimators receive it as
//                it is)
//   current_A    required; positive out of the cell, the mean since the row before
//   voltage_V    required; at the cell's terminals
//   temp_C       of the cell
//   ref_soc_pct  true state of charge, counted by the bench
//   cycle        the number of the charge or discharge, if a file holds several: time_s restarts in each
// An empty field, or "nan", means not measured.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "protocol/result.hpp"

namespace bmu::cell {

struct SeriesRow {
  double time_s = 0.0;
  double current_A = 0.0;
  double voltage_V = 0.0;
  double temperature_C = 0.0;
  double soc = 0.0;  // 0 to 1
  double cycle = 0.0;
  std::size_t line = 0;  // in the file; 0: not from a file
};

struct Series {
  std::string name;  // as given by the user
  std::vector<SeriesRow> rows;
  bool has_temperature = false;
  bool has_soc = false;
  bool has_cycle = false;
  std::size_t torn_line = 0;  // the last line, omitted since it may be truncated; 0: none
};

/// "FILE:69: the last line has no line end and may be cut off: it is left out"; "": no line is omitted.
[[nodiscard]] std::string torn_line_text(const Series& series);

/// The error is one line: file, line, column, found and expected value.
[[nodiscard]] Result<Series, std::string> read_series(const std::filesystem::path& file);

/// Distance in seconds above which rows are not neighbours, ten times the usual one: the charge between such rows is
/// not recorded.
[[nodiscard]] double gap_of(const Series& series);

}  // namespace bmu::cell

// A recorded test of a cell: CSV as test benches export it (csv_table.hpp), packed with gzip or not.
//
// The first line names the columns, in any order; others than these are passed over:
//   time_s       needed; need not be even, and where it does not rise the row is kept (the estimators see it as it is)
//   current_A    needed; positive out of the cell, the mean since the row before
//   voltage_V    needed; at the cell's terminals
//   temp_C       of the cell
//   ref_soc_pct  what the state of charge really was, by the bench's own counting
//   cycle        the number of the charge or discharge, where a file holds many: time_s begins anew in each
// An empty field, or "nan", was not measured.
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
  std::size_t line = 0;  // in the file; 0: from no file
};

struct Series {
  std::string name;  // as it was given
  std::vector<SeriesRow> rows;
  bool has_temperature = false;
  bool has_soc = false;
  bool has_cycle = false;
  std::size_t torn_line = 0;  // the last line, left out since it may be cut off; 0: none is
};

/// "FILE:69: the last line has no line end and may be cut off: it is left out"; "": none is.
[[nodiscard]] std::string torn_line_text(const Series& series);

/// The error is one line: file, line, column, what was found and what was expected.
[[nodiscard]] Result<Series, std::string> read_series(const std::filesystem::path& file);

/// Rows further apart than this, in seconds, are not neighbours, ten times the usual distance: what flowed between them
/// is not recorded.
[[nodiscard]] double gap_of(const Series& series);

}  // namespace bmu::cell

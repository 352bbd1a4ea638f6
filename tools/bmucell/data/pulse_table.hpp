// Resistances from pulses, as measured by test benches, and the position of each pulse in the recorded series.
//
// A table is CSV, compressed with gzip or not; the first line names the columns, other columns are ignored:
//   ref_soc_pct  required; state of charge before the pulse
//   pulse_A      required; its current, positive out of the cell
//   a resistance required, in mOhm: the user names the column
//   temp_C       of the cell before the pulse; without this column, the temperature of the series
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "protocol/result.hpp"
#include "tools/bmucell/data/series.hpp"

namespace bmu::cell {

struct PulseRow {
  double soc = 0.0;  // 0 to 1
  double current_A = 0.0;
  double resistance_Ohm = 0.0;
  double temperature_C = 0.0;  // not a number where the table has none
};

struct PulseTable {
  std::string name;    // as given by the user
  std::string column;  // source of the resistances
  std::vector<PulseRow> rows;
};

/// The error is one line: file, line, column, found and expected value.
[[nodiscard]] Result<PulseTable, std::string> read_pulse_table(const std::filesystem::path& file,
                                                               const std::string& column);

/// A pulse of the table, located in the rows of the series: from `first` on, and at `end` the current is back at rest.
struct FoundPulse {
  PulseRow told;  // with the series' temperature if the table has none
  std::size_t first = 0;
  std::size_t end = 0;
};

/// In the order of the table; pulses that the table does not have are skipped. A pulse is a stretch of current between
/// rows without; it matches a row of the table if its largest current differs from the row's by at most 3 % and its
/// state of charge before the pulse by at most 0.05 %. Each row of the table must have a pulse after that of the row
/// before; the error names the row without one.
[[nodiscard]] Result<std::vector<FoundPulse>, std::string> find_pulses(const PulseTable& table, const Series& series);

}  // namespace bmu::cell

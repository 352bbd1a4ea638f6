// Resistances from pulses, as test benches tell them, and where in the recorded series each of the pulses is.
//
// A table is CSV, packed with gzip or not; the first line names the columns, others than these are passed over:
//   ref_soc_pct  needed; state of charge before the pulse
//   pulse_A      needed; its current, positive out of the cell
//   a resistance needed, in mOhm: which column is for the user to say
//   temp_C       of the cell before the pulse; without it, what the series says there
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
  std::string name;    // as it was given
  std::string column;  // that the resistances are from
  std::vector<PulseRow> rows;
};

/// The error is one line: file, line, column, what was found and what wanted.
[[nodiscard]] Result<PulseTable, std::string> read_pulse_table(const std::filesystem::path& file,
                                                               const std::string& column);

/// A row of the table in the rows of the series: it begins with `first`, and before `end` the current is back at rest.
struct FoundPulse {
  PulseRow told;  // with the series' temperature if the table has none
  std::size_t first = 0;
  std::size_t end = 0;
};

/// In the order of the table; pulses that the table does not have are passed over. A pulse is a stretch of current
/// between rows without; it is the table's if its largest current is the table's to 3 % and it began within 0.05 % of
/// the table's state of charge. Each row of the table must have one, behind that of the row before; the error says
/// which has none.
[[nodiscard]] Result<std::vector<FoundPulse>, std::string> find_pulses(const PulseTable& table, const Series& series);

}  // namespace bmu::cell

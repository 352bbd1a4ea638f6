#include "tools/bmucell/data/series.hpp"

#include <utility>

#include "tools/bmucell/data/csv_file.hpp"
#include "tools/bmucell/data/median.hpp"

namespace bmu::cell {

namespace {

enum Column : std::size_t { time, current, voltage, temperature, soc, cycle };

/// A row without its time has no position in the series.
const CsvSpec& spec() {
  static const CsvSpec columns{
      .names = {"time_s", "current_A", "voltage_V", "temp_C", "ref_soc_pct", "cycle"},
      .required = 3,
      .never_empty = 1,
      .head = "a first line with time_s, current_A, voltage_V and, if known, temp_C, ref_soc_pct"};
  return columns;
}

}  // namespace

std::string torn_line_text(const Series& series) {
  if (series.torn_line == 0) return "";
  return series.name + ":" + std::to_string(series.torn_line) +
         ": the last line has no line end and may be cut off: it is left out";
}

Result<Series, std::string> read_series(const std::filesystem::path& file) {
  const Result<CsvTable, std::string> csv = read_csv(file, spec());
  if (!csv) return failure(csv.error());
  Series series{.name = file.string(),
                .has_temperature = csv->has_column[temperature],
                .has_soc = csv->has_column[soc],
                .has_cycle = csv->has_column[cycle],
                .torn_line = csv->torn_line};
  series.rows.reserve(csv->row_count());
  constexpr double percent = 0.01;
  for (std::size_t at = 0; at < csv->row_count(); ++at) {
    const auto row = csv->row(at);
    series.rows.push_back(
        {row[time], row[current], row[voltage], row[temperature], row[soc] * percent, row[cycle], csv->lines[at]});
  }
  return series;
}

double gap_of(const Series& series) {
  constexpr double usual_rows = 10.0;
  std::vector<double> steps_s;
  for (std::size_t k = 1; k < series.rows.size(); ++k) {
    const double passed_s = series.rows[k].time_s - series.rows[k - 1].time_s;
    if (passed_s > 0.0) steps_s.push_back(passed_s);
  }
  return usual_rows * median(std::move(steps_s)).value_or(0.0);
}

}  // namespace bmu::cell

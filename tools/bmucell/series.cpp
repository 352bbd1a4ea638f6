#include "tools/bmucell/series.hpp"

#include "tools/bmucell/csv_file.hpp"

namespace bmu::cell {

namespace {

enum Column : std::size_t { time, current, voltage, temperature, soc, cycle, columns_count };

/// Without its time a row has no place among the others.
const CsvWish<columns_count>& wish() {
  static const CsvWish<columns_count> wanted{
      .names = {"time_s", "current_A", "voltage_V", "temp_C", "ref_soc_pct", "cycle"},
      .needed = 3,
      .always = 1,
      .head = "a first line with time_s, current_A, voltage_V and, if known, temp_C, ref_soc_pct"};
  return wanted;
}

}  // namespace

Result<Series, std::string> read_series(const std::filesystem::path& file) {
  const Result<CsvFile<columns_count>, std::string> csv = read_csv(file, wish());
  if (!csv) return failure(csv.error());
  Series series{.name = file.string(),
                .has_temperature = csv->has_column[temperature],
                .has_soc = csv->has_column[soc],
                .has_cycle = csv->has_column[cycle]};
  series.rows.reserve(csv->rows.size());
  constexpr double percent = 0.01;
  for (const auto& row : csv->rows) {
    series.rows.push_back({row[time], row[current], row[voltage], row[temperature], row[soc] * percent, row[cycle]});
  }
  return series;
}

}  // namespace bmu::cell

#include "tools/bmucell/fit_data.hpp"

#include <algorithm>
#include <cmath>

namespace bmu::cell {

namespace {

/// Series nearer to each other share a row.
constexpr double alike_C = 6.0;
constexpr std::size_t rows_min = 10;

void count_charge(Series& series, double capacity_Ah, double begin_soc) {
  constexpr double s_per_h = 3600.0;
  double soc = begin_soc;
  double before_s = series.rows.front().time_s;
  for (SeriesRow& row : series.rows) {
    const double passed_s = std::max(row.time_s - before_s, 0.0);
    before_s = std::max(row.time_s, before_s);
    if (std::isfinite(row.current_A)) soc -= row.current_A * passed_s / (capacity_Ah * s_per_h);
    row.soc = soc;
  }
}

Result<FitSeries, std::string> read_one(const std::string& file, bool is_slow_curve, const FitSource& source) {
  Result<Series, std::string> series = read_series(file);
  if (!series) return failure(series.error());
  if (!series->has_temperature) return failure(file + ": no column 'temp_C'; a fit is nothing without temperatures");
  if (series->rows.size() < rows_min) {
    return failure(file + ": found " + std::to_string(series->rows.size()) + " rows, wanted at least " +
                   std::to_string(rows_min));
  }
  if (!series->has_soc) count_charge(*series, source.capacity_Ah, source.begin_soc);
  return FitSeries{.series = std::move(*series), .is_slow_curve = is_slow_curve};
}

double median_C(const Series& series) {
  std::vector<double> values;
  for (const SeriesRow& row : series.rows) {
    if (std::isfinite(row.temperature_C)) values.push_back(row.temperature_C);
  }
  if (values.empty()) return 25.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

Result<std::vector<FitSeries>, std::string> read_fit_data(const FitSource& source) {
  std::vector<FitSeries> data;
  const auto read_all = [&](const std::vector<std::string>& files, bool is_slow_curve) -> Result<void, std::string> {
    for (const std::string& file : files) {
      Result<FitSeries, std::string> one = read_one(file, is_slow_curve, source);
      if (!one) return failure(one.error());
      data.push_back(std::move(*one));
    }
    return {};
  };
  if (const auto done = read_all(source.slow_files, true); !done) return failure(done.error());
  if (const auto done = read_all(source.files, false); !done) return failure(done.error());
  return data;
}

std::vector<double> temperatures_of(const std::vector<FitSeries>& data) {
  const bool has_others = std::any_of(data.begin(), data.end(), [](const auto& one) { return !one.is_slow_curve; });
  std::vector<double> found;
  for (const FitSeries& one : data) {
    if (!has_others || !one.is_slow_curve) found.push_back(std::round(median_C(one.series)));
  }
  std::sort(found.begin(), found.end());
  std::vector<double> rows;
  for (const double one : found) {
    if (rows.empty() || (one - rows.back() > alike_C && rows.size() < CellDynamics::temperatures_max))
      rows.push_back(one);
  }
  return rows;
}

}  // namespace bmu::cell

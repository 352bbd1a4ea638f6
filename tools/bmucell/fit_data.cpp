#include "tools/bmucell/fit_data.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tools/bmucell/current_steps.hpp"
#include "tools/bmucell/median.hpp"
#include "tools/bmucell/plausible_recording.hpp"

namespace bmu::cell {

namespace {

/// Series nearer to each other share a row.
constexpr double alike_C = 6.0;
constexpr std::size_t rows_min = 10;
constexpr double full_soc = 1.0;

void count_charge(Series& series, double capacity_Ah, double begin_soc) {
  const std::vector<double> out = charge_out(series, capacity_Ah);
  for (std::size_t k = 0; k < out.size(); ++k) series.rows[k].soc = begin_soc - out[k];
}

bool has_temperature(const Series& series) {
  return std::any_of(series.rows.begin(), series.rows.end(),
                     [](const SeriesRow& row) { return std::isfinite(row.temperature_C); });
}

/// What no test of a cell can be; "": nothing. In this order, since each check needs what those before it found right.
std::string problem_of(const Series& series, const FitSource& source) {
  if (!series.has_temperature) return ": no column 'temp_C'; a fit is nothing without temperatures";
  if (series.rows.size() < rows_min) {
    return ": found " + std::to_string(series.rows.size()) + " rows, expected at least " + std::to_string(rows_min);
  }
  std::string problem = implausible_time(series);
  if (problem.empty() && !has_temperature(series)) {
    problem = ": temp_C: found nothing, expected temperatures; a fit is nothing without them";
  }
  if (problem.empty()) problem = implausible_values(series, source.cell);
  if (problem.empty()) problem = implausible_answers(series, source.capacity_Ah);
  if (problem.empty()) problem = implausible_charge(series, source.capacity_Ah, source.begin_soc.value_or(full_soc));
  return problem;
}

Result<FitSeries, std::string> read_one(const std::string& file, bool is_slow_curve, const FitSource& source) {
  Result<Series, std::string> series = read_series(file);
  if (!series) return failure(series.error());
  const std::string problem = problem_of(*series, source);
  if (!problem.empty()) {
    // What is refused may come of what was left out.
    const std::string remark = torn_line_text(*series);
    return failure(file + problem + (remark.empty() ? "" : "; " + remark));
  }
  FitSeries one{.series = std::move(*series), .is_slow_curve = is_slow_curve};
  if (one.series.has_soc) return one;
  if (!source.begin_soc) one.assumed_begin_soc = full_soc;
  count_charge(one.series, source.capacity_Ah, source.begin_soc.value_or(full_soc));
  return one;
}

double median_C(const Series& series) {
  std::vector<double> values;
  for (const SeriesRow& row : series.rows) {
    if (std::isfinite(row.temperature_C)) values.push_back(row.temperature_C);
  }
  constexpr double room_C = 25.0;
  return median(std::move(values)).value_or(room_C);
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

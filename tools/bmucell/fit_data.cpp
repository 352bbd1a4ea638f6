#include "tools/bmucell/fit_data.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>
#include <utility>

#include "tools/bmucell/median.hpp"

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

/// As many digits as a measurement has.
std::string number_text(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.4g", value);
  return text.data();
}

/// "3.1 to 4.2"; nothing measured: "nothing".
std::string range_text(double least, double most) {
  return least <= most ? number_text(least) + " to " + number_text(most) : "nothing";
}

/// A voltage that falls when more flows out of the cell: how often it does, of all steps of the current that are no
/// noise.
double falling_share(const Series& series, double capacity_Ah) {
  const double step_A = 0.2 * capacity_Ah;
  double steps = 0.0;
  double falling = 0.0;
  for (std::size_t k = 1; k < series.rows.size(); ++k) {
    const double by_A = series.rows[k].current_A - series.rows[k - 1].current_A;
    const double by_V = series.rows[k].voltage_V - series.rows[k - 1].voltage_V;
    if (!(std::abs(by_A) >= step_A) || !std::isfinite(by_V) || by_V == 0.0) continue;
    steps += 1.0;
    if ((by_A > 0.0) == (by_V < 0.0)) falling += 1.0;
  }
  return steps > 0.0 ? falling / steps : 1.0;
}

/// What flowed, over what ref_soc_pct says that this moved: the capacity, or nothing where too little moved.
std::optional<double> told_capacity_Ah(const Series& series) {
  constexpr double s_per_h = 3600.0;
  constexpr double enough = 0.3;
  double flowed_As = 0.0;
  double most_soc = -1.0;
  double least_soc = 2.0;
  double at_most_As = 0.0;
  double at_least_As = 0.0;
  for (std::size_t k = 1; k < series.rows.size(); ++k) {
    const SeriesRow& row = series.rows[k];
    const double passed_s = std::max(row.time_s - series.rows[k - 1].time_s, 0.0);
    if (std::isfinite(row.current_A)) flowed_As += row.current_A * passed_s;
    if (row.soc > most_soc) {
      most_soc = row.soc;
      at_most_As = flowed_As;
    }
    if (row.soc < least_soc) {
      least_soc = row.soc;
      at_least_As = flowed_As;
    }
  }
  if (!(most_soc - least_soc >= enough)) return std::nullopt;
  return (at_least_As - at_most_As) / (most_soc - least_soc) / s_per_h;
}

/// What no test of a cell can be; "": nothing.
std::string problem_of(const Series& series, double capacity_Ah) {
  constexpr double least_V = 0.5;
  constexpr double most_V = 6.0;
  constexpr double mostly = 0.5;
  constexpr double capacity_apart = 0.3;
  double low_V = most_V * 1e6;
  double high_V = -low_V;
  bool has_temperature = false;
  for (const SeriesRow& row : series.rows) {
    low_V = std::fmin(low_V, row.voltage_V);
    high_V = std::fmax(high_V, row.voltage_V);
    has_temperature = has_temperature || std::isfinite(row.temperature_C);
  }
  if (!has_temperature) return "temp_C: found nothing, wanted temperatures; a fit is nothing without them";
  if (low_V < least_V || high_V > most_V || !(low_V <= high_V)) {
    return "voltage_V: found " + range_text(low_V, high_V) + ", wanted volts of one cell, 0.5 to 6";
  }
  if (falling_share(series, capacity_Ah) < mostly) {
    return "current_A: the voltage mostly rises when it does, wanted a current that is positive out of the cell";
  }
  const std::optional<double> told_Ah = series.has_soc ? told_capacity_Ah(series) : std::nullopt;
  if (told_Ah && !(std::abs(*told_Ah - capacity_Ah) <= capacity_apart * capacity_Ah)) {
    return "ref_soc_pct: with the current it makes " + number_text(*told_Ah) + " Ah, wanted about " +
           number_text(capacity_Ah) + ", the capacity";
  }
  return "";
}

Result<FitSeries, std::string> read_one(const std::string& file, bool is_slow_curve, const FitSource& source) {
  Result<Series, std::string> series = read_series(file);
  if (!series) return failure(series.error());
  if (!series->has_temperature) return failure(file + ": no column 'temp_C'; a fit is nothing without temperatures");
  if (series->rows.size() < rows_min) {
    return failure(file + ": found " + std::to_string(series->rows.size()) + " rows, wanted at least " +
                   std::to_string(rows_min));
  }
  const std::string problem = problem_of(*series, source.capacity_Ah);
  if (!problem.empty()) return failure(file + ": " + problem);
  if (!series->has_soc) count_charge(*series, source.capacity_Ah, source.begin_soc);
  return FitSeries{.series = std::move(*series), .is_slow_curve = is_slow_curve};
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

#include "tools/bmucell/data/pulse_table.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "tools/bmucell/data/csv_file.hpp"
#include "tools/bmucell/data/score_terms.hpp"

namespace bmu::cell {

namespace {

constexpr double soc_apart_max = 0.0005;
constexpr double current_apart_share = 0.03;
/// Currents below this share of the smallest pulse of a table count as none.
constexpr double rest_share = 0.02;

/// Consecutive rows with current, after a row without.
struct Stretch {
  std::size_t first = 0;
  std::size_t end = 0;
  double most_A = 0.0;  // current with the largest magnitude, with its sign
};

std::vector<Stretch> stretches_of(const Series& series, double rest_A) {
  std::vector<Stretch> stretches;
  const auto flows = [&](std::size_t row) { return std::abs(series.rows[row].current_A) > rest_A; };
  for (std::size_t row = 1; row < series.rows.size(); ++row) {
    if (!flows(row) || flows(row - 1)) continue;
    Stretch stretch{.first = row, .end = row};
    for (; stretch.end < series.rows.size() && flows(stretch.end); ++stretch.end) {
      const double current_A = series.rows[stretch.end].current_A;
      if (std::abs(current_A) > std::abs(stretch.most_A)) stretch.most_A = current_A;
    }
    stretches.push_back(stretch);
  }
  return stretches;
}

std::string missing(const PulseTable& table, const PulseRow& row, const Series& series) {
  std::array<char, 80> text{};
  std::snprintf(text.data(), text.size(), ": has no pulse of %.4g A at %.4g %% of charge, which ", row.current_A,
                row.soc * percent);
  return series.name + text.data() + table.name + " has next";
}

}  // namespace

Result<PulseTable, std::string> read_pulse_table(const std::filesystem::path& file, const std::string& column) {
  const CsvSpec spec{.names = {"ref_soc_pct", "pulse_A", column, "temp_C"},
                     .required = 3,
                     .never_empty = 3,
                     .head = "a first line with ref_soc_pct, pulse_A, " + column + " and, if known, temp_C"};
  const Result<CsvTable, std::string> csv = read_whole_csv(file, spec);
  if (!csv) return failure(csv.error());
  PulseTable table{.name = file.string(), .column = column};
  for (std::size_t at = 0; at < csv->row_count(); ++at) {
    const auto row = csv->row(at);
    const double soc_pct = row[0];
    const double current_A = row[1];
    const double resistance_mOhm = row[2];
    const double temperature_C = row[3];
    if (!(resistance_mOhm > 0.0) || current_A == 0.0) {
      return failure(table.name + ": found a pulse of " + std::to_string(current_A) + " A with " +
                     std::to_string(resistance_mOhm) + " mOhm, expected a current and a resistance above 0");
    }
    table.rows.push_back(
        {soc_pct / percent, current_A, resistance_mOhm * 1e-3, csv->has_column[3] ? temperature_C : std::nan("")});
  }
  return table;
}

Result<std::vector<FoundPulse>, std::string> find_pulses(const PulseTable& table, const Series& series) {
  if (!series.has_soc) return failure(series.name + ": no column 'ref_soc_pct', which says what the charge really was");
  double least_A = std::abs(table.rows.front().current_A);
  for (const PulseRow& row : table.rows) least_A = std::min(least_A, std::abs(row.current_A));
  const std::vector<Stretch> stretches = stretches_of(series, least_A * rest_share);
  auto next = stretches.begin();
  std::vector<FoundPulse> found;
  for (const PulseRow& row : table.rows) {
    next = std::find_if(next, stretches.end(), [&](const Stretch& stretch) {
      const double soc = series.rows[stretch.first - 1].soc;
      return std::abs(soc - row.soc) <= soc_apart_max &&
             std::abs(stretch.most_A - row.current_A) <= current_apart_share * std::abs(row.current_A);
    });
    if (next == stretches.end()) return failure(missing(table, row, series));
    FoundPulse pulse{.told = row, .first = next->first, .end = next->end};
    if (std::isnan(row.temperature_C)) pulse.told.temperature_C = series.rows[next->first - 1].temperature_C;
    found.push_back(pulse);
    ++next;
  }
  return found;
}

}  // namespace bmu::cell

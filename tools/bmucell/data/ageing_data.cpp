#include "tools/bmucell/data/ageing_data.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string_view>
#include <utility>

#include "tools/bmucell/data/csv_file.hpp"
#include "tools/bmucell/data/plausible_recording.hpp"

namespace bmu::cell {

namespace {

constexpr double hour_s = 3600.0;

enum Column : std::size_t { cycle, capacity, charge };

const CsvSpec& spec() {
  static const CsvSpec columns{.names = {"cycle", "capacity_Ah", "charges_before"},
                               .required = 3,
                               .never_empty = 3,
                               .head = "a first line with cycle, capacity_Ah and charges_before"};
  return columns;
}

std::string shown(double number) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.10g", number);
  return text.data();
}

Result<std::vector<CapacityTest>, std::string> read_tests(const std::filesystem::path& file) {
  const Result<CsvTable, std::string> table = read_whole_csv(file, spec());
  if (!table) return failure(table.error());
  std::vector<CapacityTest> tests;
  for (std::size_t test = 0; test < table->row_count(); ++test) {
    const auto row = table->row(test);
    const std::string at = file.string() + ":" + std::to_string(table->lines[test]) + ": ";
    if (!(row[capacity] > 0.0)) {
      return failure(at + "capacity_Ah: found '" + shown(row[capacity]) + "', expected a number above 0");
    }
    if (!tests.empty() && row[charge] < tests.back().charge_number) {
      return failure(at + "charges_before: found '" + shown(row[charge]) + "' behind '" +
                     shown(tests.back().charge_number) + "', expected numbers that do not fall");
    }
    const bool has_own_charge = tests.empty() || row[charge] > tests.back().charge_number;
    tests.push_back({row[cycle], row[capacity] * hour_s, row[charge], has_own_charge});
  }
  return tests;
}

CellSample sample_of(const SeriesRow& row, double passed_s) {
  return {.passed_s = passed_s,
          .mean_current_A = row.current_A,
          .current_A = row.current_A,
          .voltage_V = row.voltage_V,
          .temperature_C = row.temperature_C};
}

bool is_below(const Charge& charge, double number) {
  return charge.number < number;
}

double charged_As(const CellSample& sample) {
  const bool is_counted = sample.has_passed() && is_measured(sample.mean_current_A);
  return is_counted ? -sample.mean_current_A * sample.passed_s : 0.0;
}

}  // namespace

const Charge& AgeingData::charge_before(const CapacityTest& test) const {
  return *std::lower_bound(charges.begin(), charges.end(), test.charge_number, is_below);
}

Result<std::vector<Charge>, std::string> charges_of(const Series& series) {
  if (!series.has_cycle) return failure(series.name + ": no column 'cycle', the number of the charge");
  if (!series.has_temperature) return failure(series.name + ": no column 'temp_C'");
  std::vector<Charge> charges;
  double before_s = 0.0;
  for (const SeriesRow& row : series.rows) {
    const bool is_new = charges.empty() || row.cycle != charges.back().number;
    if (std::isnan(row.cycle) || (is_new && !charges.empty() && row.cycle < charges.back().number)) {
      return failure(series.name + ": cycle: found '" + shown(row.cycle) + "' at " + shown(row.time_s) +
                     " s, expected rising numbers, with the rows of each charge together");
    }
    if (is_new) {
      charges.push_back({.number = row.cycle});
      before_s = 0.0;
    }
    charges.back().samples.push_back(sample_of(row, row.time_s - before_s));
    before_s = std::max(before_s, row.time_s);
  }
  return charges;
}

Result<AgeingData, std::string> read_ageing(const std::filesystem::path& recording,
                                            const std::filesystem::path& table) {
  const Result<Series, std::string> series = read_series(recording);
  if (!series) return failure(series.error());
  // The charge that such a line belongs to is unknown.
  if (series->torn_line != 0) {
    return failure(series->name + ":" + std::to_string(series->torn_line) +
                   ": found a last line without a line end, which may be cut off; expected one if the line is whole");
  }
  Result<std::vector<Charge>, std::string> charges = charges_of(*series);
  if (!charges) return failure(charges.error());
  for (const std::string& problem :
       {implausible_time_in_cycles(*series), implausible_values(*series), implausible_charging(*series)}) {
    if (!problem.empty()) return failure(series->name + problem);
  }
  Result<std::vector<CapacityTest>, std::string> tests = read_tests(table);
  if (!tests) return failure(tests.error());
  const auto is_there = [&charges](const CapacityTest& test) {
    const auto found = std::lower_bound(charges->begin(), charges->end(), test.charge_number, is_below);
    return found != charges->end() && found->number == test.charge_number;
  };
  const auto lost = std::find_if_not(tests->begin(), tests->end(), is_there);
  if (lost != tests->end()) {
    return failure(table.string() + ": charges_before: found '" + shown(lost->charge_number) +
                   "', expected a cycle of " + recording.string());
  }
  return AgeingData{.name = recording.string(), .charges = std::move(*charges), .tests = std::move(*tests)};
}

Charge plugged_in(const Charge& charge, double capacity_As, const PluggedIn& when) {
  double missing_As = 0.0;  // at the start of each sample
  for (const CellSample& sample : charge.samples) missing_As += charged_As(sample);
  auto first = charge.samples.begin();
  for (; first != charge.samples.end(); ++first) {
    missing_As -= charged_As(*first);
    if (1.0 - missing_As / capacity_As >= when.from_soc && first->voltage_V >= when.from_voltage_V) break;
  }
  return {.number = charge.number, .samples = {first, charge.samples.end()}};
}

}  // namespace bmu::cell

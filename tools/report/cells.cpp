// The chart of the cell voltages over time.
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>

#include "tools/report/chart.hpp"
#include "tools/report/page.hpp"

namespace bmu::report {

namespace {

constexpr std::size_t outliers_max = 4;
/// A cell is an outlier if its mean deviation from the median exceeds both this and that multiple of the usual
/// deviation.
constexpr double deviation_told_V = 0.010;
constexpr double deviation_told_times = 4.0;

/// Mean distance from the median over all columns in which both are known; 0 if there are none.
double deviation_of(const Series& cell, const std::vector<float>& median) {
  double sum = 0.0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < std::min(cell.size(), median.size()); ++i) {
    if (std::isnan(cell.mean[i]) || std::isnan(median[i])) continue;
    sum += std::fabs(static_cast<double>(cell.mean[i] - median[i]));
    ++count;
  }
  return count == 0 ? 0.0 : sum / static_cast<double>(count);
}

std::optional<std::size_t> extreme_cell(const std::vector<Series>& cells, bool wants_high) {
  std::optional<std::size_t> found;
  float extreme = not_known;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    for (const float value : wants_high ? cells[i].high : cells[i].low) {
      if (std::isnan(value)) continue;
      if (found && (wants_high ? value <= extreme : value >= extreme)) continue;
      extreme = value;
      found = i;
    }
  }
  return found;
}

void add_once(std::vector<std::size_t>& list, std::size_t cell) {
  if (list.size() < outliers_max && std::find(list.begin(), list.end(), cell) == list.end()) list.push_back(cell);
}

}  // namespace

std::vector<std::size_t> outliers_of(const std::vector<Series>& reduced) {
  std::vector<std::size_t> outliers;
  for (const bool wants_high : {false, true}) {
    if (const auto cell = extreme_cell(reduced, wants_high)) add_once(outliers, *cell);
  }
  const std::vector<float> median = quantile(reduced, 0.5);
  std::vector<double> deviations;
  deviations.reserve(reduced.size());
  for (const Series& one : reduced) deviations.push_back(deviation_of(one, median));
  std::vector<std::size_t> order(reduced.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](auto a, auto b) { return deviations[a] > deviations[b]; });
  if (order.empty()) return outliers;
  const double usual = deviations[order[order.size() / 2]];
  for (const std::size_t cell : order) {
    if (deviations[cell] > std::max(deviation_told_V, deviation_told_times * usual)) add_once(outliers, cell);
  }
  return outliers;
}

std::string voltages_html(const ReportData& data, const Columns& columns) {
  std::vector<Series> cells;
  cells.reserve(data.cells.size());
  for (const CellReport& cell : data.cells) cells.push_back(reduced(cell.voltage_V, columns));
  Plot plot{.title = "Cell voltages", .description = {}, .unit = "V", .bands = {}, .lines = {}};
  plot.range_min = 0.02;
  plot.decimals_of_values = 4;
  plot.description = "all " + std::to_string(cells.size()) +
                     " cells over time, as a band from the lowest to the highest and, within it, one that holds eight "
                     "in ten cells; cells unlike the others as lines of their own:";
  constexpr std::array inks{Ink::second, Ink::third, Ink::fourth, Ink::fifth};
  for (const std::size_t cell : outliers_of(cells)) {
    const std::string name = "cell " + data.cells[cell].name;
    plot.lines.push_back(
        {.name = name, .ink = inks[plot.lines.size() % inks.size()], .values = cells[cell], .with_extremes = true});
    svg::append(plot.description, {" ", name});
  }
  Series median;
  for (const float value : quantile(cells, 0.5)) median.add(value);
  plot.lines.insert(plot.lines.begin(),
                    {.name = "median", .ink = Ink::main, .values = std::move(median), .with_extremes = false});
  plot.bands = {{.name = "lowest to highest", .ink = Ink::main, .low = quantile(cells, 0), .high = quantile(cells, 1)},
                {.name = "eight in ten cells",
                 .ink = Ink::main,
                 .low = quantile(cells, 0.1),
                 .high = quantile(cells, 0.9),
                 .is_strong = true}};
  return chart_html(plot, columns);
}

}  // namespace bmu::report

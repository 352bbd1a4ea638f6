// The cells: their voltages over time, and what is known of each at the end.
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>

#include "tools/report/report_chart.hpp"
#include "tools/report/report_page.hpp"

namespace bmu::report {

namespace {

using svg::escaped;
using svg::number;

constexpr std::size_t outliers_max = 4;
/// Further from the median than this, a cell is none of the others; or than so many times what is usual among them.
constexpr double deviation_told_V = 0.010;
constexpr double deviation_told_times = 4.0;

/// Mean distance from the median over all columns where both are known; 0 if there are none.
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

// --- figures at the end ---------------------------------------------------------------------------------------------

/// Where the cells of a module end, and its number.
std::string module_grid(const ReportData& data) {
  std::string out;
  const auto count = static_cast<double>(data.cells.size());
  for (std::size_t i = 1; i < data.cells.size(); ++i) {
    if (data.cells[i].module == data.cells[i - 1].module) continue;
    const std::string x = number(static_cast<double>(i) / count * plot_size);
    out += "<line class=\"grid\" x1=\"" + x + "\" y1=\"0\" x2=\"" + x + "\" y2=\"1000\"/>";
  }
  return out;
}

std::string module_axis(const ReportData& data) {
  std::string out = "<div class=\"times\" aria-hidden=\"true\">";
  const auto count = static_cast<double>(data.cells.size());
  bool is_odd = false;
  for (std::size_t first = 0; first < data.cells.size();) {
    std::size_t last = first + 1;
    while (last < data.cells.size() && data.cells[last].module == data.cells[first].module) ++last;
    is_odd = !is_odd;
    const double middle = static_cast<double>(first + last) / 2 / count * 100;
    out += "<span class=\"x" + std::string(is_odd ? "" : " wide") + "\" style=\"left:" + number(middle, 2) + "%\">" +
           (count > 200 ? "" : "module ") + std::to_string(data.cells[first].module) + "</span>";
    first = last;
  }
  return out + "</div>\n";
}

struct CellPlot {
  std::string title;
  std::string unit;
  std::string description;
  bool from_zero = false;
};

/// A mark for each cell at its value, with its doubt, or a bar from zero.
std::string cell_plot_html(const CellPlot& plot, const std::vector<Figure>& figures, const ReportData& data) {
  svg::Range range;
  for (const Figure& figure : figures) {
    const auto value = static_cast<double>(figure.value);
    const double doubt = std::isnan(figure.doubt) ? 0.0 : static_cast<double>(figure.doubt);
    range.take(value - doubt);
    range.take(value + doubt);
  }
  if (range.is_empty()) return "";
  if (plot.from_zero && range.low == 0.0 && range.high == 0.0) {
    return "<section><h2>" + escaped(plot.title) + "</h2>\n<p class=\"nothing\">Nothing, of no cell.</p></section>\n";
  }
  if (plot.from_zero) range.take(0.0);
  range.widen();
  const double room = (range.high - range.low) * 0.06;
  range = {plot.from_zero ? range.low : range.low - room, range.high + room};
  const double step = svg::tick_step(range, 4.0);
  const auto y_of = [&](double value) { return (range.high - value) / (range.high - range.low) * plot_size; };

  std::string grid;
  std::string texts;
  for (const double value : svg::ticks_of(range, step)) {
    const std::string y = number(y_of(value));
    grid += "<line class=\"grid\" x1=\"0\" y1=\"" + y + "\" x2=\"1000\" y2=\"" + y + "\"/>";
    texts += "<span class=\"y\" style=\"top:" + number(y_of(value) / 10, 2) + "%\">" +
             number(value, svg::digits_for(step)) + "</span>";
  }
  std::string marks;
  const double width = plot_size / static_cast<double>(figures.size());
  for (std::size_t i = 0; i < figures.size(); ++i) {
    const auto value = static_cast<double>(figures[i].value);
    if (std::isnan(value)) continue;
    const std::string x = number((static_cast<double>(i) + 0.5) * width);
    const std::string y = number(y_of(value));
    const std::string title =
        "<title>cell " + escaped(data.cells[i].name) + ": " + number(value, 3) + " " + escaped(plot.unit) + "</title>";
    if (plot.from_zero) {
      marks += "<rect class=\"amount\" x=\"" + number((static_cast<double>(i) + 0.15) * width) + "\" width=\"" +
               number(width * 0.7) + "\" y=\"" + y + "\" height=\"" + number(y_of(0.0) - y_of(value)) + "\">" + title +
               "</rect>\n";
      continue;
    }
    const auto doubt = static_cast<double>(figures[i].doubt);
    if (!std::isnan(doubt)) {
      marks += "<line class=\"doubt\" x1=\"" + x + "\" x2=\"" + x + "\" y1=\"" + number(y_of(value - doubt)) +
               "\" y2=\"" + number(y_of(value + doubt)) + "\"/>";
    }
    marks += "<line class=\"dot\" x1=\"" + x + "\" x2=\"" + x + "\" y1=\"" + y + "\" y2=\"" + y + "\">" + title +
             "</line>\n";
  }
  return "<section><h2>" + escaped(plot.title) + " <span class=\"unit\">" + escaped(plot.unit) +
         "</span></h2>\n<p class=\"note\">" + escaped(plot.description) + "</p>\n<figure class=\"plot low\">" + texts +
         "<svg viewBox=\"0 0 1000 1000\" preserveAspectRatio=\"none\" role=\"img\" aria-label=\"" +
         escaped(plot.title + ": " + plot.description) + " The same numbers stand in the table of the cells.\">\n" +
         grid + module_grid(data) + marks + "</svg></figure>\n" + module_axis(data) + "</section>\n";
}

std::vector<Figure> figures_of(const ReportData& data, Figure (*of)(const CellReport&)) {
  std::vector<Figure> figures;
  for (const CellReport& cell : data.cells) figures.push_back(of(cell));
  return figures;
}

std::string cell_text(float value, int digits) {
  return "<td class=\"n\">" + (std::isnan(value) ? "–" : number(static_cast<double>(value), digits)) + "</td>";
}

float extreme_of(const std::vector<float>& values, bool wants_high) {
  float extreme = not_known;
  for (const float value : values) {
    if (std::isnan(value) || (!std::isnan(extreme) && (wants_high ? value <= extreme : value >= extreme))) continue;
    extreme = value;
  }
  return extreme;
}

std::string table_html(const ReportData& data) {
  std::string out =
      "<section class=\"long\"><details><summary>All cells in numbers</summary><div class=\"scroll\"><table>\n<tr>"
      "<th>Cell</th><th class=\"n\">No.</th><th class=\"n\">Lowest V</th><th class=\"n\">Highest V</th>"
      "<th class=\"n\">Charge %</th><th class=\"n\">Resistance mΩ</th><th class=\"n\">± mΩ</th>"
      "<th class=\"n\">Capacity left %</th><th class=\"n\">Bled Ah</th></tr>\n";
  for (const CellReport& cell : data.cells) {
    out += "<tr><td>" + escaped(cell.name) + "</td><td class=\"n\">" + std::to_string(cell.pack_number) + "</td>" +
           cell_text(extreme_of(cell.voltage_V.low, false), 4) + cell_text(extreme_of(cell.voltage_V.high, true), 4) +
           cell_text(cell.soc_percent.value, 1) + cell_text(cell.resistance_mOhm.value, 2) +
           cell_text(cell.resistance_mOhm.doubt, 2) + cell_text(cell.health_percent.value, 1) +
           cell_text(cell.bled_Ah, 4) + "</tr>\n";
  }
  return out + "</table></div></details></section>\n";
}

}  // namespace

std::vector<std::size_t> outliers_of(const std::vector<Series>& reduced) {
  std::vector<std::size_t> outliers;
  for (const bool wants_high : {false, true}) {
    if (const auto cell = extreme_cell(reduced, wants_high)) add_once(outliers, *cell);
  }
  const std::vector<float> median = quantile(reduced, 0.5);
  std::vector<double> deviations;
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
    plot.description += " " + name;
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

std::string cell_figures_html(const ReportData& data) {
  std::string out;
  out += cell_plot_html({.title = "Resistance of each cell",
                         .unit = "mΩ",
                         .description = "At the end; the line is within what the truth lies in 95 of 100 cases."},
                        figures_of(data, [](const CellReport& cell) { return cell.resistance_mOhm; }), data);
  out += cell_plot_html({.title = "Charge of each cell",
                         .unit = "%",
                         .description = "At the end; the line is within what the truth lies in 95 of 100 cases."},
                        figures_of(data, [](const CellReport& cell) { return cell.soc_percent; }), data);
  out += cell_plot_html({.title = "Bled by balancing",
                         .unit = "Ah",
                         .description = "What balancing has taken from each cell, to bring it down to the others.",
                         .from_zero = true},
                        figures_of(data, [](const CellReport& cell) { return Figure{.value = cell.bled_Ah}; }), data);
  return out + (data.cells.empty() ? "" : table_html(data));
}

}  // namespace bmu::report

// The state of each cell at the end: a mark for each at its position in the pack, and all values in a table.
#include <cmath>

#include "tools/report/chart.hpp"
#include "tools/report/page.hpp"

namespace bmu::report {

namespace {

using svg::append;
using svg::escaped;
using svg::number;

/// With more modules only their numbers are shown below the chart.
constexpr std::size_t modules_named_max = 4;

// --- the place of a cell --------------------------------------------------------------------------------------------

/// Cells of one module: the first, and one past the last.
struct ModuleCells {
  std::size_t first = 0;
  std::size_t last = 0;
};

std::vector<ModuleCells> modules_of(const ReportData& data) {
  std::vector<ModuleCells> modules;
  for (std::size_t i = 0; i < data.cells.size(); ++i) {
    if (i == 0 || data.cells[i].module != data.cells[i - 1].module) modules.push_back({i, i});
    modules.back().last = i + 1;
  }
  return modules;
}

std::string module_grid(const ReportData& data) {
  std::string out;
  const auto count = static_cast<double>(data.cells.size());
  for (const ModuleCells& module : modules_of(data)) {
    if (module.first == 0) continue;
    const std::string x = number(static_cast<double>(module.first) / count * plot_size);
    append(out, {"<line class=\"grid\" x1=\"", x, "\" y1=\"0\" x2=\"", x, "\" y2=\"1000\"/>"});
  }
  return out;
}

std::string module_axis(const ReportData& data) {
  std::string out = "<div class=\"times\" aria-hidden=\"true\">";
  const auto count = static_cast<double>(data.cells.size());
  const std::vector<ModuleCells> modules = modules_of(data);
  bool is_odd = false;
  for (const ModuleCells& module : modules) {
    is_odd = !is_odd;
    const double middle = static_cast<double>(module.first + module.last) / 2 / count * 100;
    append(out, {"<span class=\"x", is_odd ? "" : " wide", "\" style=\"left:", number(middle, 2), "%\">",
                 modules.size() > modules_named_max ? "" : "module ", std::to_string(data.cells[module.first].module),
                 "</span>"});
  }
  return out + "</div>\n";
}

// --- a chart --------------------------------------------------------------------------------------------------------

struct CellPlot {
  std::string title;
  std::string unit;
  std::string description;
  bool from_zero = false;  // bars; else marks with their uncertainty
};

class CellDrawing {
 public:
  CellDrawing(const CellPlot& plot, const std::vector<Figure>& figures, const ReportData& data)
      : plot_(plot), figures_(figures), data_(data), width_(plot_size / static_cast<double>(figures.size())) {
    for (const Figure& figure : figures) {
      const auto value = static_cast<double>(figure.value);
      const double doubt = std::isnan(figure.doubt) ? 0.0 : static_cast<double>(figure.doubt);
      range_.take(value - doubt);
      range_.take(value + doubt);
    }
  }

  std::string html() {
    if (range_.is_empty()) return "";
    const std::string heading = "<section><h2>" + escaped(plot_.title);
    if (plot_.from_zero && range_.low == 0.0 && range_.high == 0.0) {
      return heading + "</h2>\n<p class=\"nothing\">Nothing, of no cell.</p></section>\n";
    }
    if (plot_.from_zero) range_.take(0.0);
    range_.widen();
    const double room = (range_.high - range_.low) * 0.06;
    range_ = {plot_.from_zero ? range_.low : range_.low - room, range_.high + room};
    axis();
    marks();
    return heading + " <span class=\"unit\">" + escaped(plot_.unit) + "</span></h2>\n<p class=\"note\">" +
           escaped(plot_.description) + "</p>\n<figure class=\"plot low\">" + texts_ +
           "<svg viewBox=\"0 0 1000 1000\" preserveAspectRatio=\"none\" role=\"img\" aria-label=\"" +
           escaped(plot_.title + ": " + plot_.description) + " The same numbers stand in the table of the cells.\">\n" +
           svg_ + "</svg></figure>\n" + module_axis(data_) + "</section>\n";
  }

 private:
  [[nodiscard]] double y_of(double value) const {
    return (range_.high - value) / (range_.high - range_.low) * plot_size;
  }

  void axis() {
    const double step = svg::tick_step(range_, 5.0);
    for (const double value : svg::ticks_of(range_, step)) {
      const std::string y = number(y_of(value));
      append(svg_, {"<line class=\"grid\" x1=\"0\" y1=\"", y, "\" x2=\"1000\" y2=\"", y, "\"/>"});
      append(texts_, {"<span class=\"y\" style=\"top:", number(y_of(value) / 10, 2), "%\">",
                      number(value, svg::digits_for(step)), "</span>"});
    }
    svg_ += module_grid(data_);
  }

  void marks() {
    for (std::size_t i = 0; i < figures_.size(); ++i) {
      if (std::isnan(figures_[i].value)) continue;
      if (plot_.from_zero) {
        bar(i);
      } else {
        dot(i);
      }
    }
  }

  [[nodiscard]] std::string title(std::size_t cell) const {
    return "<title>cell " + escaped(data_.cells[cell].name) + ": " +
           number(static_cast<double>(figures_[cell].value), 3) + " " + escaped(plot_.unit) + "</title>";
  }

  void bar(std::size_t cell) {
    const double y = y_of(static_cast<double>(figures_[cell].value));
    append(svg_, {"<rect class=\"amount\" x=\"", number((static_cast<double>(cell) + 0.15) * width_), "\" width=\"",
                  number(width_ * 0.7), "\" y=\"", number(y), "\" height=\"", number(y_of(0.0) - y), "\">", title(cell),
                  "</rect>\n"});
  }

  void dot(std::size_t cell) {
    const std::string x = number((static_cast<double>(cell) + 0.5) * width_);
    const auto value = static_cast<double>(figures_[cell].value);
    const auto doubt = static_cast<double>(figures_[cell].doubt);
    if (!std::isnan(doubt)) {
      append(svg_, {"<line class=\"doubt\" x1=\"", x, "\" x2=\"", x, "\" y1=\"", number(y_of(value - doubt)),
                    "\" y2=\"", number(y_of(value + doubt)), "\"/>"});
    }
    const std::string y = number(y_of(value));
    append(svg_, {"<line class=\"dot\" x1=\"", x, "\" x2=\"", x, "\" y1=\"", y, "\" y2=\"", y, "\">", title(cell),
                  "</line>\n"});
  }

  const CellPlot& plot_;
  const std::vector<Figure>& figures_;
  const ReportData& data_;
  double width_;
  svg::Range range_;
  std::string svg_;
  std::string texts_;
};

std::string cell_plot_html(const CellPlot& plot, const std::vector<Figure>& figures, const ReportData& data) {
  return CellDrawing(plot, figures, data).html();
}

std::vector<Figure> figures_of(const ReportData& data, Figure (*of)(const CellReport&)) {
  std::vector<Figure> figures;
  figures.reserve(data.cells.size());
  for (const CellReport& cell : data.cells) figures.push_back(of(cell));
  return figures;
}

// --- the table ------------------------------------------------------------------------------------------------------

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
    append(out, {"<tr><td>", escaped(cell.name), "</td><td class=\"n\">", std::to_string(cell.pack_number), "</td>",
                 cell_text(extreme_of(cell.voltage_V.low, false), 4),
                 cell_text(extreme_of(cell.voltage_V.high, true), 4), cell_text(cell.soc_percent.value, 1),
                 cell_text(cell.resistance_mOhm.value, 2), cell_text(cell.resistance_mOhm.doubt, 2),
                 cell_text(cell.health_percent.value, 1), cell_text(cell.bled_Ah, 4), "</tr>\n"});
  }
  return out + "</table></div></details></section>\n";
}

}  // namespace

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

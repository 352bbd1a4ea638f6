// One chart of a report: bands and lines over time, with axes. The plot itself is SVG that is stretched to the
// available width, the texts around it are HTML of one size on a telephone and on paper.
//
// In the SVG x and y go from 0 to 1000; y from the top.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "tools/common/svg_text.hpp"
#include "tools/report/columns.hpp"

namespace bmu::report {

inline constexpr double plot_size = 1000.0;

/// Names of style classes: colours that readers with red-green colour blindness can distinguish too, on white and on
/// black; lines also differ in their dashes.
enum class Ink : std::uint8_t { main, second, third, fourth, fifth, faint };
[[nodiscard]] std::string_view class_of(Ink ink);

struct PlotLine {
  std::string name;
  Ink ink = Ink::main;
  Series values;              // of the columns
  bool with_extremes = true;  // draws the lowest and highest value of each column
};

/// The area between two lines.
struct PlotBand {
  std::string name;
  Ink ink = Ink::main;
  std::vector<float> low;
  std::vector<float> high;
  bool is_strong = false;  // inside another one
};

struct Plot {
  std::string title;        // heading, in plain words
  std::string description;  // alternative text
  std::string unit;         // "V"
  std::vector<PlotBand> bands;
  std::vector<PlotLine> lines;
  double range_min = 0.0;  // minimum range of the y axis
  bool has_zero_line = false;
  int decimals_of_values = 3;  // in the read-out
};

/// Position of a time on the x axis of all charts.
[[nodiscard]] double x_of(const Columns& columns, std::int64_t at_us);
/// "x,y": position of a value.
[[nodiscard]] std::string point_text(double x, double value, const svg::Range& range);

/// Lines and bands with axes and a legend. Empty if all values are unknown.
[[nodiscard]] std::string chart_html(const Plot& plot, const Columns& columns);

/// The texts of the time axis below a plot.
[[nodiscard]] std::string time_axis_html(const Columns& columns);
/// Gaps, and lines at the times with texts, for the inside of a plot's SVG.
[[nodiscard]] std::string time_grid_svg(const Columns& columns);

struct LegendEntry {
  std::string name;
  std::string classes;  // of its swatch
};
[[nodiscard]] std::string legend_html(const std::vector<LegendEntry>& entries);

}  // namespace bmu::report

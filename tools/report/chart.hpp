// One picture of a report: bands and lines over time, with axes. The plot itself is SVG that is stretched to whatever
// width there is, the texts around it are HTML of one size on a telephone and on paper.
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

/// Names of style classes: colours that are told apart also by those who see red and green alike, on white and on
/// black; lines in them differ in their dashes, too.
enum class Ink : std::uint8_t { main, second, third, fourth, fifth, faint };
[[nodiscard]] std::string_view class_of(Ink ink);

struct PlotLine {
  std::string name;
  Ink ink = Ink::main;
  Series values;              // of the columns
  bool with_extremes = true;  // goes through the lowest and highest of each column
};

/// The area between two lines.
struct PlotBand {
  std::string name;
  Ink ink = Ink::main;
  std::vector<float> low;
  std::vector<float> high;
  bool is_strong = false;  // within another one
};

struct Plot {
  std::string title;        // heading, in plain words
  std::string description;  // for who does not see it
  std::string unit;         // "V"
  std::vector<PlotBand> bands;
  std::vector<PlotLine> lines;
  double range_min = 0.0;  // of the y axis, at least
  bool has_zero_line = false;
  int decimals_of_values = 3;  // of the read-out
};

/// Where a time is on the x axis of all pictures.
[[nodiscard]] double x_of(const Columns& columns, std::int64_t at_us);
/// "x,y": where a value stands.
[[nodiscard]] std::string point_text(double x, double value, const svg::Range& range);

/// Lines and bands with axes and a legend. Nothing if nothing of it is known.
[[nodiscard]] std::string chart_html(const Plot& plot, const Columns& columns);

/// The texts of the time axis, as below a plot.
[[nodiscard]] std::string time_axis_html(const Columns& columns);
/// Holes, and lines at the times that have texts, for the inside of a plot's SVG.
[[nodiscard]] std::string time_grid_svg(const Columns& columns);

struct LegendEntry {
  std::string name;
  std::string classes;  // of its swatch
};
[[nodiscard]] std::string legend_html(const std::vector<LegendEntry>& entries);

}  // namespace bmu::report

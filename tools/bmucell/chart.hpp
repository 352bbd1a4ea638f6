// Charts as SVG text that any browser shows: panels with axes, lines and bands.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace bmu::cell {

struct ChartPoint {
  double x = 0.0;
  double y = 0.0;
};

struct ChartLine {
  std::string label;  // empty: not in the legend
  std::vector<ChartPoint> points{};
  std::string color = "#1f6feb";
};

/// The area between two lines over the same x.
struct ChartBand {
  std::string label;
  std::vector<ChartPoint> low{};
  std::vector<ChartPoint> high{};
  std::string color = "#1f6feb";
};

struct ChartPanel {
  std::string title;
  std::string x_label;
  std::string y_label;
  std::vector<ChartBand> bands{};
  std::vector<ChartLine> lines{};
  std::optional<std::pair<double, double>> y_range{};  // default: the range of the points
};

/// Colours that readers with red-green colour blindness can distinguish too, from cold to warm.
[[nodiscard]] std::string chart_color(std::size_t index, std::size_t count);

/// Panels below each other, all of one size. Points that are not finite are gaps. Long lines are thinned to the
/// resolution of a screen; their peaks are kept.
[[nodiscard]] std::string svg_of(const std::string& title, const std::vector<ChartPanel>& panels);

}  // namespace bmu::cell

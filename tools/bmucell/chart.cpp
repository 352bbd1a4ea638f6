#include "tools/bmucell/chart.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "tools/common/svg_text.hpp"

namespace bmu::cell {

namespace {

using svg::digits_for;
using svg::escaped;
using svg::number;
using svg::Range;
using svg::tick_step;
using svg::ticks_of;

constexpr double width = 960.0;
constexpr double panel_height = 300.0;
constexpr double left = 70.0;
constexpr double right = 20.0;
constexpr double top = 34.0;
constexpr double bottom = 46.0;
constexpr double title_height = 34.0;
constexpr std::size_t points_shown = 600;

/// Keeps the lowest and the highest point of each stretch, in their order.
std::vector<ChartPoint> thinned(const std::vector<ChartPoint>& points) {
  if (points.size() <= points_shown) return points;
  const std::size_t stretch = 2 * points.size() / points_shown + 1;
  std::vector<ChartPoint> result;
  for (std::size_t from = 0; from < points.size(); from += stretch) {
    const auto begin = points.begin() + static_cast<std::ptrdiff_t>(from);
    const auto end = points.begin() + static_cast<std::ptrdiff_t>(std::min(from + stretch, points.size()));
    auto [low, high] = std::minmax_element(begin, end, [](const auto& a, const auto& b) { return a.y < b.y; });
    if (high < low) std::swap(low, high);
    result.push_back(*low);
    if (high != low) result.push_back(*high);
  }
  return result;
}

class PanelDrawing {
 public:
  PanelDrawing(const ChartPanel& panel, double y) : panel_(panel), y_(y) {
    const auto take = [this](const std::vector<ChartPoint>& points) {
      for (const ChartPoint& point : points) {
        x_range_.take(point.x);
        y_range_.take(point.y);
      }
    };
    for (const ChartLine& line : panel.lines) take(line.points);
    for (const ChartBand& band : panel.bands) {
      take(band.low);
      take(band.high);
    }
    if (panel.y_range) y_range_ = {panel.y_range->first, panel.y_range->second};
    x_range_.widen();
    y_range_.widen();
  }

  std::string text() {
    axes();
    for (const ChartBand& band : panel_.bands) draw(band);
    for (const ChartLine& line : panel_.lines) draw(line);
    legend();
    return std::move(out_);
  }

 private:
  [[nodiscard]] double at_x(double x) const {
    return left + (x - x_range_.low) / (x_range_.high - x_range_.low) * (width - left - right);
  }
  [[nodiscard]] double at_y(double y) const {
    const double share = std::clamp((y - y_range_.low) / (y_range_.high - y_range_.low), -0.02, 1.02);
    return y_ + panel_height - bottom - share * (panel_height - top - bottom);
  }
  [[nodiscard]] std::string at_text(const ChartPoint& point) const {
    return number(at_x(point.x)) + "," + number(at_y(point.y)) + " ";
  }
  void write(double x, double y, const std::string& what, const std::string& how) {
    out_ += "<text x=\"" + number(x) + "\" y=\"" + number(y) + "\" " + how + ">" + escaped(what) + "</text>\n";
  }
  void rule(double x1, double y1, double x2, double y2) {
    out_ += "<line x1=\"" + number(x1) + "\" y1=\"" + number(y1) + "\" x2=\"" + number(x2) + "\" y2=\"" + number(y2) +
            "\" stroke=\"#d0d7de\"/>\n";
  }

  void axes() {
    write(left, y_ + 20, panel_.title, "font-weight=\"bold\"");
    const double x_step = tick_step(x_range_);
    for (const double x : ticks_of(x_range_, x_step)) {
      rule(at_x(x), y_ + top, at_x(x), y_ + panel_height - bottom);
      write(at_x(x), y_ + panel_height - bottom + 16, number(x, digits_for(x_step)), "text-anchor=\"middle\"");
    }
    const double y_step = tick_step(y_range_);
    for (const double y : ticks_of(y_range_, y_step)) {
      rule(left, at_y(y), width - right, at_y(y));
      write(left - 6, at_y(y) + 4, number(y, digits_for(y_step)), "text-anchor=\"end\"");
    }
    write((left + width - right) / 2, y_ + panel_height - 10, panel_.x_label, "text-anchor=\"middle\"");
    const double middle = y_ + (top + panel_height - bottom) / 2;
    write(16, middle, panel_.y_label, "text-anchor=\"middle\" transform=\"rotate(-90 16 " + number(middle) + ")\"");
  }

  void draw(const ChartLine& line) {
    std::vector<ChartPoint> piece;  // between gaps
    for (const ChartPoint& point : line.points) {
      if (std::isfinite(point.x) && std::isfinite(point.y)) {
        piece.push_back(point);
        continue;
      }
      draw_piece(piece, line.color);
      piece.clear();
    }
    draw_piece(piece, line.color);
  }

  void draw_piece(const std::vector<ChartPoint>& piece, const std::string& color) {
    if (piece.empty()) return;
    out_ += "<polyline fill=\"none\" stroke-width=\"1.5\" stroke=\"" + color + "\" points=\"";
    for (const ChartPoint& point : thinned(piece)) out_ += at_text(point);
    out_ += "\"/>\n";
  }

  void draw(const ChartBand& band) {
    const std::size_t stride = std::max<std::size_t>(1, band.low.size() / points_shown);
    std::string there;
    std::vector<std::string> back;
    for (std::size_t k = 0; k < band.low.size(); k += stride) {
      there += at_text(band.high[k]);
      back.push_back(at_text(band.low[k]));
    }
    for (auto point = back.rbegin(); point != back.rend(); ++point) there += *point;
    out_ += "<polygon stroke=\"none\" fill-opacity=\"0.18\" fill=\"" + band.color + "\" points=\"" + there + "\"/>\n";
  }

  void legend() {
    double x = width - right;
    const auto entry = [&](const std::string& label, const std::string& color) {
      if (label.empty()) return;
      constexpr double letter_width = 6.4;
      x -= static_cast<double>(label.size()) * letter_width;
      write(x, y_ + 20, label, "");
      x -= 16;
      out_ += "<rect x=\"" + number(x) + "\" y=\"" + number(y_ + 11) + "\" width=\"12\" height=\"10\" fill=\"" + color +
              "\"/>\n";
      x -= 14;
    };
    for (auto line = panel_.lines.rbegin(); line != panel_.lines.rend(); ++line) entry(line->label, line->color);
    for (auto band = panel_.bands.rbegin(); band != panel_.bands.rend(); ++band) entry(band->label, band->color);
  }

  const ChartPanel& panel_;
  double y_;
  Range x_range_;
  Range y_range_;
  std::string out_;
};

}  // namespace

std::string chart_color(std::size_t index, std::size_t count) {
  constexpr std::array colors{"#0b3c8c", "#1f6feb", "#5aa9e6", "#9a9a9a", "#e6a03c", "#d9602c", "#a8201a", "#5c0f0c"};
  const std::size_t last = colors.size() - 1;
  return colors[count < 2 ? 1 : std::min(index * last / (count - 1), last)];
}

std::string svg_of(const std::string& title, const std::vector<ChartPanel>& panels) {
  const double height = title_height + panel_height * static_cast<double>(panels.size());
  std::string text =
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 " + number(width, 0) + " " + number(height, 0) +
      "\" width=\"" + number(width, 0) + "\" height=\"" + number(height, 0) +
      "\" font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n";
  text +=
      "<text x=\"" + number(left) + "\" y=\"24\" font-size=\"16\" font-weight=\"bold\">" + escaped(title) + "</text>\n";
  for (std::size_t k = 0; k < panels.size(); ++k) {
    text += PanelDrawing(panels[k], title_height + panel_height * static_cast<double>(k)).text();
  }
  return text + "</svg>\n";
}

}  // namespace bmu::cell

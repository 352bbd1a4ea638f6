#include "tools/report/chart.hpp"

#include <algorithm>
#include <cmath>

#include "tools/report/time.hpp"

namespace bmu::report {

namespace {

using svg::escaped;
using svg::number;

constexpr int time_ticks_wanted = 8;
/// Minimum distance of a text from both ends, so that it does not stick out.
constexpr double label_margin = 15.0;
/// Minimum width, so that a short gap is visible.
constexpr double hole_width_min = 1.5;

svg::Range range_of(const Plot& plot) {
  svg::Range range;
  const auto take = [&range](const std::vector<float>& values) {
    for (const float value : values) range.take(static_cast<double>(value));
  };
  for (const PlotBand& band : plot.bands) {
    take(band.low);
    take(band.high);
  }
  for (const PlotLine& line : plot.lines) {
    take(line.with_extremes ? line.values.low : line.values.mean);
    take(line.with_extremes ? line.values.high : line.values.mean);
  }
  return range;
}

/// Adds some space above and below, so that no line runs along the frame.
svg::Range with_room(svg::Range range, double range_min) {
  range.widen(range_min);
  const double room = (range.high - range.low) * 0.06;
  return {range.low - room, range.high + room};
}

double y_of(double value, const svg::Range& range) {
  return (range.high - value) / (range.high - range.low) * plot_size;
}

/// Calls `take` for each range of columns without a gap in which `has_value` is true.
template <class HasValue, class Take>
void for_each_stretch(const Columns& columns, const HasValue& has_value, const Take& take) {
  const std::size_t count = columns.columns.size();
  for (std::size_t first = 0; first < count;) {
    if (!has_value(first)) {
      ++first;
      continue;
    }
    std::size_t last = first + 1;
    while (last < count && has_value(last) && !columns.columns[last].has_gap_before) ++last;
    take(first, last);
    first = last;
  }
}

/// A horizontal line from the start of a column to its end.
std::string step_text(const Column& column, const Columns& columns, double value, const svg::Range& range) {
  return point_text(x_of(columns, column.from_us), value, range) + " " +
         point_text(x_of(columns, column.to_us), value, range) + " ";
}

/// Draws the range of a value in each column; its mean is drawn as a line.
void append_extremes(std::string& out, const PlotLine& line, const Columns& columns, const svg::Range& range) {
  for (std::size_t i = 0; i < line.values.size(); ++i) {
    const auto low = static_cast<double>(line.values.low[i]);
    const auto high = static_cast<double>(line.values.high[i]);
    if (std::isnan(low) || low == high) continue;
    const double x = x_of(columns, columns.columns[i].from_us);
    out += "<rect class=\"band " + std::string(class_of(line.ink)) + "\" x=\"" + number(x) + "\" y=\"" +
           number(y_of(high, range)) + "\" width=\"" + number(x_of(columns, columns.columns[i].to_us) - x) +
           "\" height=\"" + number(y_of(low, range) - y_of(high, range)) + "\"/>\n";
  }
}

void append_line(std::string& out, const PlotLine& line, const Plot& plot, const Columns& columns,
                 const svg::Range& range) {
  const auto is_known = [&](std::size_t i) { return i < line.values.size() && !std::isnan(line.values.mean[i]); };
  // Bands already show the extremes.
  if (columns.has_steps && line.with_extremes && plot.bands.empty()) append_extremes(out, line, columns, range);
  for_each_stretch(columns, is_known, [&](std::size_t first, std::size_t last) {
    out += "<polyline class=\"line " + std::string(class_of(line.ink)) + "\" data-name=\"" + escaped(line.name) +
           "\" data-unit=\"" + escaped(plot.unit) + "\" points=\"";
    for (std::size_t i = first; i < last; ++i) {
      const double x = x_of(columns, columns.columns[i].at_us);
      const auto low = static_cast<double>(line.values.low[i]);
      const auto high = static_cast<double>(line.values.high[i]);
      if (columns.has_steps) {
        out += step_text(columns.columns[i], columns, static_cast<double>(line.values.mean[i]), range);
      } else if (!line.with_extremes || low == high) {
        out += point_text(x, static_cast<double>(line.values.mean[i]), range) + " ";
      } else {
        // From the nearer extreme to the other, as the line would run.
        const bool is_rising = i == first || line.values.mean[i] >= line.values.mean[i - 1];
        out += point_text(x, is_rising ? low : high, range) + " " + point_text(x, is_rising ? high : low, range) + " ";
      }
    }
    if (last - first == 1 && !columns.has_steps) {
      // A single point is as wide as the line is thick.
      out +=
          point_text(x_of(columns, columns.columns[first].at_us), static_cast<double>(line.values.mean[first]), range);
    }
    out += "\"/>\n";
  });
}

void append_band(std::string& out, const PlotBand& band, const Columns& columns, const svg::Range& range) {
  const auto is_known = [&](std::size_t i) {
    return i < band.low.size() && !std::isnan(band.low[i]) && !std::isnan(band.high[i]);
  };
  for_each_stretch(columns, is_known, [&](std::size_t first, std::size_t last) {
    out +=
        "<polygon class=\"band " + std::string(class_of(band.ink)) + (band.is_strong ? " strong" : "") + "\" points=\"";
    const auto point = [&](std::int64_t at_us, float value) {
      out += point_text(x_of(columns, at_us), static_cast<double>(value), range) + " ";
    };
    for (std::size_t i = first; i < last; ++i) {
      const Column& column = columns.columns[i];
      point(columns.has_steps ? column.from_us : column.at_us, band.high[i]);
      if (columns.has_steps) point(column.to_us, band.high[i]);
    }
    for (std::size_t i = last; i-- > first;) {
      const Column& column = columns.columns[i];
      if (columns.has_steps) point(column.to_us, band.low[i]);
      point(columns.has_steps ? column.from_us : column.at_us, band.low[i]);
    }
    out += "\"/>\n";
  });
}

std::string rule(double x1, double y1, double x2, double y2, const char* kind) {
  return "<line class=\"" + std::string(kind) + "\" x1=\"" + number(x1) + "\" y1=\"" + number(y1) + "\" x2=\"" +
         number(x2) + "\" y2=\"" + number(y2) + "\"/>";
}

struct Axis {
  std::string grid;   // for the SVG
  std::string texts;  // HTML
};

Axis value_axis(const Plot& plot, const svg::Range& range) {
  const double step = svg::tick_step(range, 7.0);
  Axis axis;
  for (const double value : svg::ticks_of(range, step)) {
    const double y = y_of(value, range);
    axis.grid += rule(0, y, plot_size, y, plot.has_zero_line && value == 0.0 ? "zero" : "grid");
    axis.texts += "<span class=\"y\" style=\"top:" + number(y / 10, 2) + "%\">" +
                  number(value == 0.0 ? 0.0 : value, svg::digits_for(step)) + "</span>";
  }
  return axis;
}

std::vector<LegendEntry> legend_of(const Plot& plot) {
  std::vector<LegendEntry> entries;
  for (const PlotLine& line : plot.lines) {
    if (!line.values.is_unknown()) entries.push_back({line.name, "stroke " + std::string(class_of(line.ink))});
  }
  for (const PlotBand& band : plot.bands) {
    entries.push_back({band.name, "area " + std::string(class_of(band.ink)) + (band.is_strong ? " strong" : "")});
  }
  return entries;
}

}  // namespace

std::string_view class_of(Ink ink) {
  switch (ink) {
    case Ink::main: return "k1";
    case Ink::second: return "k2";
    case Ink::third: return "k3";
    case Ink::fourth: return "k4";
    case Ink::fifth: return "k5";
    case Ink::faint: return "k0";
  }
  return "k0";
}

double x_of(const Columns& columns, std::int64_t at_us) {
  const auto span_us = static_cast<double>(std::max<std::int64_t>(columns.to_us - columns.from_us, 1));
  return static_cast<double>(at_us - columns.from_us) / span_us * plot_size;
}

std::string point_text(double x, double value, const svg::Range& range) {
  return number(x) + "," + number(y_of(value, range));
}

std::string time_grid_svg(const Columns& columns) {
  std::string out;
  for (const ColumnHole& hole : columns.holes) {
    const double x = x_of(columns, hole.from_us);
    const double width = std::max(x_of(columns, hole.to_us) - x, hole_width_min);
    out += "<rect class=\"hole\" x=\"" + number(std::min(x, plot_size - width)) + "\" y=\"0\" width=\"" +
           number(width) + "\" height=\"1000\"><title>nothing is known: " + stretch_text(hole.from_us, hole.to_us) +
           "</title></rect>";
  }
  for (const TimeTick& tick : time_ticks(columns.from_us, columns.to_us, time_ticks_wanted)) {
    const double x = x_of(columns, tick.at_us);
    out += rule(x, 0, x, plot_size, "grid");
  }
  return out;
}

std::string time_axis_html(const Columns& columns) {
  std::string out = "<div class=\"times\" aria-hidden=\"true\">";
  bool is_odd = false;
  for (const TimeTick& tick : time_ticks(columns.from_us, columns.to_us, time_ticks_wanted)) {
    const double x = x_of(columns, tick.at_us);
    is_odd = !is_odd;
    if (x < label_margin || x > plot_size - label_margin) continue;
    // Every other one is hidden on a narrow screen.
    out += "<span class=\"x" + std::string(is_odd ? "" : " wide") + "\" style=\"left:" + number(x / 10, 2) + "%\">" +
           tick.text + "</span>";
  }
  return out + "</div>\n";
}

std::string legend_html(const std::vector<LegendEntry>& entries) {
  std::string out = "<ul class=\"legend\">";
  for (const LegendEntry& entry : entries) {
    const bool is_line = entry.classes.find("stroke") == 0;
    out += "<li><svg class=\"swatch\" viewBox=\"0 0 24 12\" aria-hidden=\"true\">";
    out += is_line ? "<line x1=\"0\" y1=\"6\" x2=\"24\" y2=\"6\" class=\"line " + entry.classes.substr(7) + "\"/>"
                   : "<rect width=\"24\" height=\"12\" class=\"band " + entry.classes.substr(5) + "\"/>";
    out += "</svg>" + escaped(entry.name) + "</li>";
  }
  return out + "</ul>\n";
}

std::string chart_html(const Plot& plot, const Columns& columns) {
  const svg::Range known = range_of(plot);
  if (known.is_empty()) {
    return "<section><h2>" + escaped(plot.title) + "</h2>\n<p class=\"nothing\">No data.</p></section>\n";
  }
  const svg::Range range = with_room(known, plot.range_min);
  const Axis axis = value_axis(plot, range);
  std::string out =
      "<section><h2>" + escaped(plot.title) + " <span class=\"unit\">" + escaped(plot.unit) + "</span></h2>\n";
  out += legend_html(legend_of(plot));
  out += "<figure class=\"plot\" data-low=\"" + number(range.low, 6) + "\" data-high=\"" + number(range.high, 6) +
         "\" data-decimals=\"" + std::to_string(plot.decimals_of_values) + "\">" + axis.texts;
  out += "<svg viewBox=\"0 0 1000 1000\" preserveAspectRatio=\"none\" role=\"img\" aria-label=\"" +
         escaped(plot.title + ": " + plot.description) + "\">\n";
  out += axis.grid + time_grid_svg(columns) + "\n";
  for (const PlotBand& band : plot.bands) append_band(out, band, columns, range);
  for (const PlotLine& line : plot.lines) append_line(out, line, plot, columns, range);
  return out + "</svg></figure>\n" + time_axis_html(columns) +
         "<p class=\"read\" aria-hidden=\"true\"></p></section>\n";
}

}  // namespace bmu::report

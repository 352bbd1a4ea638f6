#include "tools/report/page.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "tools/report/chart.hpp"
#include "tools/report/holes.hpp"
#include "tools/report/style.hpp"
#include "tools/report/time.hpp"

namespace bmu::report {

namespace {

using svg::escaped;

std::string charge_html(const ReportData& data, const Columns& columns) {
  Plot plot{.title = "State of charge",
            .description = "the state of charge, and within what the truth lies in 95 of 100 cases",
            .unit = "%",
            .bands = {},
            .lines = {}};
  plot.range_min = 5.0;
  plot.decimals_of_values = 1;
  const Series soc = reduced(data.soc_percent, columns);
  const Series doubt = reduced(data.soc_doubt_percent, columns);
  PlotBand band{.name = "95 of 100 cases", .ink = Ink::main, .low = {}, .high = {}};
  for (std::size_t i = 0; i < std::min(soc.size(), doubt.size()); ++i) {
    // In this order of the arguments unknown values stay unknown.
    band.low.push_back(std::max(soc.mean[i] - doubt.mean[i], 0.0F));
    band.high.push_back(std::min(soc.mean[i] + doubt.mean[i], 100.0F));
  }
  plot.bands.push_back(std::move(band));
  plot.lines.push_back({.name = "state of charge", .ink = Ink::main, .values = soc});
  return chart_html(plot, columns);
}

Series negated(const Series& series) {
  Series result;
  for (std::size_t i = 0; i < series.size(); ++i) result.add(-series.high[i], -series.mean[i], -series.low[i]);
  return result;
}

std::string current_html(const ReportData& data, const Columns& columns) {
  Plot plot{.title = "Current and its limits",
            .description = "the pack's current, positive when it is drawn, between the limits for drawing and charging",
            .unit = "A",
            .bands = {},
            .lines = {}};
  plot.range_min = 1.0;
  plot.has_zero_line = true;
  plot.decimals_of_values = 2;
  plot.lines.push_back(
      {.name = "current, positive: drawn", .ink = Ink::main, .values = reduced(data.current_A, columns)});
  plot.lines.push_back(
      {.name = "discharge limit", .ink = Ink::second, .values = reduced(data.discharge_limit_A, columns)});
  plot.lines.push_back(
      {.name = "charge limit", .ink = Ink::third, .values = negated(reduced(data.charge_limit_A, columns))});
  return chart_html(plot, columns);
}

std::string pack_voltage_html(const ReportData& data, const Columns& columns) {
  Plot plot{.title = "Pack and link voltage",
            .description = "the voltage of the pack, and that behind its contactors",
            .unit = "V",
            .bands = {},
            .lines = {}};
  plot.range_min = 1.0;
  plot.decimals_of_values = 2;
  plot.lines.push_back({.name = "pack", .ink = Ink::main, .values = reduced(data.pack_voltage_V, columns)});
  plot.lines.push_back({.name = "link", .ink = Ink::second, .values = reduced(data.link_voltage_V, columns)});
  return chart_html(plot, columns);
}

/// The sensor with the highest, or lowest, temperature at any time.
std::optional<std::size_t> extreme_sensor(const std::vector<Series>& sensors, bool wants_high) {
  std::optional<std::size_t> found;
  float extreme = not_known;
  for (std::size_t i = 0; i < sensors.size(); ++i) {
    for (const float value : wants_high ? sensors[i].high : sensors[i].low) {
      if (std::isnan(value) || (found && (wants_high ? value <= extreme : value >= extreme))) continue;
      extreme = value;
      found = i;
    }
  }
  return found;
}

std::string temperatures_html(const ReportData& data, const Columns& columns) {
  std::vector<Series> sensors;
  for (const SensorReport& sensor : data.sensors) sensors.push_back(reduced(sensor.temperature_C, columns));
  Plot plot{.title = "Temperatures",
            .description = "all sensors as a band from the coldest to the hottest, and the two that were so",
            .unit = "°C",
            .bands = {},
            .lines = {}};
  plot.range_min = 2.0;
  plot.decimals_of_values = 1;
  const auto hottest = extreme_sensor(sensors, true);
  const auto coldest = extreme_sensor(sensors, false);
  if (hottest)
    plot.lines.push_back({.name = data.sensors[*hottest].name, .ink = Ink::second, .values = sensors[*hottest]});
  if (coldest && coldest != hottest) {
    plot.lines.push_back({.name = data.sensors[*coldest].name, .ink = Ink::third, .values = sensors[*coldest]});
  }
  plot.bands.push_back(
      {.name = "coldest to hottest", .ink = Ink::main, .low = quantile(sensors, 0), .high = quantile(sensors, 1)});
  return chart_html(plot, columns);
}

std::string head_html(const ReportData& data) {
  const auto ms = [](std::int64_t us) { return std::to_string(us / 1'000); };
  const std::string name = escaped(data.pack_name.empty() ? "A battery pack" : data.pack_name);
  return "<!DOCTYPE html>\n<html lang=\"en\" data-from=\"" + ms(data.from_us()) + "\" data-to=\"" + ms(data.to_us()) +
         "\">\n<head><meta charset=\"utf-8\"/>\n<meta name=\"viewport\" content=\"width=device-width, "
         "initial-scale=1\"/>\n"
         "<title>" +
         name + ", " + time_text(data.from_us()) + " UTC</title>\n<style>" + std::string(page_style) +
         "</style></head>\n<body>\n<h1>" + name + "</h1>\n";
}

}  // namespace

std::string page_html(const ReportData& data, const PageOptions& options) {
  const Columns columns = columns_of(data);
  std::string out = head_html(data);
  out += "<p class=\"lead\">" + std::to_string(data.cells.size()) + " cells" +
         (data.cell_name.empty() ? "" : " " + escaped(data.cell_name)) + ", from " + escaped(data.source) +
         ". All times are UTC.</p>\n";
  for (const std::string& note : data.notes) out += "<p class=\"note\"><b>Note:</b> " + escaped(note) + "</p>\n";
  out += summary_html(data);
  const bool has_few_holes = data.holes.size() <= holes_at_top_max;
  if (has_few_holes) out += holes_html(data);
  out += voltages_html(data, columns);
  out += charge_html(data, columns);
  out += current_html(data, columns);
  out += causes_html(data, columns);
  out += timeline_html(data, columns);
  out += pack_voltage_html(data, columns);
  out += temperatures_html(data, columns);
  out += cell_figures_html(data);
  if (!has_few_holes) out += holes_html(data);
  out += events_html(data);
  out += "<footer>Made by " + escaped(options.made_by) +
         (options.made_at_us > 0 ? " on " + time_text(options.made_at_us) + " UTC" : "") + ".</footer>\n";
  return out + "<script>" + std::string(page_script) + "</script>\n</body></html>\n";
}

}  // namespace bmu::report

// Timelines: phases, contactors, faults; causes of the limits; and events as text.
#include <algorithm>
#include <map>

#include "tools/report/chart.hpp"
#include "tools/report/page.hpp"
#include "tools/report/time.hpp"

namespace bmu::report {

namespace {

using svg::escaped;
using svg::number;

constexpr std::size_t inks = 6;  // c0 to c5
constexpr std::size_t events_max = 500;
/// Number of names beside a strip; further ones are shown by the pointer only, and have the last colour.
constexpr std::size_t names_told_max = 10;
/// Minimum width, so that a span of no length is visible.
constexpr double width_min = 1.5;

std::string rect(double from, double to, const std::string& classes, const std::string& title) {
  const double width = std::max(to - from, width_min);
  return "<rect x=\"" + number(std::min(from, plot_size - width_min)) + "\" y=\"0\" width=\"" + number(width) +
         "\" height=\"1000\" class=\"" + classes + "\"><title>" + escaped(title) + "</title></rect>\n";
}

/// A line of a timeline: text, and below it its active times.
std::string row_html(const std::string& words_html, const std::string& label, const std::string& rects,
                     const Columns& columns) {
  return "<div class=\"row\">" + words_html +
         "<div class=\"bar\"><svg viewBox=\"0 0 1000 1000\" preserveAspectRatio=\"none\" role=\"img\" aria-label=\"" +
         escaped(label) + "\">" + time_grid_svg(columns) + rects + "</svg></div></div>\n";
}

std::string span_title(const SpanReport& span) {
  std::string text = span.text;
  if (!span.place.empty()) text += ", " + span.place;
  if (span.lasted_us) {
    return text + ": for " + span_text(*span.lasted_us) + " of the time from " +
           stretch_text(span.from_us, span.to_us) + ", exact time unknown";
  }
  text += ": " + (span.has_begun_before ? "from before" : "from " + time_text(span.from_us));
  return text + (span.goes_on ? ", still active at the end" : "") + ", for " + span_text(span.to_us - span.from_us);
}

/// Names in the order of their first time, so that the first one is on top after an opening.
std::vector<std::string> names_of(const ReportData& data, SpanKind kind) {
  std::vector<std::string> names;
  for (const SpanReport& span : data.spans) {
    if (span.kind == kind && std::find(names.begin(), names.end(), span.name) == names.end())
      names.push_back(span.name);
  }
  return names;
}

struct RowWords {
  std::string text;
  std::string places;
  int count = 0;
  std::int64_t lasted_us = 0;
};

RowWords words_of(const ReportData& data, SpanKind kind, const std::string& name) {
  RowWords words;
  bool went_on = false;  // into a gap
  for (const SpanReport& span : data.spans) {
    if (span.kind != kind || span.name != name) continue;
    words.text = span.text;
    if (!span.place.empty() && words.places.find(span.place) == std::string::npos) {
      words.places += (words.places.empty() ? "" : ", ") + span.place;
    }
    // A state before a gap that is active after it counts once.
    if (!went_on || !span.has_begun_before) ++words.count;
    went_on = span.goes_on;
    words.lasted_us += span.length_us();
  }
  return words;
}

std::string rects_of(const ReportData& data, SpanKind kind, const std::string& name, const std::string& classes,
                     const Columns& columns) {
  std::string rects;
  for (const SpanReport& span : data.spans) {
    if (span.kind != kind || span.name != name) continue;
    rects += rect(x_of(columns, span.from_us), x_of(columns, span.to_us), classes + (span.lasted_us ? " vague" : ""),
                  span_title(span));
  }
  return rects;
}

std::string rows_html(const ReportData& data, SpanKind kind, const std::string& classes, const Columns& columns) {
  std::string out;
  for (const std::string& name : names_of(data, kind)) {
    const RowWords words = words_of(data, kind, name);
    const bool is_fault = kind == SpanKind::fault || kind == SpanKind::warning;
    std::string text = (is_fault ? "<b class=\"" + classes + "\">" + (kind == SpanKind::fault ? "fault" : "warning") +
                                       "</b> " + escaped(words.text)
                                 : escaped(words.text)) +
                       (words.places.empty() ? "" : ": " + escaped(words.places));
    text += " <span class=\"unit\">" + (words.count > 1 ? std::to_string(words.count) + " times, " : std::string()) +
            span_text(words.lasted_us) + "</span>";
    out += row_html(text, words.text + ", when", rects_of(data, kind, name, classes, columns), columns);
  }
  return out;
}

// --- phases and causes: consecutive states, in colours ---

struct Stretch {
  std::int64_t from_us = 0;
  std::int64_t to_us = 0;
  std::string name;
};

std::map<std::string, std::int64_t> lengths_of(const std::vector<Stretch>& stretches) {
  std::map<std::string, std::int64_t> lengths;
  for (const Stretch& stretch : stretches) lengths[stretch.name] += stretch.to_us - stretch.from_us;
  return lengths;
}

std::string share_text(double percent) {
  if (percent > 0.0 && percent < 0.1) return "&lt; 0.1";
  return number(percent, percent < 10 ? 1 : 0);
}

std::string strip_html(const std::string& title, const std::vector<Stretch>& stretches, const Columns& columns) {
  const auto lengths = lengths_of(stretches);
  std::int64_t total_us = 0;
  std::vector<std::pair<std::int64_t, std::string>> order;
  for (const auto& [name, length_us] : lengths) {
    order.emplace_back(-length_us, name);
    total_us += length_us;
  }
  std::sort(order.begin(), order.end());
  std::map<std::string, std::string> classes;
  std::string words = escaped(title) + ": ";
  for (const auto& [length_us, name] : order) {
    const std::string ink = "c" + std::to_string(std::min(classes.size(), inks - 1));
    const double share = total_us > 0 ? -100.0 * static_cast<double>(length_us) / static_cast<double>(total_us) : 0.0;
    if (classes.size() == names_told_max) words += "and others";
    if (classes.size() < names_told_max) {
      words += "<span class=\"pair\"><span class=\"share " + ink + "\"></span>" + escaped(name) +
               " <span class=\"unit\">" + share_text(share) + " %</span></span>";
    }
    classes[name] = ink;
  }
  std::string rects;
  for (const Stretch& stretch : stretches) {
    rects += rect(
        x_of(columns, stretch.from_us), x_of(columns, stretch.to_us), classes[stretch.name],
        stretch.name + ": from " + time_text(stretch.from_us) + " for " + span_text(stretch.to_us - stretch.from_us));
  }
  return row_html(words, title + ", over time", rects, columns);
}

std::vector<Stretch> phases_of(const ReportData& data) {
  std::vector<Stretch> stretches;
  for (const SpanReport& span : data.spans) {
    if (span.kind == SpanKind::phase) stretches.push_back({span.from_us, span.to_us, span.name});
  }
  return stretches;
}

/// One stretch for each run of columns with the same cause at their start.
std::vector<Stretch> stretches_of(const CauseReport& causes, const ReportData& data, const Columns& columns) {
  std::vector<Stretch> stretches;
  for (const Column& column : columns.columns) {
    const std::int64_t from_us = data.times_us[column.first];
    const std::int64_t to_us = data.times_us[column.last - 1] + data.sample_us;
    const std::string& name = causes.texts[causes.of_sample[column.first]];
    if (!stretches.empty() && stretches.back().name == name && !column.has_gap_before) {
      stretches.back().to_us = to_us;
    } else {
      stretches.push_back({from_us, to_us, name});
    }
  }
  return stretches;
}

}  // namespace

std::string causes_html(const ReportData& data, const Columns& columns) {
  const std::string sample = sample_name(data.sample_us);
  const std::string when = data.is_of_means ? " at the end of each " + sample : "";
  std::string out;
  if (!data.discharge_cause.of_sample.empty()) {
    out +=
        strip_html("Discharging is limited" + when + " by", stretches_of(data.discharge_cause, data, columns), columns);
  }
  if (!data.charge_cause.of_sample.empty()) {
    out += strip_html("Charging is limited" + when + " by", stretches_of(data.charge_cause, data, columns), columns);
  }
  if (out.empty()) return "";
  const std::string note =
      data.is_of_means ? "<p class=\"note\">Only the reason at the end of each " + sample + " is known.</p>\n" : "";
  return "<section><h2>Causes of the current limits</h2>\n" + note + out + time_axis_html(columns) + "</section>\n";
}

std::string timeline_html(const ReportData& data, const Columns& columns) {
  const std::vector<Stretch> phases = phases_of(data);
  std::string out = "<section><h2>Contactors and faults</h2>\n";
  if (!phases.empty()) out += strip_html("Phase", phases, columns);
  out += rows_html(data, SpanKind::contactor, "c3", columns);
  const std::string faults =
      rows_html(data, SpanKind::fault, "fault", columns) + rows_html(data, SpanKind::warning, "warning", columns);
  out += faults.empty() ? "<p class=\"nothing row\">No faults and no warnings.</p>\n" : faults;
  return out + time_axis_html(columns) + "</section>\n";
}

std::string events_html(const ReportData& data) {
  if (data.events.empty()) return "";
  std::string out = "<section class=\"long\"><h2>Events</h2>\n";
  if (data.events.size() > events_max) {
    out += "<p class=\"note\">The last " + std::to_string(events_max) + " of " + std::to_string(data.events.size()) +
           " events.</p>\n";
  }
  out += "<table class=\"events\"><tr><th>Time, UTC</th><th>Event</th></tr>\n";
  std::string day;
  for (std::size_t i = data.events.size() - std::min(data.events.size(), events_max); i < data.events.size(); ++i) {
    const EventReport& event = data.events[i];
    const std::string its_day = time_text(event.at_us).substr(0, 10);
    out += "<tr><td>" + (its_day == day ? "" : its_day + " ") + clock_text_ms(event.at_us) + "</td><td>" +
           escaped(event.text) + "</td></tr>\n";
    day = its_day;
  }
  return out + "</table></section>\n";
}

}  // namespace bmu::report

#include "tools/report/holes.hpp"

#include <algorithm>

#include "tools/common/svg_text.hpp"
#include "tools/report/time.hpp"

namespace bmu::report {

namespace {

using svg::escaped;

constexpr std::size_t holes_max = 100;

std::string length_text(const HoleReport& hole) {
  return hole.from_us && hole.to_us ? span_text(*hole.to_us - *hole.from_us) : "";
}

std::string time_of(std::optional<std::int64_t> at_us, const char* otherwise) {
  return at_us ? time_text(*at_us).substr(0, 11) + clock_text_ms(*at_us) : otherwise;
}

}  // namespace

std::string when_text(const HoleReport& hole) {
  if (hole.from_us && hole.to_us) return stretch_text(*hole.from_us, *hole.to_us);
  if (hole.from_us) return "behind " + time_text(*hole.from_us) + " UTC";
  return hole.to_us ? "before " + time_text(*hole.to_us) + " UTC" : "all";
}

std::string hole_text(const HoleReport& hole, const std::function<std::string(std::int64_t at_us)>& time) {
  if (!hole.from_us && !hole.to_us) return "no data: " + hole.text;
  if (!hole.from_us) return "no data before " + time(*hole.to_us) + ": " + hole.text;
  if (!hole.to_us) return "no data after " + time(*hole.from_us) + ": " + hole.text;
  return "no data from " + time(*hole.from_us) + " to " + time(*hole.to_us) + " (" + length_text(hole) +
         "): " + hole.text;
}

std::int64_t missing_us(const ReportData& data) {
  std::int64_t sum_us = 0;
  std::int64_t counted_to_us = data.from_us();  // two files may have the same gap
  for (const HoleReport& hole : data.holes) {
    if (!hole.from_us || !hole.to_us) continue;
    const std::int64_t from_us = std::max(*hole.from_us, counted_to_us);
    const std::int64_t to_us = std::min(*hole.to_us, data.to_us());
    sum_us += std::max<std::int64_t>(to_us - from_us, 0);
    counted_to_us = std::max(counted_to_us, to_us);
  }
  return sum_us;
}

std::string holes_html(const ReportData& data) {
  if (data.holes.empty()) return "";
  std::string out = "<section class=\"long\"><h2>Gaps</h2>\n";
  if (data.holes.size() > holes_max) {
    out += "<p class=\"note\">The first " + std::to_string(holes_max) + " of " + std::to_string(data.holes.size()) +
           " gaps.</p>\n";
  }
  out +=
      "<div class=\"scroll\"><table class=\"holes\"><tr><th>From, UTC</th><th>To, UTC</th><th>Length</th><th>Cause"
      "</th></tr>\n";
  for (std::size_t i = 0; i < std::min(data.holes.size(), holes_max); ++i) {
    const HoleReport& hole = data.holes[i];
    out += "<tr><td>" + time_of(hole.from_us, "start") + "</td><td>" + time_of(hole.to_us, "end") + "</td><td>" +
           length_text(hole) + "</td><td>" + (hole.is_damage ? "<b class=\"fault\">damaged</b> " : "") +
           escaped(hole.text) + "</td></tr>\n";
  }
  return out + "</table></div></section>\n";
}

}  // namespace bmu::report

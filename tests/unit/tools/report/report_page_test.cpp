// Page of a report: well-formed, self-contained, true to the data, and robust against any texts.
#include <cmath>
#include <sstream>

#include "tests/support/catch.hpp"
#include "tools/common/svg_text.hpp"
#include "tools/report/holes.hpp"
#include "tools/report/page.hpp"

namespace bmu::report {

namespace {

constexpr std::int64_t s = 1'000'000;
constexpr std::int64_t noon_us = 1'772'366'400 * s;

ReportData pack_of(int modules, int cells_each, int samples, std::int64_t sample_us = s) {
  ReportData data;
  data.pack_name = "test pack";
  data.source = "a test";
  data.sample_us = sample_us;
  for (int i = 0; i < samples; ++i) data.times_us.push_back(noon_us + i * sample_us);
  for (int m = 1; m <= modules; ++m) {
    for (int c = 1; c <= cells_each; ++c) {
      CellReport& cell = data.cells.emplace_back();
      cell.name = std::to_string(m) + "." + std::to_string(c);
      cell.module = static_cast<std::uint8_t>(m);
      cell.pack_number = static_cast<std::uint16_t>(data.cells.size());
      for (int i = 0; i < samples; ++i) {
        const double wave = 0.2 * std::sin(i / 700.0) + 0.0005 * static_cast<double>(data.cells.size() % 7);
        cell.voltage_V.add(static_cast<float>(3.6 + wave));
      }
    }
  }
  for (int i = 0; i < samples; ++i) {
    data.current_A.add(static_cast<float>(i % 50));
    data.soc_percent.add(50);
    data.soc_doubt_percent.add(4);
    data.discharge_limit_A.add(80);
    data.charge_limit_A.add(20);
    data.discharge_cause.add(i % 100 < 50 ? "peak" : "cold");
    data.charge_cause.add("full");
  }
  return data;
}

std::string page_of(const ReportData& data) {
  return page_html(data, {.made_by = "test"});
}

std::size_t count_of(const std::string& page, std::string_view what) {
  std::size_t count = 0;
  for (std::size_t at = page.find(what); at != std::string::npos; at = page.find(what, at + 1)) ++count;
  return count;
}

/// Text between the first `begin` and the next `end`; "" if it is not there.
std::string between(const std::string& page, const std::string& begin, const std::string& end, std::size_t from = 0) {
  const std::size_t at = page.find(begin, from);
  if (at == std::string::npos) return "";
  return page.substr(at + begin.size(), page.find(end, at + begin.size()) - at - begin.size());
}

/// Checks that every element is closed in order, every attribute is quoted, and no tag contains "<"; returns "" or the
/// place of the flaw.
std::string flaw_of(const std::string& page) {
  std::vector<std::string> open;
  for (std::size_t at = page.find('<', 15); at != std::string::npos; at = page.find('<', at)) {
    const std::string where = page.substr(at, 60);
    if (page.compare(at, 2, "</") == 0) {
      const std::size_t end = page.find('>', at);
      const std::string name = page.substr(at + 2, end - at - 2);
      if (open.empty() || open.back() != name) return "not open: " + where;
      open.pop_back();
      at = end;
      continue;
    }
    std::size_t i = at + 1;
    while (i < page.size() && std::isalnum(static_cast<unsigned char>(page[i])) != 0) ++i;
    const std::string name = page.substr(at + 1, i - at - 1);
    if (name.empty()) return "no name: " + where;
    bool is_quoted = false;
    for (; i < page.size() && (is_quoted || page[i] != '>'); ++i) {
      if (page[i] == '"') is_quoted = !is_quoted;
      if (page[i] == '<') return "< in a tag: " + where;
      if (page[i] == '=' && !is_quoted && page[i + 1] != '"') return "not quoted: " + where;
    }
    if (page[i - 1] != '/') open.push_back(name);
    at = i;
    // Their content is not checked.
    if (name == "style" || name == "script") at = page.find("</" + name, at);
  }
  return open.empty() ? "" : "still open: " + open.back();
}

struct Point {
  double x, y;
};

std::vector<Point> points_of(const std::string& text) {
  std::vector<Point> points;
  std::istringstream in(text);
  char comma = 0;
  for (Point point{}; in >> point.x >> comma >> point.y;) points.push_back(point);
  return points;
}

/// All pieces of the line with this name.
std::vector<std::vector<Point>> line_of(const std::string& page, const std::string& name) {
  std::vector<std::vector<Point>> pieces;
  const std::string begin = "data-name=\"" + name + "\"";
  for (std::size_t at = page.find(begin); at != std::string::npos; at = page.find(begin, at + 1)) {
    pieces.push_back(points_of(between(page, "points=\"", "\"", at)));
  }
  return pieces;
}

struct Scale {
  double low, high;

  [[nodiscard]] double value_at(double y) const { return high - y / 1000 * (high - low); }
};

Scale scale_of(const std::string& page, const std::string& heading) {
  const std::size_t at = page.find("<h2>" + heading);
  REQUIRE(at != std::string::npos);
  return {std::stod(between(page, "data-low=\"", "\"", at)), std::stod(between(page, "data-high=\"", "\"", at))};
}

}  // namespace

TEST_CASE("a page is well-formed and needs nothing else", "[unit][report]") {
  const std::string page = page_of(pack_of(4, 12, 300));
  CHECK(flaw_of(page) == "");
  CHECK(page.find("<!DOCTYPE html>") == 0);
  // The only URL is the namespace of SVG, in the script.
  CHECK(count_of(page, "http") == 1);
  CHECK(count_of(page, " src=") == 0);
  CHECK(count_of(page, " href=") == 0);
  CHECK(count_of(page, "url(") == 0);
  CHECK(count_of(page, "@import") == 0);
  // Every chart has an alternative text.
  CHECK(count_of(page, "role=\"img\"") == count_of(page, "role=\"img\" aria-label=\""));
  CHECK(count_of(page, "nan") == 0);
  CHECK(page.find("All times are UTC") != std::string::npos);
}

TEST_CASE("lines stand where the numbers are", "[unit][report]") {
  ReportData data = pack_of(1, 12, 10);
  for (std::size_t i = 0; i < 10; ++i) data.cells[4].voltage_V.mean[i] = 3.0F + 0.01F * static_cast<float>(i);
  data.cells[4].voltage_V.low = data.cells[4].voltage_V.high = data.cells[4].voltage_V.mean;
  const std::string page = page_of(data);
  const Scale scale = scale_of(page, "Cell voltages");
  const auto pieces = line_of(page, "cell 1.5");
  REQUIRE(pieces.size() == 1);
  REQUIRE(pieces[0].size() == 10);
  for (std::size_t i = 0; i < 10; ++i) {
    // A sample's middle: half a second into each of ten.
    CHECK(pieces[0][i].x == Approx(50.0 + 100.0 * static_cast<double>(i)).margin(0.06));
    CHECK(scale.value_at(pieces[0][i].y) == Approx(3.0 + 0.01 * static_cast<double>(i)).margin(0.0002));
  }
  CHECK(page.find("<dd>3.0000 V<small>cell 1.5, 2026-03-01 12:00:00</small>") != std::string::npos);

  const Scale currents = scale_of(page, "Current and its limits");
  CHECK(currents.value_at(line_of(page, "current, positive: drawn")[0].back().y) == Approx(9.0).margin(0.1));
  CHECK(currents.value_at(line_of(page, "discharge limit")[0].back().y) == Approx(80.0).margin(0.1));
  CHECK(currents.value_at(line_of(page, "charge limit")[0].back().y) == Approx(-20.0).margin(0.1));
}

TEST_CASE("means of minutes are steps, with the lowest and highest around them", "[unit][report]") {
  ReportData data = pack_of(1, 12, 10);
  data.is_of_means = true;
  data.times_us[0] += s / 2;  // shorter than the others
  data.current_A.low[3] = -2;
  data.current_A.high[3] = 30;
  const std::string page = page_of(data);
  CHECK(flaw_of(page) == "");
  const Scale scale = scale_of(page, "Current and its limits");
  const auto pieces = line_of(page, "current, positive: drawn");
  REQUIRE(pieces.size() == 1);
  REQUIRE(pieces[0].size() == 20);
  const double second = 1000 / 9.5;
  for (std::size_t i = 0; i < 10; ++i) {
    const Point& from = pieces[0][2 * i];
    const Point& to = pieces[0][2 * i + 1];
    CHECK(from.x == Approx(i == 0 ? 0.0 : (static_cast<double>(i) - 0.5) * second).margin(0.06));
    CHECK(to.x == Approx((static_cast<double>(i) + 0.5) * second).margin(0.06));
    CHECK(from.y == to.y);
    CHECK(scale.value_at(from.y) == Approx(static_cast<double>(i)).margin(0.1));
  }
  const std::size_t at = page.find("<rect class=\"band k1\"");
  REQUIRE(at != std::string::npos);
  CHECK(std::stod(between(page, "x=\"", "\"", at)) == Approx(2.5 * second).margin(0.06));
  const double top = std::stod(between(page, " y=\"", "\"", at));
  CHECK(scale.value_at(top) == Approx(30).margin(0.1));
  CHECK(scale.value_at(top + std::stod(between(page, "height=\"", "\"", at))) == Approx(-2).margin(0.1));
}

TEST_CASE("what is only known of a minute is told as that", "[unit][report]") {
  ReportData data = pack_of(2, 12, 30, 60 * s);
  for (std::int64_t& at_us : data.times_us) at_us += 17 * s;  // start of the daemon
  data.cells[4].voltage_V.low[7] = 2.7F;
  data.is_of_means = true;
  const std::string page = page_of(data);
  CHECK(page.find(" V<small>cell 1.5, in the minute from 2026-03-01 12:07</small>") != std::string::npos);
  CHECK(page.find("Discharging is limited at the end of each minute by: ") != std::string::npos);
  CHECK(page.find("Only the reason at the end of each minute is known.") != std::string::npos);
  halve(data);
  CHECK(page_of(data).find("Only the reason at the end of each 2 min is known.") != std::string::npos);
  CHECK(page_of(data).find("in the 2 min from 2026-03-01 12:06<") != std::string::npos);
  // A row need not be a minute.
  ReportData short_rows = pack_of(2, 12, 30, 10 * s);
  short_rows.is_of_means = true;
  const std::string short_page = page_of(short_rows);
  CHECK(short_page.find("Discharging is limited at the end of each 10.0 s by: ") != std::string::npos);
  CHECK(short_page.find("Only the reason at the end of each 10.0 s is known.") != std::string::npos);
  CHECK(short_page.find("minute") == std::string::npos);
  // A recording has instants.
  const std::string moments = page_of(pack_of(2, 12, 30));
  CHECK(moments.find("in the minute") == std::string::npos);
  CHECK(moments.find("Discharging is limited by: ") != std::string::npos);
  CHECK(moments.find("Of each minute") == std::string::npos);
}

TEST_CASE("what is not known is a gap, never zero", "[unit][report]") {
  ReportData data = pack_of(1, 12, 10);
  for (const std::size_t i : {3U, 4U, 9U}) {
    data.current_A.mean[i] = data.current_A.low[i] = data.current_A.high[i] = not_known;
    for (CellReport& cell : data.cells) {
      cell.voltage_V.mean[i] = cell.voltage_V.low[i] = cell.voltage_V.high[i] = not_known;
    }
  }
  for (std::size_t i = 6; i < 10; ++i) data.times_us[i] += 5 * s;  // and no samples between 5 and 6
  const std::string page = page_of(data);
  CHECK(flaw_of(page) == "");
  CHECK(count_of(page, "nan") == 0);
  const auto pieces = line_of(page, "current, positive: drawn");
  REQUIRE(pieces.size() == 3);
  CHECK(pieces[0].size() == 3);
  CHECK(pieces[1].size() == 2);  // a single point is drawn twice, to be visible
  CHECK(pieces[2].size() == 3);
  CHECK(line_of(page, "median").size() == 3);
  CHECK(scale_of(page, "Cell voltages").low > 3.0);
  CHECK(page.find("<dt>Covered by samples</dt><dd>10.0 s") != std::string::npos);
  CHECK(page.find("<dt>Span</dt><dd>15.0 s") != std::string::npos);
}

TEST_CASE("a quantity that was never known is said to be so", "[unit][report]") {
  ReportData data = pack_of(1, 2, 5);
  data.soc_percent = {};
  data.soc_doubt_percent = {};
  const std::string page = page_of(data);
  CHECK(flaw_of(page) == "");
  CHECK(page.find("<h2>State of charge</h2>\n<p class=\"nothing\">No data.") != std::string::npos);
  CHECK(page.find("<dt>State of charge</dt>") == std::string::npos);
  CHECK(page.find("<h2>Temperatures</h2>\n<p class=\"nothing\">") != std::string::npos);
}

TEST_CASE("one sample is a page, too", "[unit][report]") {
  CHECK(flaw_of(page_of(pack_of(1, 1, 1))) == "");
}

TEST_CASE("texts from files stay texts", "[unit][report]") {
  const std::string evil = "</style><script>alert(\"1\")</script>&<img src=x onerror='alert(2)'>";
  ReportData data = pack_of(1, 2, 5);
  data.pack_name = data.cell_name = data.source = evil;
  data.notes = {evil};
  data.cells[0].name = evil;
  data.sensors.push_back({.name = evil, .temperature_C = data.current_A});
  data.discharge_cause.texts[0] = evil;
  data.events.push_back({.at_us = noon_us, .text = evil + "\x01\xff"});
  for (const SpanKind kind : {SpanKind::phase, SpanKind::contactor, SpanKind::warning, SpanKind::fault}) {
    data.spans.push_back(
        {.kind = kind, .name = evil, .text = evil, .place = evil, .from_us = noon_us + s, .to_us = noon_us + 2 * s});
  }
  const std::string page = page_html(data, {.made_by = evil});
  CHECK(flaw_of(page) == "");
  CHECK(count_of(page, "<script>") == 1);
  CHECK(count_of(page, "<img") == 0);
  CHECK(count_of(page, "onerror='") == 0);
  CHECK(count_of(page, "&lt;img src=x onerror=&#39;") > 10);
  CHECK(page.find("alert(2)&#39;&gt; ?</td>") != std::string::npos);
}

TEST_CASE("texts are escaped character by character", "[unit][report]") {
  CHECK(svg::escaped("a<b>&\"'") == "a&lt;b&gt;&amp;&quot;&#39;");
  CHECK(svg::escaped("\t\n\x7F") == "   ");
  CHECK(svg::escaped("20 °C ± µΩ 電 😀") == "20 °C ± µΩ 電 😀");
  CHECK(svg::escaped("\xC0\xAF \x80 \xE2\x82 \xF8") == "?? ? ?? ?");
}

TEST_CASE("cells that are unlike the others are named, and no more than that", "[unit][report]") {
  ReportData data = pack_of(2, 12, 100);
  const auto shift = [&](std::size_t cell, float by) {
    Series& series = data.cells[cell].voltage_V;
    for (std::size_t i = 0; i < series.size(); ++i) series.mean[i] += by;
    series.low = series.high = series.mean;
  };
  const auto outliers = [&] {
    std::vector<Series> voltages;
    for (const CellReport& cell : data.cells) voltages.push_back(cell.voltage_V);
    return outliers_of(voltages);
  };
  CHECK(outliers().size() == 2);  // the lowest and the highest are always shown
  shift(5, -0.1F);
  shift(9, -0.05F);
  shift(20, 0.03F);
  CHECK(outliers() == std::vector<std::size_t>{5, 20, 9});
  data.cells[2].voltage_V.low[50] = 2.5F;  // once, momentarily
  CHECK(outliers() == std::vector<std::size_t>{2, 20, 5, 9});
  CHECK(outliers_of({}).empty());
}

TEST_CASE("what was so is drawn where it was, with how long", "[unit][report]") {
  ReportData data = pack_of(1, 2, 100);
  data.spans.push_back({.kind = SpanKind::fault,
                        .name = "cell_undervoltage",
                        .text = "cell voltage too low",
                        .place = "cell 1.2",
                        .from_us = noon_us + 25 * s,
                        .to_us = noon_us + 75 * s});
  const std::string page = page_of(data);
  CHECK(page.find("<rect x=\"250.0\" y=\"0\" width=\"500.0\" height=\"1000\" class=\"fault\">") != std::string::npos);
  CHECK(page.find("cell voltage too low: cell 1.2 <span class=\"unit\">50.0 s</span>") != std::string::npos);
  CHECK(page.find("<dt>Faults</dt><dd><b class=\"fault\">1</b>") != std::string::npos);
  // Half of the time each, in stretches of 50 s.
  CHECK(page.find("cold <span class=\"unit\">50 %</span>") != std::string::npos);
  CHECK(page.find("full <span class=\"unit\">100 %</span>") != std::string::npos);
}

TEST_CASE("a hole is in every picture, at the top and in a list", "[unit][report]") {
  ReportData data = pack_of(1, 2, 100);
  data.holes.push_back({.from_us = noon_us + 40 * s,
                        .to_us = noon_us + 60 * s,
                        .text = "drive.log, line 4711: <wrong>",
                        .is_damage = true});
  data.holes.push_back({.from_us = noon_us + 90 * s, .to_us = std::nullopt, .text = "no end"});
  const std::string page = page_of(data);
  CHECK(flaw_of(page) == "");
  CHECK(count_of(page, "<rect class=\"hole\" x=\"400.0\" y=\"0\" width=\"200.0\"") >= 4);
  CHECK(page.find("<h2>Gaps</h2>") < page.find("<h2>Cell voltages"));
  CHECK(page.find("<dt>Missing</dt><dd><b class=\"fault\">20.0 s</b><small>2026-03-01 12:00:40 to 12:01:00 UTC, and 1 "
                  "more</small>") != std::string::npos);
  CHECK(page.find("<tr><td>2026-03-01 12:00:40.000</td><td>2026-03-01 12:01:00.000</td><td>20.0 s</td><td>"
                  "<b class=\"fault\">damaged</b> drive.log") != std::string::npos);
  CHECK(page.find("<td>end</td><td></td><td>no end</td>") != std::string::npos);
  CHECK(page_of(pack_of(1, 2, 100)).find("issing") == std::string::npos);
  data.holes.resize(holes_at_top_max + 1, data.holes.front());
  const std::string many = page_of(data);
  CHECK(many.find("<h2>Gaps</h2>") > many.find("<h2>Cell voltages"));
}

TEST_CASE("what went on through a hole is told once, what began behind one again", "[unit][report]") {
  ReportData data = pack_of(1, 2, 100);
  const auto add = [&](int from_s, int to_s, bool has_begun_before, bool goes_on) {
    data.spans.push_back({.kind = SpanKind::contactor,
                          .name = "main positive",
                          .text = "main positive closed",
                          .place = {},
                          .from_us = noon_us + from_s * s,
                          .to_us = noon_us + to_s * s,
                          .has_begun_before = has_begun_before,
                          .goes_on = goes_on});
  };
  add(10, 20, false, true);
  add(30, 40, true, false);
  CHECK(page_of(data).find("main positive closed <span class=\"unit\">20.0 s</span>") != std::string::npos);
  add(50, 60, false, false);
  add(70, 80, true, true);  // open before the gap, closed after it
  CHECK(page_of(data).find("main positive closed <span class=\"unit\">3 times, 40.0 s</span>") != std::string::npos);
  data.spans.back().lasted_us = 4 * s;
  const std::string page = page_of(data);
  CHECK(page.find("3 times, 34.0 s</span>") != std::string::npos);
  CHECK(page.find("class=\"c3 vague\"><title>main positive closed: for 4.0 s of the time from 2026-03-01 12:01:10 to "
                  "12:01:20 UTC, exact time unknown</title>") != std::string::npos);
}

TEST_CASE("each cell's figures stand in its place, and in the table", "[unit][report]") {
  ReportData data = pack_of(2, 5, 5);
  CHECK(page_of(data).find("Resistance of each cell") == std::string::npos);  // all unknown
  for (CellReport& cell : data.cells) {
    cell.resistance_mOhm = {.value = 2.0F, .doubt = 0.5F};
    cell.bled_Ah = 0;
  }
  CHECK(page_of(data).find("Nothing, of no cell.") != std::string::npos);
  data.cells[3].resistance_mOhm = {.value = 3.0F, .doubt = 0.25F};
  data.cells[6].resistance_mOhm = {};
  data.cells[9].bled_Ah = 0.5F;
  const std::string page = page_of(data);
  CHECK(flaw_of(page) == "");
  CHECK(count_of(page, "class=\"dot\"") == 9);
  // 1.5 to 3.25 mOhm, and room above and below; the fourth of ten cells.
  const double room = 1.75 * 0.06;
  const std::string y = svg::number((3.25 + room - 3.0) / (1.75 + 2 * room) * 1000);
  CHECK(page.find("<line class=\"dot\" x1=\"350.0\" x2=\"350.0\" y1=\"" + y + "\" y2=\"" + y +
                  "\"><title>cell 1.4: 3.000 mΩ</title>") != std::string::npos);
  CHECK(count_of(page, "class=\"amount\"") == 10);
  CHECK(page.find("<title>cell 2.5: 0.500 Ah</title>") != std::string::npos);
  CHECK(page.find("<tr><td>1.4</td><td class=\"n\">4</td>") != std::string::npos);
  CHECK(page.find("<td class=\"n\">3.00</td><td class=\"n\">0.25</td><td class=\"n\">–</td>") != std::string::npos);
}

TEST_CASE("the energy left at the end stands on its card, with its doubt", "[unit][report][SOE_1]") {
  ReportData data = pack_of(2, 5, 5);
  CHECK(page_of(data).find("Energy left") == std::string::npos);
  data.energy_left_Wh = {.value = 321.0F, .doubt = 12.0F};
  const std::string page = page_of(data);
  CHECK(flaw_of(page) == "");
  const std::size_t card = page.find("Energy left");
  REQUIRE(card != std::string::npos);
  CHECK(page.find("321.0 Wh", card) < card + 200);
  CHECK(page.find("± 12.0 Wh at the end", card) < card + 300);
}

TEST_CASE("a pack without faults says so", "[unit][report]") {
  const std::string page = page_of(pack_of(1, 2, 5));
  CHECK(page.find("<dt>Faults</dt><dd>none</dd>") != std::string::npos);
  CHECK(page.find("No faults and no warnings.") != std::string::npos);
}

TEST_CASE("thirty days of 96 cells are a page below two megabytes", "[unit][report]") {
  const ReportData data = pack_of(8, 12, 30 * 24 * 60, 60 * s);
  const std::string page = page_of(data);
  CHECK(page.size() < 2'000'000);
  CHECK(page.size() > 100'000);
  CHECK(flaw_of(page) == "");
}

}  // namespace bmu::report

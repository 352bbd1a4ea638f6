// The figures at the top of the page.
#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

#include "tools/common/svg_text.hpp"
#include "tools/report/holes.hpp"
#include "tools/report/page.hpp"
#include "tools/report/time.hpp"

namespace bmu::report {

namespace {

using svg::escaped;
using svg::number;

/// Value, position and time of an extreme.
struct Extreme {
  float value = not_known;
  std::int64_t at_us = 0;
  std::string place;

  [[nodiscard]] bool is_known() const { return !std::isnan(value); }
};

void take(Extreme& extreme, const Series& series, bool wants_high, const std::string& place, const ReportData& data) {
  const std::vector<float>& values = wants_high ? series.high : series.low;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (std::isnan(values[i])) continue;
    const bool is_further = wants_high ? values[i] > extreme.value : values[i] < extreme.value;
    if (extreme.is_known() && !is_further) continue;
    extreme = {.value = values[i], .at_us = data.times_us[i], .place = place};
  }
}

class Cards {
 public:
  explicit Cards(std::int64_t sample_us) : sample_us_(sample_us) {}

  /// Precondition: `value` and `more` are HTML.
  void add(std::string_view name, const std::string& value, const std::string& more = "") {
    out_ += "<div><dt>" + escaped(name) + "</dt><dd>" + value + (more.empty() ? "" : "<small>" + more + "</small>") +
            "</dd></div>\n";
  }
  void add(std::string_view name, const Extreme& extreme, int digits, std::string_view unit) {
    if (!extreme.is_known()) return;
    const std::string place = extreme.place.empty() ? "" : extreme.place + ", ";
    add(name, number(static_cast<double>(extreme.value), digits) + " " + std::string(unit),
        escaped(place + sample_text(extreme.at_us, sample_us_)));
  }
  [[nodiscard]] std::string html() const { return "<dl class=\"cards\">\n" + out_ + "</dl>\n"; }

 private:
  std::int64_t sample_us_;
  std::string out_;
};

template <class Iterator>
std::optional<float> known_between(Iterator first, Iterator end) {
  const auto found = std::find_if(first, end, [](float value) { return !std::isnan(value); });
  return found == end ? std::nullopt : std::optional(*found);
}

std::optional<float> first_known(const std::vector<float>& values) {
  return known_between(values.begin(), values.end());
}

std::optional<float> last_known(const std::vector<float>& values) {
  return known_between(values.rbegin(), values.rend());
}

void add_charge(Cards& cards, const ReportData& data) {
  const auto first = first_known(data.soc_percent.mean);
  const auto last = last_known(data.soc_percent.mean);
  if (!first || !last) return;
  const auto doubt = last_known(data.soc_doubt_percent.mean);
  cards.add("State of charge",
            number(static_cast<double>(*first)) + " % to " + number(static_cast<double>(*last)) + " %",
            doubt ? "± " + number(static_cast<double>(*doubt)) + " % at the end, in 95 of 100 cases" : "");
}

std::string energy_text(double energy_Wh) {
  return energy_Wh < 1000 ? number(energy_Wh) + " Wh" : number(energy_Wh / 1000, 2) + " kWh";
}

void add_energy_left(Cards& cards, const ReportData& data) {
  const Figure& left = data.energy_left_Wh;
  if (std::isnan(left.value)) return;
  cards.add("Energy left", energy_text(static_cast<double>(left.value)),
            std::isnan(left.doubt)
                ? ""
                : "± " + energy_text(static_cast<double>(left.doubt)) + " at the end, in 95 of 100 cases");
}

void add_flow(Cards& cards, std::string_view name, std::optional<double> energy_Wh, std::optional<double> charge_Ah) {
  if (!energy_Wh) return;
  cards.add(name, energy_text(*energy_Wh), charge_Ah ? number(*charge_Ah, 3) + " Ah" : "");
}

void add_extremes(Cards& cards, const ReportData& data) {
  Extreme lowest;
  Extreme highest;
  for (const CellReport& cell : data.cells) {
    take(lowest, cell.voltage_V, false, "cell " + cell.name, data);
    take(highest, cell.voltage_V, true, "cell " + cell.name, data);
  }
  cards.add("Lowest cell", lowest, 4, "V");
  cards.add("Highest cell", highest, 4, "V");
  Extreme coldest;
  Extreme hottest;
  for (const SensorReport& sensor : data.sensors) {
    take(coldest, sensor.temperature_C, false, sensor.name, data);
    take(hottest, sensor.temperature_C, true, sensor.name, data);
  }
  cards.add("Hottest", hottest, 1, "°C");
  cards.add("Coldest", coldest, 1, "°C");
  Extreme drawn;
  Extreme charged;
  take(drawn, data.current_A, true, "", data);
  take(charged, data.current_A, false, "", data);
  if (drawn.value > 0) cards.add("Largest current drawn", drawn, 2, "A");
  if (charged.value < 0) {
    charged.value = -charged.value;
    cards.add("Largest current charged", charged, 2, "A");
  }
}

void add_faults(Cards& cards, const ReportData& data) {
  std::set<std::string> faults;
  std::set<std::string> warnings;
  for (const SpanReport& span : data.spans) {
    if (span.kind == SpanKind::fault) faults.insert(span.text);
    if (span.kind == SpanKind::warning) warnings.insert(span.text);
  }
  const auto list = [](const std::set<std::string>& names) {
    constexpr std::size_t names_max = 3;
    std::string text;
    std::size_t count = 0;
    for (const std::string& name : names) {
      if (++count > names_max) break;
      text += (text.empty() ? "" : "; ") + name;
    }
    return escaped(text) + (names.size() > names_max ? "; and more" : "");
  };
  const std::string count = std::to_string(faults.size());
  cards.add("Faults", faults.empty() ? "none" : "<b class=\"fault\">" + count + "</b>", list(faults));
  if (!warnings.empty()) {
    cards.add("Warnings", "<b class=\"warning\">" + std::to_string(warnings.size()) + "</b>", list(warnings));
  }
}

/// Adds the sum of all gaps, and the first of them.
void add_holes(Cards& cards, const ReportData& data) {
  if (data.holes.empty()) return;
  const bool is_damaged =
      std::any_of(data.holes.begin(), data.holes.end(), [](const HoleReport& hole) { return hole.is_damage; });
  const std::size_t count = data.holes.size();
  const std::int64_t missing = missing_us(data);
  const std::string value = missing > 0 ? span_text(missing) : "a part";
  const std::string more = count == 1 ? "" : ", and " + std::to_string(count - 1) + " more";
  cards.add("Missing", is_damaged ? "<b class=\"fault\">" + value + "</b>" : value,
            escaped(when_text(data.holes.front()) + more));
}

}  // namespace

std::string summary_html(const ReportData& data) {
  Cards cards(data.sample_us);
  const std::int64_t span_us = data.to_us() - data.from_us();
  const std::int64_t covered_us =
      data.covered_us.value_or(static_cast<std::int64_t>(data.times_us.size()) * data.sample_us);
  cards.add("Span", span_text(span_us), time_text(data.from_us()) + " to " + time_text(data.to_us()) + " UTC");
  cards.add("Covered by samples", span_text(std::min(covered_us, span_us)), "one per " + span_text(data.sample_us));
  add_holes(cards, data);
  add_charge(cards, data);
  add_energy_left(cards, data);
  add_flow(cards, "Energy out", data.energy_out_Wh, data.charge_out_Ah);
  add_flow(cards, "Energy in", data.energy_in_Wh, data.charge_in_Ah);
  add_extremes(cards, data);
  add_faults(cards, data);
  return cards.html();
}

}  // namespace bmu::report

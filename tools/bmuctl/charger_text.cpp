// The page of the chargers: stage of the charge, requested current, output and status of each unit.
#include <utility>

#include "tools/bmuctl/text_pages.hpp"

namespace bmu {

namespace {

Line stage_of(const Reply& charger) {
  const Reply since = charger["stage_for_ms"];
  Line line{plain(charger["stage"].text() + (since.is_known() ? " for " + shown_span(since) : ""))};
  if (charger["is_held"].is_true()) line.push_back(plain(", the highest cell is held at its full voltage"));
  if (charger["goes_on_when_heard"].is_true())
    line.push_back({"   continues when its reports are received again", Style::warning});
  return line;
}

/// The state of the plug by contacts and inputs, which may be unknown.
std::string plug_of(const Reply& inputs) {
  if (!inputs["charger_connected"].is_known()) return "not known";
  return inputs["charger_connected"].is_true() ? "yes" : "no";
}

/// Request to all units together. While no charge is active, they are commanded to stop.
Line asked_of(const Reply& charger) {
  const bool is_asked = charger["asked_mA"].number_or(0) > 0;
  const std::string most =
      "up to " + shown(charger["asked_mV"], Unit::mV) + ", a cell to " + shown(charger["cell_full_uV"], Unit::uV);
  return {plain(is_asked ? shown(charger["asked_mA"], Unit::mA) : "stop commanded"), {"   " + most, Style::dim}};
}

Line voice_of(const Reply& unit) {
  const Reply ago = unit["heard_ago_ms"];
  if (unit["is_talking"].is_true()) return {plain("received " + shown_span(ago) + " ago")};
  return {{ago.is_known() ? "silent for " + shown_span(ago) : "not received yet", Style::warning}};
}

/// Unknown values are omitted.
std::string mains_of(const Reply& unit) {
  std::string text;
  if (unit["mains_voltage_mV"].is_known()) text = shown(unit["mains_voltage_mV"], Unit::mV);
  if (unit["mains_current_mA"].is_known()) {
    text += (text.empty() ? "" : "   ") + shown(unit["mains_current_mA"], Unit::mA);
  }
  return text;
}

Line trouble_of(const Reply& unit) {
  const std::string troubles = shown_list(unit["troubles"]);
  if (troubles.empty()) return {plain("none reported")};
  return {{troubles, Style::warning}};
}

void add_unit(Page& page, const Reply& unit, bool is_alone) {
  if (!is_alone) page.add({});
  page.add_field(is_alone ? "Charger" : "Unit " + shown(unit["unit"], Unit::none), voice_of(unit));
  page.add_field("Output", {plain(shown(unit["current_mA"], Unit::mA) + " at " + shown(unit["voltage_mV"], Unit::mV))});
  if (const std::string mains = mains_of(unit); !mains.empty()) page.add_field("Mains", {plain(mains)});
  if (unit["temperature_dC"].is_known()) {
    page.add_field("Temperature", {plain(shown(unit["temperature_dC"], Unit::dC))});
  }
  page.add_field("Trouble", trouble_of(unit));
  page.add_field("Refused", {{shown(unit["frames_refused"], Unit::none) + " frames, " +
                                  shown(unit["values_out_of_range"], Unit::none) + " values out of range, " +
                                  shown(unit["values_unknown"], Unit::none) + " not known",
                              Style::dim}});
}

}  // namespace

bool has_no_charger(const Reply& status) {
  return !status["charger"].is_known();
}

Page charger_page(const Reply& status) {
  Page page;
  const Reply charger = status["charger"];
  if (!charger.is_known()) {
    page.add_field("Charger", {plain("none is driven: section charger of the pack file")});
    return page;
  }
  const Reply units = charger["units"];
  page.add_field("Protocol", {plain(charger["protocol"].text())});
  page.add_field("Plugged in", {plain(plug_of(status["state"]["inputs"]))});
  page.add_field("Charge", stage_of(charger));
  page.add_field("Request", asked_of(charger));
  for (std::size_t index = 0; index < units.size(); ++index) add_unit(page, units.at(index), units.size() == 1);
  return page;
}

}  // namespace bmu

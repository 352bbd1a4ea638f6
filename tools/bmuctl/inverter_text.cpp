// The page of the inverter: whether it is received, the values sent to it, the values it reports.
#include <utility>

#include "tools/bmuctl/text_pages.hpp"

namespace bmu {

namespace {

Line voice_of(const Reply& inverter) {
  const Reply ago = inverter["heard_ago_ms"];
  if (inverter["is_talking"].is_true()) return {plain("received " + shown_span(ago) + " ago")};
  const bool is_silent = inverter["is_silent"].is_true();
  const std::string since = is_silent ? "silent for " : "not received for ";
  return {{ago.is_known() ? since + shown_span(ago) : "not received yet", is_silent ? Style::bad : Style::dim}};
}

Line trouble_of(const Reply& inverter) {
  const std::string number = ", number " + shown(inverter["error_number"], Unit::none);
  if (inverter["has_failed"].is_true()) return {{"failed" + number, Style::bad}};
  if (inverter["has_warning"].is_true()) return {{"warns" + number, Style::warning}};
  return {plain("none reported")};
}

std::string requests_of(const Reply& told) {
  std::string text;
  if (told["asks_for_charge"].is_true()) text = "to charge";
  if (told["asks_for_full_charge"].is_true()) text += text.empty() ? "a full charge" : ", a full charge";
  return text.empty() ? "nothing" : text;
}

}  // namespace

Line inverter_line(const Reply& inverter) {
  const Reply told = inverter["told"];
  Line line = voice_of(inverter);
  line.push_back({"   may charge " + shown(told["charge_limit_mA"], Unit::mA) + ", discharge " +
                      shown(told["discharge_limit_mA"], Unit::mA),
                  Style::dim});
  if (inverter["has_failed"].is_true()) line.push_back({"   failed", Style::bad});
  return line;
}

bool has_no_inverter(const Reply& status) {
  return !status["inverter"].is_known();
}

Page inverter_page(const Reply& status) {
  Page page;
  const Reply inverter = status["inverter"];
  if (!inverter.is_known()) {
    page.add_field("Inverter", {plain("none configured: section inverter of the pack file")});
    return page;
  }
  const Reply told = inverter["told"];
  page.add_field("Protocol", {plain(inverter["protocol"].text())});
  page.add_field("Keep-alive", voice_of(inverter));
  page.add_field("Charge", {plain("up to " + shown(told["charge_limit_mA"], Unit::mA) + ", to " +
                                  shown(told["charge_voltage_limit_mV"], Unit::mV))});
  page.add_field("Discharge", {plain("up to " + shown(told["discharge_limit_mA"], Unit::mA) + ", to " +
                                     shown(told["discharge_voltage_limit_mV"], Unit::mV))});
  page.add_field("Reported", {plain("SOC " + shown(told["soc_permille"], Unit::permille) + "   SOH " +
                                    shown(told["soh_permille"], Unit::permille))});
  page.add_field("Request", {plain(requests_of(told))});
  page.add_field("Measured",
                 {plain(shown(inverter["voltage_mV"], Unit::mV) + "   " + shown(inverter["current_mA"], Unit::mA) +
                        "   " + shown(inverter["temperature_dC"], Unit::dC))});
  page.add_field("Trouble", trouble_of(inverter));
  page.add_field("Frames", {{shown(inverter["frames_taken"], Unit::none) + " taken, " +
                                 shown(inverter["frames_refused"], Unit::none) + " refused, " +
                                 shown(inverter["values_out_of_range"], Unit::none) + " values out of range",
                             Style::dim}});
  return page;
}

}  // namespace bmu

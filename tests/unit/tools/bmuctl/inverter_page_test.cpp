// Page of the inverter, from the reply of the daemon.
#include <string>

#include "tests/support/catch.hpp"
#include "tools/bmuctl/text_pages.hpp"

namespace bmu {

namespace {

using Json = nlohmann::json;

Json answer() {
  return {{"inverter",
           {{"protocol", "sma"},
            {"is_talking", true},
            {"is_silent", false},
            {"heard_ago_ms", 400},
            {"has_failed", false},
            {"has_warning", false},
            {"error_number", 0},
            {"voltage_mV", 53'200},
            {"current_mA", 20'000},
            {"temperature_dC", nullptr},
            {"told",
             {{"charge_limit_mA", 50'000},
              {"discharge_limit_mA", 100'000},
              {"charge_voltage_limit_mV", 56'000},
              {"discharge_voltage_limit_mV", 44'800},
              {"asks_for_charge", false},
              {"asks_for_full_charge", false},
              {"soc_permille", 720},
              {"soh_permille", nullptr}}},
            {"frames_taken", 12},
            {"frames_refused", 1},
            {"values_out_of_range", 3}}}};
}

std::string page_of(const Json& status) {
  return inverter_page(Reply(status)).text(false);
}
bool has(const std::string& text, const std::string& words) {
  return text.find(words) != std::string::npos;
}

}  // namespace

TEST_CASE("the inverter's page says what it is told and what it says", "[unit][bmuctl][inverter]") {
  const std::string page = page_of(answer());
  INFO(page);
  CHECK(has(page, "sma"));
  CHECK(has(page, "received"));
  CHECK(has(page, "none reported"));
  CHECK(has(page, "nothing"));
  CHECK(has(page, "12 taken, 1 refused, 3 values out of range"));
  CHECK(has(page_of(Json{{"inverter", nullptr}}), "none configured"));
}

TEST_CASE("silence, failures and requests are told in words", "[unit][bmuctl][inverter]") {
  Json status = answer();
  Json& inverter = status["inverter"];
  inverter["is_talking"] = false;
  CHECK(has(page_of(status), "not received for"));  // for an open pack, or before its time is over
  inverter["is_silent"] = true;
  CHECK(has(page_of(status), "silent for"));
  inverter["heard_ago_ms"] = nullptr;
  CHECK(has(page_of(status), "not received yet"));
  inverter["has_warning"] = true;
  inverter["error_number"] = 952;
  CHECK(has(page_of(status), "warns, number 952"));
  inverter["has_failed"] = true;
  CHECK(has(page_of(status), "failed, number 952"));
  inverter["told"]["asks_for_full_charge"] = true;
  CHECK(has(page_of(status), "a full charge"));
  inverter["told"]["asks_for_charge"] = true;
  CHECK(has(page_of(status), "to charge, a full charge"));
  std::string line;
  for (const Span& part : inverter_line(Reply(inverter))) line += part.text;
  CHECK(has(line, "failed"));
  CHECK(has(line, "may charge"));
}

}  // namespace bmu

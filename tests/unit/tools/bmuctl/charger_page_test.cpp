// Page of the chargers, from the reply of the daemon.
#include <string>

#include "tests/support/catch.hpp"
#include "tools/bmuctl/text_pages.hpp"

namespace bmu {

namespace {

using Json = nlohmann::json;

Json unit(int number) {
  return {{"unit", number},
          {"is_talking", true},
          {"heard_ago_ms", 400},
          {"voltage_mV", 201'600},
          {"current_mA", 9'800},
          {"mains_voltage_mV", nullptr},
          {"mains_current_mA", nullptr},
          {"temperature_dC", nullptr},
          {"troubles", Json::array()},
          {"frames_refused", 3},
          {"values_out_of_range", 2},
          {"values_unknown", 1}};
}

Json answer(const Json& units) {
  return {{"state", {{"inputs", {{"charger_connected", true}}}}},
          {"charger",
           {{"protocol", "elcon_tc"},
            {"stage", "charging"},
            {"stage_for_ms", 90'000},
            {"is_held", false},
            {"goes_on_when_heard", false},
            {"asked_mA", 10'000},
            {"asked_mV", 201'600},
            {"cell_full_uV", 4'150'000},
            {"units", units}}}};
}

std::string page_of(const Json& status) {
  return charger_page(Reply(status)).text(false);
}
bool has(const std::string& text, const std::string& words) {
  return text.find(words) != std::string::npos;
}

}  // namespace

TEST_CASE("the chargers' page says where the charge is, what is asked for and what is given",
          "[unit][bmuctl][charger]") {
  const std::string page = page_of(answer(Json::array({unit(1)})));
  INFO(page);
  for (const char* const words :
       {"elcon_tc", "charging for", "Plugged in", "yes", "10.000 A", "up to 201.600 V", "a cell to 4.1500 V",
        "received ", "9.800 A at 201.600 V", "none reported", "3 frames, 2 values out of range, 1 not known"}) {
    CHECK(has(page, words));
  }
  CHECK_FALSE(has(page, "Temperature"));
  CHECK_FALSE(has(page, "Mains"));
  CHECK_FALSE(has_no_charger(Reply(answer(Json::array({unit(1)})))));
}

TEST_CASE("each charger has its own part, with its troubles and its silence", "[unit][bmuctl][charger]") {
  Json second = unit(2);
  second["is_talking"] = false;
  second["heard_ago_ms"] = 7'000;
  second["current_mA"] = second["voltage_mV"] = nullptr;
  Json first = unit(1);
  first["troubles"] = {"its mains are missing"};
  first["temperature_dC"] = 415;
  first["mains_voltage_mV"] = 230'000;
  Json status = answer(Json::array({first, second}));
  status["charger"]["asked_mA"] = 0;
  status["charger"]["goes_on_when_heard"] = true;
  status["state"]["inputs"] = nullptr;
  const std::string page = page_of(status);
  INFO(page);
  for (const char* const words : {"Unit 1", "Unit 2", "silent for", "its mains are missing", "41.5", "230.000 V",
                                  "stop commanded", "continues when its reports are received again", "not known"}) {
    CHECK(has(page, words));
  }
  second["heard_ago_ms"] = nullptr;
  CHECK(has(page_of(answer(Json::array({first, second}))), "not received yet"));
}

TEST_CASE("a pack without a charger or an inverter says so, and falls short", "[unit][bmuctl][charger][inverter]") {
  const Json none{{"charger", nullptr}, {"inverter", nullptr}};
  CHECK(has(page_of(none), "section charger of the pack file"));
  CHECK(has_no_charger(Reply(none)));
  CHECK(has_no_inverter(Reply(none)));
  const Json inverter{{"inverter", {{"protocol", "sma"}}}};
  CHECK_FALSE(has_no_inverter(Reply(inverter)));
}

}  // namespace bmu

// Contacts and inputs in JSON: each under its name, and null if the line that provides it cannot be read.
#include "daemon/shell/json/switches_json.hpp"

#include <functional>
#include <set>
#include <string>

#include <nlohmann/json.hpp>

#include "tests/support/catch.hpp"

using namespace bmu;

namespace {

using Json = nlohmann::ordered_json;

Json object_of(const std::function<void(JsonText&)>& put) {
  JsonText to;
  to.object([&] { put(to); });
  return Json::parse(to.take());
}

Json feedback(const PduState& pdu, const LinesConfig* missing = nullptr) {
  return object_of([&](JsonText& to) { put_feedback(to, pdu, missing); })["feedback"];
}
Json inputs(const PduState& pdu, const LinesConfig* missing = nullptr) {
  return object_of([&](JsonText& to) { put_inputs(to, pdu, missing); })["inputs"];
}

/// Names of the null values.
std::set<std::string> unknown_in(const Json& object) {
  std::set<std::string> names;
  for (const auto& [name, value] : object.items()) {
    if (value.is_null()) names.insert(name);
  }
  return names;
}

/// Names of the values that are on.
std::set<std::string> on_in(const Json& object) {
  std::set<std::string> names;
  for (const auto& [name, value] : object.items()) {
    if (value == true) names.insert(name);
  }
  return names;
}

}  // namespace

TEST_CASE("each output, contact and input is told by its own name", "[unit][status]") {
  struct Bit {
    const char* name;
    bool PduState::*bit;
  };
  for (const Bit& one : {Bit{"main_positive", &PduState::main_positive_closed},
                         {"main_negative", &PduState::main_negative_closed},
                         {"precharge", &PduState::precharge_closed},
                         {"charge", &PduState::charge_closed},
                         {"opened_by_timeout", &PduState::opened_by_timeout},
                         {"alarm_loop_open", &PduState::alarm_loop_open}}) {
    PduState pdu{.supply_ok = false};
    pdu.*one.bit = true;
    CHECK(on_in(feedback(pdu)) == std::set<std::string>{one.name});
    CHECK(on_in(inputs(pdu)).empty());
  }
  for (const Bit& one : {Bit{"vehicle_on", &PduState::vehicle_on},
                         {"charger_connected", &PduState::charger_connected},
                         {"estop_1_released", &PduState::estop_1_released},
                         {"estop_2_released", &PduState::estop_2_released},
                         {"interlock_closed", &PduState::interlock_closed},
                         {"insulation_monitor_ok", &PduState::insulation_monitor_ok},
                         {"resume_button", &PduState::resume_button},
                         {"supply_ok", &PduState::supply_ok}}) {
    PduState pdu{.supply_ok = false};
    pdu.*one.bit = true;
    CHECK(on_in(inputs(pdu)) == std::set<std::string>{one.name});
    CHECK(on_in(feedback(pdu)).empty());
  }
  const Json outputs = object_of([](JsonText& to) { put_outputs(to, {.precharge = true, .heater = true}); })["outputs"];
  CHECK(on_in(outputs) == std::set<std::string>{"precharge", "heater"});
  CHECK(outputs.size() == 7);
}

TEST_CASE("inputs on lines of this machine are told by their number", "[unit][status]") {
  const Json told = inputs({.estops_pressed = 0b110, .interlocks_open = 0b1});
  CHECK(told["estops_pressed"] == Json{2, 3});
  CHECK(told["interlocks_open"] == Json::array({1}));
  CHECK(unknown_in(told) == std::set<std::string>{"throttle_permille", "insulation_resistance_Ohm"});
}

TEST_CASE("the insulation's resistance is in the status, with the state of its monitor", "[unit][status][BMU_5]") {
  const Json measured =
      inputs({.insulation_state = InsulationState::normal, .insulation_resistance_Ohm = known(123'456)});
  CHECK(measured["insulation_resistance_Ohm"] == 123'456);
  CHECK(measured["insulation_resistance_validity"] == "valid");
  CHECK(measured["insulation_state"] == "normal");
  const Json lost = inputs({.insulation_state = InsulationState::device_error,
                            .insulation_resistance_Ohm = not_known(Validity::sensor_fault)});
  CHECK(lost["insulation_resistance_Ohm"].is_null());
  CHECK(lost["insulation_resistance_validity"] == to_text(Validity::sensor_fault));
  CHECK(lost["insulation_state"] == to_text(InsulationState::device_error));
}

TEST_CASE("what a line that cannot be read would tell is null", "[unit][status]") {
  const PduState all{.main_positive_closed = true,
                     .charge_closed = true,
                     .vehicle_on = true,
                     .insulation_resistance_Ohm = known(1),
                     .throttle_permille = known(2)};
  const LinesConfig none{};
  CHECK(unknown_in(feedback(all, &none)).empty());
  CHECK(unknown_in(inputs(all, &none)) == std::set<std::string>{"estops_pressed", "interlocks_open"});
  const LinesConfig two_contacts{.feedback = 0b1001};
  CHECK(unknown_in(feedback(all, &two_contacts)) == std::set<std::string>{"main_positive", "charge"});
  const LinesConfig some_inputs{.has_vehicle_on = true, .has_insulation_ok = true, .has_supply_ok = true};
  CHECK(unknown_in(inputs(all, &some_inputs)) ==
        std::set<std::string>{"vehicle_on", "insulation_monitor_ok", "supply_ok", "estops_pressed", "interlocks_open"});
  const LinesConfig others{.has_charger_connected = true, .has_resume_button = true};
  CHECK(unknown_in(inputs(all, &others)) ==
        std::set<std::string>{"charger_connected", "resume_button", "estops_pressed", "interlocks_open"});
}

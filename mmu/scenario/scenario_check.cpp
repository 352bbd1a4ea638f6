#include "mmu/scenario/scenario_check.hpp"

#include <algorithm>
#include <optional>
#include <string>

#include "mmu/scenario/scenario_state.hpp"
#include "protocol/tables/internal_bus.hpp"

namespace bmu {

namespace {

bool is_met(ModuleNeed need, const ModuleDriver* driver) {
  const bool is_foreign = driver != nullptr;
  switch (need) {
    case ModuleNeed::any: break;
    case ModuleNeed::ours: return !is_foreign;
    case ModuleNeed::foreign: return is_foreign;
    case ModuleNeed::protection: return !is_foreign || driver->has_checksum;
    case ModuleNeed::board_sensor: return !is_foreign || driver->has_board_temperature;
    case ModuleNeed::errors: return is_foreign && driver->tells_errors;
  }
  return true;
}

std::string maker_of(const SimulatorConfig& config) {
  return config.foreign.driver == nullptr ? "ours" : std::string(config.foreign.driver->name);
}

/// Expected value if third-party modules have the property but not this value; otherwise empty.
std::string value_wanted_instead(const ScenarioEvent& event, const ModuleDriver& driver) {
  const bool sends_as =
      event.property == Property::module_sends_as_node && event.value.kind == ScenarioValue::Kind::number;
  if (sends_as && event.value.number > driver.node_max) {
    return "a node 1 to " + std::to_string(driver.node_max) + ", which modules of " + std::string(driver.name) +
           " can have";
  }
  const auto group = static_cast<OmittedFrames>(event.value.word);
  const bool omits = event.property == Property::module_omits && group != OmittedFrames::nothing;
  if (omits && !has_frames(driver, group)) {
    return "frames that modules of " + std::string(driver.name) + " have: these have none of that kind";
  }
  return "";
}

/// Whether the condition is about MMU frames, which third-party modules neither send nor receive.
bool is_of_our_modules(const ScenarioCondition& condition) {
  return condition.message != nullptr && (condition.message->has_node() || condition.message == &internal_bus::poll);
}

/// Empty if the line is valid for modules of this manufacturer, otherwise the expected text.
std::string wanted_of_modules(const ScenarioLine& line, const SimulatorConfig& config) {
  const ModuleDriver* driver = config.foreign.driver;
  if (line.verb == ScenarioVerb::event) {
    const ModuleNeed need = spec_of(line.event.property).need;
    if (!is_met(need, driver)) {
      return "an event for this pack's modules (" + maker_of(config) + "): " + std::string(to_text(need)) +
             " have this one";
    }
    return driver == nullptr ? "" : value_wanted_instead(line.event, *driver);
  }
  const bool is_plain = line.condition.is_by_identifier && !line.condition.signal;
  const bool names_ours = is_of_our_modules(line.condition) && !is_plain;
  if (driver == nullptr || !names_ours) return "";
  return "a frame by its identifier, as in frame 0x103: modules of " + std::string(driver->name) + " have none of ours";
}

/// Target that the line names; none for lines without a target in the pack.
struct Named {
  TargetKind target{};
  ScenarioPlace place{};
};
std::optional<Named> named_by(const ScenarioLine& line) {
  if (line.verb == ScenarioVerb::event) return Named{spec_of(line.event.property).target, line.event.place};
  if (line.condition.state != nullptr) return Named{line.condition.state->target, line.condition.place};
  return std::nullopt;
}

/// Empty if the pack has the target, otherwise the expected text.
std::string wanted_instead(const Named& named, const SimulatorConfig& config) {
  const ScenarioPlace place = named.place;
  const bool is_second_sensor =
      named.target == TargetKind::sensor && place.index == static_cast<std::uint8_t>(ScriptedResult::current_2);
  if (is_second_sensor && !config.sensor.has_second) {
    return "a sensor this pack has: it has no second current sensor";
  }
  if (place.node == 0 || named.target == TargetKind::stranger) return "";
  const auto module = std::find_if(config.modules.begin(), config.modules.end(),
                                   [place](const MmuConfig& one) { return one.node == place.node; });
  if (module == config.modules.end()) {
    return "a module this pack has: it has no node " + std::to_string(place.node);
  }
  if (named.target == TargetKind::cell && place.index >= module->cell_count) {
    return "cell 1 to " + std::to_string(module->cell_count) + " of that module";
  }
  if (named.target == TargetKind::thermistor && place.index >= module->temperature_sensor_count) {
    return "sensor 1 to " + std::to_string(module->temperature_sensor_count) + " of that module";
  }
  if (named.target == TargetKind::board_thermistor && place.index >= module->board_sensor_count) {
    return "sensor 1 to " + std::to_string(module->board_sensor_count) + " on that module's board";
  }
  return "";
}

/// Checks targets that only some packs have, in events and conditions.
std::string wanted_of_target(TargetKind target, const SimulatorConfig& config) {
  if (target == TargetKind::sensor_unit && config.sensor_set_up == nullptr) {
    return "a sensor that can be configured: the pack file names none in sensor/protocol";
  }
  if (target == TargetKind::second_pack && config.second_pack.base_id == 0) {
    return "a second pack: the pack file has none (second_pack/base_id)";
  }
  if (target == TargetKind::inverter && config.inverter == nullptr) {
    return "an inverter: the pack file names none in inverter/protocol";
  }
  return "";
}

bool is_request(Property property) {
  return property == Property::vehicle_asks || property == Property::vehicle_asks_about;
}

bool is_of_driven_charger(Property property) {
  return property == Property::charger_mains || property == Property::charger_post ||
         property == Property::charger_units || property == Property::charger_trouble;
}

std::string troubles_of(const ChargerDriver& driver) {
  const std::span<const std::string_view> words = spec_of(Property::charger_trouble).words;
  std::string names{words.front()};
  for (std::size_t number = 1; number < words.size(); ++number) {
    const bool is_reported = (driver.reported_troubles & bit_of(static_cast<ChargerTrouble>(number - 1))) != 0;
    if (is_reported) names += ", " + std::string(words[number]);
  }
  return names;
}

std::string wanted_of_charger(Property property, const ScenarioValue& value, const SimulatorConfig& config) {
  if (config.charger == nullptr) {
    return "a charger that is driven over a bus: the pack file names none in charger/protocol";
  }
  if (property == Property::charger_units && value.number > config.charger_units) {
    return "units this pack has: 0 to " + std::to_string(config.charger_units) + " (charger/units)";
  }
  const bool is_trouble = property == Property::charger_trouble && value.word != 0;
  const std::uint16_t trouble = is_trouble ? bit_of(static_cast<ChargerTrouble>(value.word - 1)) : std::uint16_t{0};
  if ((trouble & config.charger->reported_troubles) != trouble) {
    return "a trouble that " + std::string(config.charger->name) + " has a word for: " + troubles_of(*config.charger);
  }
  return "";
}

/// Checks properties that only some packs have.
std::string wanted_of_property(Property property, const ScenarioValue& value, const SimulatorConfig& config) {
  if (is_of_driven_charger(property)) return wanted_of_charger(property, value, config);
  if (is_request(property) && config.request_id == 0) {
    return "a master that answers requests for data: the pack file has no vehicle/request_id";
  }
  if (property == Property::insulation_self_test && config.insulation == nullptr) {
    return "an insulation monitor on a bus: the pack file names none in insulation/protocol";
  }
  const bool is_of_signal = property == Property::insulation_frequency || property == Property::insulation_duty ||
                            property == Property::insulation_wire;
  const bool is_undervoltage = property == Property::insulation_monitor &&
                               value.word == static_cast<std::uint8_t>(InsulationMonitor::undervoltage);
  if (config.insulation != nullptr && (is_of_signal || is_undervoltage)) {
    return "something else: the monitor is on a bus (insulation/protocol), and has no such thing";
  }
  return "";
}

}  // namespace

Scenario meant_for(const SimulatorConfig& config, Scenario scenario) {
  for (ScenarioLine& line : scenario.lines) {
    const bool is_anothers = config.foreign.driver != nullptr && is_of_our_modules(line.condition);
    if (is_anothers) line.condition.message = nullptr;
  }
  return scenario;
}

ScenarioProblems check_against(const Scenario& scenario, const SimulatorConfig& config) {
  ScenarioProblems problems;
  for (const ScenarioLine& line : scenario.lines) {
    std::string wanted = wanted_of_modules(line, config);
    const std::optional<Named> named = named_by(line);
    if (wanted.empty() && named) wanted = wanted_instead(*named, config);
    if (wanted.empty() && named) wanted = wanted_of_target(named->target, config);
    const bool is_event = line.verb == ScenarioVerb::event;
    if (wanted.empty() && is_event) wanted = wanted_of_property(line.event.property, line.event.value, config);
    if (!wanted.empty()) problems.push_back({line.line, line.column, "'" + line.text + "'", std::move(wanted)});
  }
  return problems;
}

}  // namespace bmu

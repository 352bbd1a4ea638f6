#include "config/checks/sensor_checks.hpp"

#include <string_view>

#include "devices/lem_cab/lem_cab.hpp"
#include "devices/outlander_cmu/outlander_cmu.hpp"

namespace bmu {
namespace {

/// A key that contradicts another one.
struct Rule {
  std::string_view section;
  std::string_view key;
  std::string_view other;  // the other key, which must be valid itself
  bool (*is_broken)(const CoreConfig&);
  std::string_view found;
  std::string_view wanted;
};

/// A LEM CAB on the bus of an Outlander's modules is the car's own sensor, at 3C2h as in the car: its value is below
/// zero while the pack is discharged.
bool is_sensor_of_the_car(const CoreConfig& core, const CurrentSensorDriver* driver) {
  const bool has_its_modules = core.foreign.driver == &outlander_cmu::driver;
  return has_its_modules && driver == &lem_cab::driver && core.sensor.bus == Port::internal;
}
constexpr std::string_view wants_sensor_of_the_car =
    "\"outlander_current\", as the car's sensor counts discharge below zero; with invert_current if it was mounted the "
    "other way round";

constexpr Rule rules[] = {
    {"sensor", "set_up", "protocol",
     [](const CoreConfig& core) { return core.sensor.is_configured && core.sensor.set_up == nullptr; }, "\"configure\"",
     "\"verify\", or a protocol in which the sensor can be configured"},
    {"sensor", "store", "set_up",
     [](const CoreConfig& core) { return core.sensor.is_stored && !core.sensor.is_configured; }, "true",
     "false, as set_up is not \"configure\": nothing is stored that was not set"},
    {"sensor", "second_protocol", "has_second_current",
     [](const CoreConfig& core) { return core.sensor.second != nullptr && !core.sensor.has_second_current; },
     "a protocol", "nothing, as has_second_current is false"},
    {"sensor", "second_is_reversed", "has_second_current",
     [](const CoreConfig& core) { return core.sensor.is_second_reversed && !core.sensor.has_second_current; }, "true",
     "false, as has_second_current is false"},
    {"sensor", "second_command_id", "second_response_id",
     [](const CoreConfig& core) {
       return (core.sensor.second_command_id == 0) != (core.sensor.second_response_id == 0);
     },
     "one of second_command_id and second_response_id",
     "both, or neither: a second sensor whose settings are read must answer"},
    {"sensor", "second_command_id", "protocol",
     [](const CoreConfig& core) { return core.sensor.second_command_id != 0 && core.sensor.set_up == nullptr; },
     "an identifier", "nothing, because protocol names none with readable settings"},
    {"sensor", "second_command_id", "has_second_current",
     [](const CoreConfig& core) { return core.sensor.second_command_id != 0 && !core.sensor.has_second_at_531h(); },
     "an identifier", "nothing, as there is no second sensor at 531h (has_second_current, and no other protocol)"},
    {"sensor", "bus", "current_protocol",
     [](const CoreConfig& core) {
       return core.sensor.bus != Port::internal && core.sensor.first == nullptr && core.sensor.second == nullptr;
     },
     "a bus", "\"internal\", as neither current_protocol nor second_protocol names a sensor on another"},
    {"sensor", "current_protocol", "bus",
     [](const CoreConfig& core) { return is_sensor_of_the_car(core, core.sensor.first); }, "\"lem_cab\"",
     wants_sensor_of_the_car},
    {"sensor", "second_protocol", "bus",
     [](const CoreConfig& core) { return is_sensor_of_the_car(core, core.sensor.second); }, "\"lem_cab\"",
     wants_sensor_of_the_car},
    {"insulation", "monitoring", "protocol",
     [](const CoreConfig& core) {
       return core.insulation.driver != nullptr && core.insulation.monitoring != InsulationMonitoring::measured;
     },
     "\"ok_line\"", "\"measured\", because the monitor of insulation/protocol reports its resistance"},
    {"insulation", "monitoring", "protocol",
     [](const CoreConfig& core) {
       return core.insulation.has_pulse_line && core.insulation.driver == nullptr &&
              core.insulation.monitoring != InsulationMonitoring::measured;
     },
     "\"ok_line\"", "\"measured\", because the pulses on the line of gpio/insulation_pulses report a resistance"},
    {"gpio", "insulation_pulses", "",
     [](const CoreConfig& core) { return core.insulation.has_pulse_line && core.insulation.driver != nullptr; },
     "a line", "none, as insulation/protocol names a monitor already: a pack has one, on a bus or on a line"},
    {"insulation", "bus", "protocol",
     [](const CoreConfig& core) { return core.insulation.bus != Port::internal && core.insulation.driver == nullptr; },
     "a bus", "\"internal\", as insulation/protocol names no monitor"},
};

}  // namespace

void check_sensors_of_others(const PackConfig& pack, const Place& place, ProblemList& problems) {
  for (const Rule& rule : rules) {
    const Place section = place.at(rule.section);
    const bool can_be_judged = problems.is_good(section.at(rule.key)) && problems.is_good(section.at(rule.other));
    if (can_be_judged && rule.is_broken(pack.core)) {
      problems.add(section.at(rule.key), std::string(rule.found), std::string(rule.wanted));
    }
  }
}

}  // namespace bmu

// The script language of the emulated world: one event a line.
//
//   # comment, to the end of the line
//   TIME_S TARGET PROPERTY [VALUE]
//
//   1       vehicle on
//   3       load profile drive
//   12.3    cell 2.7 voltage_mV 2700              module 2 (its node number), cell 7
//   14      cell 2.7 voltage_mV auto              back to what the plant says
//   20      load current_A 0..40 over 2           a ramp
//   25      cell 2.7 voltage_mV ..2500 over 3     a ramp from what it is then
//
// Targets and properties are rows of two tables below: name, where it may stand, kind of value, range, meaning. The
// parser, its error messages, `mmusim --properties` and docs/scenarios.md all come from these rows.
//
// A line starts with a number today. Words there are reserved for later (repeat, wait, conditions).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/result.hpp"
#include "protocol/time.hpp"

namespace bmu {

enum class TargetKind : std::uint8_t {
  vehicle,
  charger,
  load,
  pack,
  cell,
  module,
  stranger,
  thermistor,
  sensor,
  pdu,
  contactor,
  estop,
  interlock,
  insulation,
  link,
  precharge,
  resume_button,
};

/// What follows the target's name.
enum class Address : std::uint8_t {
  none,
  node,       // 3
  node_cell,  // 3.12
  node_slot,  // 3.4: thermistor 4 of module 3
  word,       // one of `words`
};

struct TargetSpec {
  TargetKind kind;
  std::string_view name;
  Address address = Address::none;
  std::span<const std::string_view> words{};
};

enum class ValueKind : std::uint8_t {
  none,            // the property says it all
  number,          // 3, 2.5, or a ramp: 0..40 over 2
  number_or_auto,  // the same, or `auto`: what the plant says
  word,            // one of `words`
};

/// One enumerator a row of the property table, in its order.
enum class Property : std::uint8_t {
  vehicle_on,
  vehicle_off,
  charger_connected,
  charger_disconnected,
  charger_current,
  charger_runaway,
  charger_unstoppable,
  load_current,
  load_profile,
  pack_soc,
  pack_ambient,
  pack_temperature,
  cell_voltage,
  cell_offset,
  cell_soc,
  cell_resistance,
  cell_leak,
  cell_temperature,
  cell_wire,
  cell_stuck,
  module_silent,
  module_talking,
  module_restart,
  module_crc_errors,
  module_damaged_frames,
  module_stuck,
  module_frozen_counter,
  module_replay,
  module_omits,
  module_delay,
  module_sends_as_node,
  module_cell_count,
  module_protocol_version,
  module_serial_number,
  module_self_test,
  module_board_temperature,
  stranger_connected,
  stranger_disconnected,
  thermistor_state,
  sensor_silent,
  sensor_talking,
  sensor_offset_current,
  sensor_value_current,
  sensor_offset_voltage,
  sensor_value_voltage,
  sensor_stuck,
  sensor_inverted,
  sensor_error,
  pdu_silent,
  pdu_talking,
  pdu_damaged_frames,
  pdu_throttle,
  contactor_welded,
  contactor_stuck_open,
  contactor_ok,
  contactor_feedback,
  estop_pressed,
  estop_released,
  interlock_open,
  interlock_closed,
  insulation_resistance,
  insulation_monitor,
  insulation_frequency,
  insulation_duty,
  insulation_wire,
  link_capacitance,
  link_bleed,
  precharge_resistance,
  resume_button_pressed,
  resume_button_released,
};
inline constexpr std::size_t property_count = 70;

struct PropertySpec {
  Property property;
  TargetKind target;
  std::string_view name;
  ValueKind kind = ValueKind::none;
  double min = 0.0;
  double max = 0.0;
  std::span<const std::string_view> words{};
  std::string_view only_for{};  // targets with words: the words this property exists for, separated by spaces; or all
  std::string_view meaning;
};

[[nodiscard]] std::span<const TargetSpec> target_table();
[[nodiscard]] std::span<const PropertySpec> property_table();
[[nodiscard]] const PropertySpec& spec_of(Property property);

struct ScenarioValue {
  enum class Kind : std::uint8_t { none, number, ramp, ramp_from_present, automatic, word };
  Kind kind = Kind::none;
  double number = 0.0;  // the number, or where a ramp ends
  double from = 0.0;    // where a ramp starts
  Duration over{};
  std::uint8_t word = 0;  // index in the property's words
};

/// Where an event applies, counted from 0; what a target does not have is 0.
struct ScenarioPlace {
  std::uint8_t node = 0;   // the module's node number, 1 to 63
  std::uint8_t index = 0;  // cell or thermistor in it, or index of the target's word

  friend constexpr bool operator==(const ScenarioPlace&, const ScenarioPlace&) = default;
};

struct ScenarioEvent {
  Duration at{};  // from the start
  Property property{};
  ScenarioPlace place{};
  ScenarioValue value{};
  std::uint32_t line = 0;
  std::uint32_t target_column = 0;  // for problems found later, against a pack
  std::string text{};               // "cell 2.7 voltage_mV 2700": the line without time and comment
};

struct Scenario {
  std::vector<ScenarioEvent> events;  // by time; those of the same time in the order of the file
};

struct ScenarioProblem {
  std::uint32_t line = 0;  // both from 1
  std::uint32_t column = 0;
  std::string found;
  std::string wanted;
};
using ScenarioProblems = std::vector<ScenarioProblem>;

/// "demo.scn:12:9: found 'cel', wanted a target: vehicle, charger, ..."
[[nodiscard]] std::string to_text(const ScenarioProblem& problem, std::string_view file_name);

/// A whole scenario, or what is wrong: the first problem of every line that has one.
[[nodiscard]] Result<Scenario, ScenarioProblems> parse_scenario(std::string_view text);

/// One event without its time: "cell 2.7 voltage_mV 2700".
[[nodiscard]] Result<ScenarioEvent, ScenarioProblem> parse_event(std::string_view text);

/// The table of docs/scenarios.md.
[[nodiscard]] std::string property_table_markdown();

}  // namespace bmu

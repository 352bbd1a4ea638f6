// Script language of the emulated world: each line is an event, a condition, or one end of a block.
//
//   # comment, to the end of the line
//
//   [WHEN] TARGET PROPERTY [VALUE]                an event; its WHEN is required
//   [WHEN] wait CONDITION within SECONDS          the run fails if it is not met; later times count from this instant
//   [WHEN] expect CONDITION                       must be true at this time
//   [WHEN] always|never CONDITION [for SECONDS]   from then on, to the end of the run or for this time
//   [WHEN] pass | fail ["TEXT"]                   ends the run
//   [WHEN] repeat COUNT [every SECONDS]           repeats the lines up to `end`
//          end
//
//   WHEN       12.3      seconds from the start; after a wait, from the instant it was met; in a repeat, from the
//                        start of the repetition. Such lines may be in any order.
//              +2.5      seconds after the previous line
//              random 10..20, +random 1..5
//                        drawn from the seed of the run, in whole milliseconds
//              nothing   at the time of the previous line; not for events
//   VALUE      2700 | auto | on | 0..40 over 2 (a ramp) | ..2500 over 3 (a ramp from the present) | random 2700..3600
//   CONDITION  TARGET STATE                       contactor main_positive closed
//              TARGET STATE COMPARISON NUMBER     cell 2.7 soc_permille < 300
//              TARGET STATE = or != WORD          module 3 mode = asleep
//              frame NAME [NODE] [SIGNAL COMPARISON VALUE]
//                                                 frame CONTACTOR_COMMAND main_positive = 0; not after expect, always
//
// Comparisons are = != < <= > >=. Numbers have the unit the name ends with, everywhere. Targets, properties and states
// are rows of tables, frames and signals those of protocol/tables; parser, error messages, `mmusim --properties` and
// docs/scenarios.md come from these rows.
//
// parse_scenario() accepts a complete text or reports everything that is wrong with it; plan_scenario()
// (scenario_plan.hpp) draws the random values and expands repeats; ScenarioPlayer (scenario_player.hpp) executes the
// plan. A line that cannot be parsed causes one problem and nothing else: the lines around it are checked as if it were
// right.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/message.hpp"
#include "protocol/result.hpp"
#include "protocol/time.hpp"

namespace bmu {

enum class TargetKind : std::uint8_t {
  vehicle,
  charger,
  inverter,
  second_pack,
  load,
  pack,
  cell,
  module,
  stranger,
  thermistor,
  board_thermistor,
  sensor,
  sensor_unit,
  pdu,
  contactor,
  estop,
  interlock,
  insulation,
  link,
  precharge,
  resume_button,
  master,
};

/// Address after the target's name.
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
  none,            // the property has no value
  number,          // 3, 2.5, or a ramp: 0..40 over 2
  number_or_auto,  // the same, or `auto`: the value of the plant
  count,           // a whole number, no ramp: a count, or a code
  count_or_auto,   // the same, or `auto`
  word,            // one of `words`
};

[[nodiscard]] constexpr bool is_count(ValueKind kind) {
  return kind == ValueKind::count || kind == ValueKind::count_or_auto;
}
[[nodiscard]] constexpr bool may_be_auto(ValueKind kind) {
  return kind == ValueKind::number_or_auto || kind == ValueKind::count_or_auto;
}

/// One enumerator per row of the property table, in its order.
enum class Property : std::uint8_t {
  vehicle_on,
  vehicle_off,
  vehicle_asks,
  vehicle_asks_about,
  charger_connected,
  charger_disconnected,
  charger_current,
  charger_runaway,
  charger_unstoppable,
  charger_obeys,
  charger_mains,
  charger_post,
  charger_units,
  charger_trouble,
  charger_lead,
  charger_voltage,
  charger_senses,
  inverter_current,
  inverter_obeys,
  inverter_silent,
  inverter_talking,
  inverter_failed,
  second_pack_soc,
  second_pack_voltage,
  second_pack_current,
  second_pack_temperature,
  second_pack_state,
  second_pack_silent,
  second_pack_talking,
  load_current,
  load_profile,
  pack_soc,
  pack_ambient,
  pack_temperature,
  cell_voltage,
  cell_offset,
  cell_soc,
  cell_capacity,
  cell_resistance,
  cell_leak,
  cell_temperature,
  cell_wire,
  cell_stuck,
  cell_out_of_range,
  cell_balancing_switch,
  cell_undervoltage_flag,
  module_silent,
  module_talking,
  module_restart,
  module_crc_errors,
  module_crc_error_rate,
  module_crc_wrong_bits,
  module_damaged_frames,
  module_stuck,
  module_frozen_counter,
  module_replay,
  module_omits,
  module_delay,
  module_sends_as_node,
  module_cell_count,
  module_temperature_sensor_count,
  module_protocol_version,
  module_serial_number,
  module_commands,
  module_self_test,
  module_front_end_faults,
  module_front_end_supply,
  module_front_end_shutdown,
  module_errors,
  module_board_temperature,
  module_external_supply,
  module_talks_on_own_supply,
  module_converts,
  module_thermistor_curve,
  stranger_connected,
  stranger_disconnected,
  thermistor_state,
  thermistor_stuck,
  board_thermistor_state,
  board_thermistor_stuck,
  sensor_silent,
  sensor_talking,
  sensor_offset_current,
  sensor_value_current,
  sensor_offset_voltage,
  sensor_value_voltage,
  sensor_gain,
  sensor_stuck,
  sensor_inverted,
  sensor_error,
  sensor_unit_restart,
  sensor_unit_answers,
  sensor_unit_byte_order,
  sensor_unit_sign,
  sensor_unit_period,
  pdu_silent,
  pdu_talking,
  pdu_damaged_frames,
  pdu_throttle,
  pdu_intake_air,
  pdu_alarm_loop,
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
  insulation_self_test,
  link_capacitance,
  link_bleed,
  precharge_resistance,
  resume_button_pressed,
  resume_button_released,
  master_clear,
  master_clear_authorised,
  master_wake,
  master_balancing,
  master_accept_modules,
};
inline constexpr std::size_t property_count = 125;

/// Modules that a property requires; checked only when the script is combined with a pack (check_against).
enum class ModuleNeed : std::uint8_t {
  any,           // all modules
  ours,          // MMUs only
  foreign,       // third-party modules only
  protection,    // MMUs, and others with a counter and a checksum in their frames
  board_sensor,  // MMUs, and others that measure their board's temperature
  errors,        // third-party modules that report errors
};
[[nodiscard]] std::string_view to_text(ModuleNeed need);

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
  ModuleNeed need = ModuleNeed::any;
};

[[nodiscard]] std::span<const TargetSpec> target_table();
[[nodiscard]] std::span<const PropertySpec> property_table();
[[nodiscard]] const PropertySpec& spec_of(Property property);

struct ScenarioValue {
  enum class Kind : std::uint8_t { none, number, ramp, ramp_from_present, automatic, word };
  Kind kind = Kind::none;
  bool is_random = false;  // number: still to be drawn, from `from` to `number`
  double number = 0.0;     // the number, or the end of a ramp
  double from = 0.0;       // start of a ramp
  Duration over{};
  std::uint8_t word = 0;  // index in the property's words
};

/// Where an event applies; the index counts from 0. Members that a target does not have are 0.
struct ScenarioPlace {
  std::uint8_t node = 0;   // the module's node number, 1 to 63
  std::uint8_t index = 0;  // cell or thermistor in it, or index of the target's word

  friend constexpr bool operator==(const ScenarioPlace&, const ScenarioPlace&) = default;
};

struct ScenarioEvent {
  Property property{};
  ScenarioPlace place{};
  ScenarioValue value{};
  std::string text{};  // "cell 2.7 voltage_mV 2700": the line without time and comment
};

enum class Comparison : std::uint8_t { none, equal, not_equal, less, less_or_equal, greater, greater_or_equal };
[[nodiscard]] bool holds(Comparison comparison, double found, double wanted);

struct StateSpec;  // a row of the states that can be queried: scenario_state.hpp

struct ScenarioCondition {
  Comparison comparison = Comparison::none;
  double wanted = 0.0;               // number in the unit of the name, or index of a word
  bool wants_not_known = false;      // instead: the sender has no number; only with = and !=
  const StateSpec* state = nullptr;  // null: the condition is about frames
  ScenarioPlace place{};
  std::span<const std::string_view> words{};  // meaning of the state's indices, if it is a word
  std::uint32_t frame_id = 0;
  bool is_by_identifier = false;         // the line has no name
  bool is_any_node = false;              // every node's frame of this message; frame_id is the first one's
  const MessageSpec* message = nullptr;  // null: an identifier without a row
  std::optional<std::uint8_t> signal{};  // none: the frame itself is expected
  std::string text{};                    // as in the line
};

enum class ScenarioVerb : std::uint8_t { event, wait, expect, always, never, pass, fail, repeat, end };

/// Time of a line, see above. `from` and `to` are the same unless it is random.
struct ScenarioTime {
  enum class Kind : std::uint8_t { as_before, absolute, relative };
  Kind kind = Kind::as_before;
  Duration from{};
  Duration to{};
};

struct ScenarioLine {
  std::uint32_t line = 0;    // both from 1
  std::uint32_t column = 0;  // of the target or verb, after the time
  ScenarioVerb verb = ScenarioVerb::event;
  ScenarioTime time{};
  ScenarioEvent event{};          // event
  ScenarioCondition condition{};  // wait, expect, always, never
  Duration limit{};               // wait: within; always, never: for, 0 to the end of the run
  std::uint32_t count = 0;        // repeat
  Duration every{};               // repeat; 0: a repetition starts with the last line of the previous one
  std::size_t partner = 0;        // repeat: index of its end; end: of its repeat
  std::string text{};             // without time and comment; fail: the text in the quotes
};

struct Scenario {
  std::vector<ScenarioLine> lines;  // as in the file

  /// Whether anything in it can fail or end the run, which makes it a test.
  [[nodiscard]] bool is_test() const;
};

/// Words with which a script can query a master that runs beside the emulated pack. Empty: no master to query or to
/// command.
struct MasterVocabulary {
  std::span<const std::string_view> phases{};
  std::span<const std::string_view> opening_causes{};
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

/// Result of reading: the correct lines, and the first problem of every other line, in the order of the lines.
struct ScenarioReading {
  Scenario scenario;
  ScenarioProblems problems;
};
[[nodiscard]] ScenarioReading read_scenario(std::string_view text, const MasterVocabulary& master = {});

/// A complete scenario, or its problems.
[[nodiscard]] Result<Scenario, ScenarioProblems> parse_scenario(std::string_view text,
                                                                const MasterVocabulary& master = {});

/// One event without its time: "cell 2.7 voltage_mV 2700".
[[nodiscard]] Result<ScenarioEvent, ScenarioProblem> parse_event(std::string_view text,
                                                                 const MasterVocabulary& master = {});

/// The tables of docs/scenarios.md: the properties and the states.
[[nodiscard]] std::string property_table_markdown();
[[nodiscard]] std::string state_table_markdown();

}  // namespace bmu

// The longest time that the configuration allows for each kind of detection.
#include <algorithm>

#include "daemon/core/contactors/command_link.hpp"
#include "daemon/core/faults/fault_evaluate.hpp"
#include "daemon/core/measurement/insulation_table.hpp"
#include "daemon/core/plausibility/balancing_switches.hpp"
#include "daemon/core/plausibility/charger_watch.hpp"
#include "protocol/tables/internal_bus.hpp"
#include "tests/catalogue/catalogue.hpp"

namespace bmu::test::seen {

namespace {

constexpr Duration frame_time = time_on_wire({.length = 8});
/// The frame on the wire has to end, then comes the command "open".
constexpr Duration command_time = 2 * frame_time;
/// Of the emulated devices: a module's cells, its temperatures, the sensor's results, a check of the inputs.
constexpr Duration cell_sampling = 10ms;
constexpr Duration temperature_sampling = 500ms;
constexpr Duration current_period = 20ms;
constexpr Duration voltage_period = 60ms;
constexpr Duration device_tick = 1ms;

/// From the POLL to the last frame of the last module, with the frames of all other nodes in between.
Duration answer_time(const CoreConfig& config) {
  constexpr std::int64_t frames_of_others = 12;
  std::int64_t frames = 1 + frames_of_others;
  for (const ModuleConfig& module : config.modules) {
    const std::int64_t blocks = (module.cell_count + internal_bus::cells_per_frame - 1) / internal_bus::cells_per_frame;
    frames += blocks + 5;  // STATUS, TEMP_1, TEMP_2, MODULE, and IDENT at times
  }
  return frames * frame_time + device_tick;
}

Duration confirmed(const CoreConfig& config, const FaultRow& row, Duration sample_period) {
  const Duration confirm = thresholds_of(row, config.limits).confirm;
  const Duration samples = (row.samples - 1) * sample_period;
  return std::max(confirm, samples) + row.grace + tick_period + command_time;
}

}  // namespace

Duration in_cells(const CoreConfig& config, const FaultRow& row) {
  return cell_sampling + config.poll.period + answer_time(config) + confirmed(config, row, config.poll.period);
}
Duration in_temperatures(const CoreConfig& config, const FaultRow& row) {
  const Duration asked = config.poll.period * config.poll.temperature_every;
  return temperature_sampling + asked + answer_time(config) + confirmed(config, row, asked);
}
/// Reported first, then polled again as soon as there must be another sample: within a tick, and by a poll of its own.
Duration in_a_jump(const CoreConfig& config, const FaultRow& row) {
  return temperature_sampling + 5ms + tick_period + answer_time(config) + in_temperatures(config, row);
}
/// The first sample of the rise may still be too near to its start: at 8 K/s the mean of two seconds needs 250 ms.
Duration in_temperature_trend(const CoreConfig& config, const FaultRow& row) {
  return 250ms + in_temperatures(config, row);
}
Duration in_module_status(const CoreConfig& config, const FaultRow& row) {
  return in_cells(config, row);
}
/// The module averages its cells over 100 ms before it compares them with its limits.
Duration in_module_limits(const CoreConfig& config, const FaultRow& row) {
  return 200ms + in_cells(config, row);
}
/// The sensor reports means, so the first after a step may be half of it; and its identifiers wait for all modules.
Duration in_current(const CoreConfig& config, const FaultRow& row) {
  return 2 * current_period + answer_time(config) + confirmed(config, row, current_period);
}
Duration in_pack_voltage(const CoreConfig& config, const FaultRow& row) {
  return voltage_period + answer_time(config) + confirmed(config, row, config.poll.period);
}
Duration in_a_line(const CoreConfig& config, const FaultRow& row) {
  return device_tick + command_time + confirmed(config, row, 0ms);
}
/// A frame with an identifier of lower priority than all modules' answers.
Duration in_a_frame_behind_all(const CoreConfig& config, const FaultRow& row) {
  return answer_time(config) + confirmed(config, row, 0ms);
}
/// In the periodic status of the PDU, without a change that it would report at once.
Duration in_the_next_word(const CoreConfig& config, const FaultRow& row) {
  return internal_bus::pdu_status.period + in_a_line(config, row);
}
Duration in_a_contact(const CoreConfig& config, const FaultRow& row) {
  return device_tick + command_time + confirmed(config, row, 0ms) + tick_period;
}
Duration in_module_silence(const CoreConfig& config, const FaultRow& row) {
  return std::max(config.ages.module_status, config.ages.cell_voltage) + confirmed(config, row, 0ms);
}
/// Three frames of the next answer, or of the one after it if not all are damaged.
Duration in_damaged_frames(const CoreConfig& config, const FaultRow& row) {
  return 2 * config.poll.period + answer_time(config) + confirmed(config, row, 0ms);
}
/// The age of a temperature counts from its reception, which was after the answers of all modules.
Duration in_temperature_silence(const CoreConfig& config, const FaultRow& row) {
  return answer_time(config) + config.ages.temperature + confirmed(config, row, 0ms);
}
/// The last result may have waited for all modules, and its age counts from its reception.
Duration in_current_silence(const CoreConfig& config, const FaultRow& row) {
  return answer_time(config) + config.ages.pack_current + confirmed(config, row, 0ms);
}
Duration in_voltage_silence(const CoreConfig& config, const FaultRow& row) {
  return answer_time(config) + config.ages.pack_voltage + confirmed(config, row, 0ms);
}
Duration in_pdu_silence(const CoreConfig& config, const FaultRow& row) {
  return config.ages.pdu_status + confirmed(config, row, 0ms);
}
Duration in_missing_echoes(const CoreConfig& config, const FaultRow& row) {
  return internal_bus::contactor_command.period + command_wait_max + confirmed(config, row, 0ms);
}
/// Two modules with one node number are confirmed after their second answer.
Duration in_two_answers(const CoreConfig& config, const FaultRow& row) {
  return 2 * config.poll.period + answer_time(config) + confirmed(config, row, 0ms);
}
/// A module that restarts sends its IDENT by itself, 10 ms times its node number later.
Duration in_an_identity(const CoreConfig& config, const FaultRow& row) {
  const std::uint8_t last_node = config.modules[config.modules.size() - 1].node;
  return last_node * 10ms + answer_time(config) + confirmed(config, row, 0ms);
}
/// Its STATUS reports that it has none.
Duration in_limits_not_taken(const CoreConfig& config, const FaultRow& row) {
  return config.poll.period + answer_time(config) + confirmed(config, row, 0ms);
}
/// Tested by the module's report of it: for `obey_max`, seen with the next answers at both ends.
Duration in_a_balancing_switch(const CoreConfig& config, const FaultRow& row) {
  return 2 * config.poll.period + answer_time(config) + obey_max + confirmed(config, row, 0ms);
}
Duration in_the_next_tick(const CoreConfig& config, const FaultRow& row) {
  return confirmed(config, row, 0ms);
}
Duration in_a_contact_that_stays(const CoreConfig& config, const FaultRow& row) {
  return config.contactors.feedback_timeout + internal_bus::pdu_status.period + command_time +
         confirmed(config, row, 0ms);
}
Duration in_the_precharge_time_out(const CoreConfig& config, const FaultRow& row) {
  return config.contactors.precharge_timeout + tick_period + confirmed(config, row, 0ms);
}
/// The PDU holds the last command for this time, and opens at its next check.
Duration in_the_unit_alone(const CoreConfig&, const FaultRow&) {
  return internal_bus::contactor_command_life + internal_bus::contactor_command.period + device_tick;
}
/// Of a charger on a bus: 1 A more than commanded, which at 10 A/s is reached after a tenth of a second.
Duration in_the_charge(const CoreConfig& config, const FaultRow& row) {
  return 100ms + in_current(config, row);
}
/// Two and a half of its report periods after the last report, which arbitration sends after the frames of all other
/// nodes, and after the charger's own other frames and commands.
Duration in_charger_silence(const CoreConfig& config, const FaultRow& row) {
  constexpr std::int64_t frames_of_charger = 8;
  const Duration silence = config.charger.driver->report_period * 5 / 2 + 100ms;
  return silence + frames_of_charger * frame_time + answer_time(config) + confirmed(config, row, 0ms);
}
/// After the last report, which arbitration sends after the frames of all other nodes; at most the core's own limit,
/// whatever the pack file has.
Duration in_monitor_silence(const CoreConfig& config, const FaultRow& row) {
  CoreConfig heard = config;
  heard.limits.confirm.insulation_monitor_lost =
      std::min(config.limits.confirm.insulation_monitor_lost, InsulationTable::lost_confirm_max);
  InsulationTable table;
  table.init(config.insulation);
  return table.silence_max() + answer_time(config) + confirmed(heard, row, 0ms);
}
Duration in_a_test_that_does_not_end(const CoreConfig& config, const FaultRow& row) {
  InsulationTable table;
  table.init(config.insulation);
  return InsulationTable::held_max - table.silence_max() + in_monitor_silence(config, row);
}
/// With the vehicle on three of its reports have to show it, after the time in which it has to begin to reduce its
/// current.
Duration in_a_charge_that_goes_on(const CoreConfig& config, const FaultRow& row) {
  const Duration told = ChargerWatch::told_over_min * config.charger.driver->report_period;
  return ChargerWatch::begins_within(config.charger.driver->settle) + told + in_current(config, row);
}

}  // namespace bmu::test::seen

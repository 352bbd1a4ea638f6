#include "daemon/core/event.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <type_traits>

#include "daemon/core/balancing_conditions.hpp"
#include "daemon/core/charge_control.hpp"
#include "daemon/core/estimators/cell_charge.hpp"
#include "daemon/core/permission.hpp"
#include "daemon/core/rest_mode.hpp"
#include "daemon/core/sensor_setup.hpp"
#include "protocol/enumerators.hpp"
#include "protocol/row_order.hpp"

namespace bmu {

std::string_view to_text(Port port) {
  switch (port) {
    case Port::internal: return "internal";
    case Port::vehicle: return "vehicle";
    case Port::charger: return "charger";
    case Port::second_pack: return "second_pack";
    case Port::inverter: return "inverter";
  }
  return "?";
}

std::optional<Port> port_of_text(std::string_view text) {
  const auto* const found =
      std::find_if(all_ports.begin(), all_ports.end(), [text](Port port) { return to_text(port) == text; });
  return found == all_ports.end() ? std::nullopt : std::optional(*found);
}

std::string_view to_text(Authority authority) {
  switch (authority) {
    case Authority::user: return "user";
    case Authority::service: return "service";
  }
  return "?";
}

std::string_view to_text(OpeningCause cause) {
  switch (cause) {
    case OpeningCause::none: return "none";
    case OpeningCause::fault: return "fault";
    case OpeningCause::request_over: return "request over";
    case OpeningCause::shut_down: return "shut down";
    case OpeningCause::precharge_retry: return "precharge to be tried again";
    case OpeningCause::permission: return "permission withdrawn";
  }
  return "?";
}

namespace {

constexpr std::array<EventRow, event_count> table{{
    {EventId::fault_warned, "fault_warned", Severity::warning},
    {EventId::fault_warning_over, "fault_warning_over", Severity::info},
    {EventId::fault_confirmed, "fault_confirmed", Severity::error},
    {EventId::fault_cause_gone, "fault_cause_gone", Severity::info},
    {EventId::fault_cleared, "fault_cleared", Severity::info},
    {EventId::phase_changed, "phase_changed", Severity::info},
    {EventId::precharge_done, "precharge_done", Severity::info},
    {EventId::precharge_gave_up, "precharge_gave_up", Severity::warning},
    {EventId::opened, "opened", Severity::warning},
    {EventId::close_requested, "close_requested", Severity::info},
    {EventId::close_request_over, "close_request_over", Severity::info},
    {EventId::close_refused, "close_refused", Severity::warning},
    {EventId::rest_changed, "rest_changed", Severity::info},
    {EventId::soc_started, "soc_started", Severity::info},
    {EventId::former_charges, "former_charges", Severity::info},
    {EventId::module_identified, "module_identified", Severity::info},
    {EventId::module_out_of_place, "module_out_of_place", Severity::warning},
    {EventId::module_accepted, "module_accepted", Severity::info},
    {EventId::module_given_node, "module_given_node", Severity::info},
    {EventId::module_node_not_taken, "module_node_not_taken", Severity::warning},
    {EventId::module_restarted, "module_restarted", Severity::warning},
    {EventId::module_limits_set, "module_limits_set", Severity::info},
    {EventId::module_refused_limits, "module_refused_limits", Severity::error},
    {EventId::balancing_began, "balancing_began", Severity::debug},
    {EventId::balancing_stopped, "balancing_stopped", Severity::info},
    {EventId::module_refused_balancing, "module_refused_balancing", Severity::warning},
    {EventId::module_ignores_balancing, "module_ignores_balancing", Severity::warning},
    {EventId::modules_stay_awake, "modules_stay_awake", Severity::warning},
    {EventId::charge_stage_changed, "charge_stage_changed", Severity::info},
    {EventId::sensor_set_up, "sensor_set_up", Severity::info},
    {EventId::sensor_set_up_failed, "sensor_set_up_failed", Severity::error},
    {EventId::sensor_restarted, "sensor_restarted", Severity::warning},
    {EventId::port_up, "port_up", Severity::info},
    {EventId::port_down, "port_down", Severity::error},
    {EventId::loop_gap, "loop_gap", Severity::error},
    {EventId::gate_refused, "gate_refused", Severity::error},
    {EventId::shutting_down, "shutting_down", Severity::info},
    {EventId::shut_down_unconfirmed, "shut_down_unconfirmed", Severity::error},
}};

static_assert(rows_are_in_order(table, &EventRow::id));

std::string seconds_text(Duration span) {
  return std::to_string(std::chrono::round<std::chrono::seconds>(span).count()) + " s";
}

std::string tenths_text(Duration span) {
  constexpr std::int64_t tenth_ms = 100;
  const std::int64_t tenths = divide_to_nearest(to_ms(span), tenth_ms);
  return std::to_string(tenths / 10) + "." + std::to_string(tenths % 10) + " s";
}

/// A value of a key that would do, between what a pack file takes: "KEY 31000 would do, found 5000"; beyond it, with
/// what it needs instead.
std::string value_that_would_do(std::string_view key, const LikelyCause& cause, std::optional<Duration> least,
                                std::optional<Duration> most, std::string_view instead) {
  const std::string value = std::to_string(to_ms(cause.would_do));
  std::string text(key);
  if (most && cause.would_do > *most) {
    return text + " would have to be " + value + ", and may be " + std::to_string(to_ms(*most)) + "; it needs " +
           std::string(instead);
  }
  if (least && cause.would_do < *least) {
    return text + " would have to be " + value + ", and is at least " + std::to_string(to_ms(*least)) + "; it needs " +
           std::string(instead);
  }
  return text + " " + value + " would do, found " + std::to_string(to_ms(cause.found));
}

std::string decay_text(const LikelyCause& cause) {
  return "the link falls, with a time constant of " + seconds_text(cause.measured) + ": " +
         value_that_would_do("contactors/link_decay_ms", cause, {}, link_decay_max, "a discharge resistor");
}

std::string fast_rise_text(const LikelyCause& cause) {
  return "the link was seen on its way and followed after " + std::to_string(to_ms(cause.measured)) +
         " ms: where no contactor is welded, " +
         value_that_would_do("contactors/precharge_min_ms", cause, precharge_min_least, {}, "a resistor of more ohms");
}

std::string slow_rise_text(const LikelyCause& cause) {
  const std::string rises = "the link rises, with a time constant of " + tenths_text(cause.measured);
  const std::string timeout = value_that_would_do("contactors/precharge_timeout_ms", cause, {}, precharge_timeout_max,
                                                  "a resistor of fewer ohms");
  if (cause.key == WrongKey::precharge_timeout) return rises + ": " + timeout;
  const std::string energy = rises + ", until the resistor has had what it bears: contactors/precharge_energy_J " +
                             std::to_string(cause.would_do_J) + " would do, found " + std::to_string(cause.found_J) +
                             ", with a resistor that bears it";
  return cause.would_do > cause.found ? energy + "; " + timeout : energy;
}

/// ": link 29.920 V, pack 30.000 V"; nothing where they are not known.
std::string link_and_pack_text(const Reading& link, std::int64_t pack_mV) {
  if (!link.is_known) return "";
  return ": link " + value_text(Unit::mV, link.value) + ", pack " + value_text(Unit::mV, pack_mV);
}

/// Behind the place, if there is one: " 2.8510 V, limit 2.9000 V".
std::string limit_text(const FaultRow& row, const Reading& reading, std::int64_t threshold) {
  if (!row.has_limit()) return "";
  return (to_text(reading.element).empty() ? ": " : " ") + value_text(row.unit, reading.value) + ", limit " +
         value_text(row.unit, threshold);
}

std::string text_of_fault(const Event& event) {
  const FaultRow& row = row_of(event.fault);
  std::string text(row.meaning);
  const std::string where = to_text(event.reading.element);
  if (!where.empty()) text += ": " + where;
  if (event.fault == FaultId::charger_runaway && event.number != 0) {
    const Unit unit = event.reading.value == 2 ? Unit::mV : Unit::mA;
    text += ": " + excess_text(unit, event.number, event.threshold);
  }
  text += limit_text(row, event.reading, event.threshold);
  const std::string likely = to_text(event.likely);
  return likely.empty() ? text : text + "; " + likely;
}

std::string text_of_opening(const Event& event) {
  const std::string from = std::string(to_text(event.phase_from));
  if (event.cause == OpeningCause::fault) return "contactors opened from " + from + ": " + text_of_fault(event);
  std::string line = "contactors opened from " + from + ": " + std::string(to_text(event.cause));
  if (event.cause != OpeningCause::permission) return line;
  line += ": " + std::string(to_text(static_cast<Blocker>(event.number)));
  const std::string where = to_text(event.reading.element);
  return where.empty() ? line : line + ": " + where;
}

constexpr std::array<std::string_view, sensor_channels_told> channel_names{"I", "U1", "U2", "I"};

std::string setting_text(SensorSetupTrouble trouble, std::int32_t value) {
  constexpr std::array<std::string_view, 3> triggers{"off", "on a trigger", "by itself"};
  switch (trouble) {
    case SensorSetupTrouble::trigger: return std::string(triggers.at(static_cast<std::size_t>(value)));
    case SensorSetupTrouble::period: return "every " + std::to_string(value) + " ms";
    case SensorSetupTrouble::byte_order: return value != 0 ? "little-endian" : "big-endian";
    case SensorSetupTrouble::sign: return value != 0 ? "sign turned round" : "sign not turned round";
    default: return "";
  }
}

/// As the core tells it: what is wrong, of which channel, found and wanted.
SensorSetupProblem problem_in(const Event& event) {
  return {.trouble = static_cast<SensorSetupTrouble>(event.number),
          .channel = event.reading.element.number,
          .found = static_cast<std::int32_t>(event.reading.value),
          .wanted = static_cast<std::int32_t>(event.threshold)};
}

std::string_view sensor_name(std::uint8_t channel) {
  return channel < sensor_channels_used ? "the current sensor" : "the second current sensor";
}

/// "the current sensor was configured anew: U1: every 100 ms before, every 60 ms now".
std::string text_of_set_up(const SensorSetupProblem& changed) {
  if (changed.trouble == SensorSetupTrouble::none) {
    return std::string(sensor_name(changed.channel)) + " was found configured as wanted";
  }
  return "the current sensor was configured anew: " + std::string(channel_names.at(changed.channel)) + ": " +
         setting_text(changed.trouble, changed.found) + " before, " + setting_text(changed.trouble, changed.wanted) +
         " now";
}

std::string hex_id(std::int64_t id) {
  std::array<char, 16> text{};
  std::snprintf(text.data(), text.size(), "%03llX", static_cast<unsigned long long>(id));
  return text.data();
}

}  // namespace

const EventRow& row_of(EventId id) {
  BMU_ASSERT(static_cast<std::size_t>(id) < table.size());
  return table[static_cast<std::size_t>(id)];
}

Severity severity_of(const Event& event) {
  const bool is_meant = event.cause == OpeningCause::request_over || event.cause == OpeningCause::shut_down;
  if (event.id == EventId::opened && is_meant) return Severity::info;
  const bool only_warns = row_of(event.fault).reaction == Reaction::warn && !event.is_stricter;
  if (event.id == EventId::fault_confirmed && only_warns) return Severity::warning;
  return row_of(event.id).severity;
}

std::string to_text(const Element& element) {
  constexpr std::array contactors{"", "main positive", "main negative", "precharge", "charge"};
  if (element.contactor != 0) return contactors.at(element.contactor);
  if (element.input != 0) return "no. " + std::to_string(element.input);
  if (element.module_node == 0) return "";
  if (element.number == 0) return "module " + std::to_string(element.module_node);
  constexpr int cell_sensors = cell_sensors_max;
  const bool is_board = element.is_temperature_sensor && element.number > cell_sensors;
  const char* const kind = is_board ? "board sensor " : element.is_temperature_sensor ? "temperature sensor " : "cell ";
  const int number = is_board ? element.number - cell_sensors : element.number;
  std::string text = kind + std::to_string(element.module_node) + "." + std::to_string(number);
  if (element.pack_number != 0) text += " (no. " + std::to_string(element.pack_number) + ")";
  return text;
}

std::string value_text(Unit unit, std::int64_t value) {
  const UnitSpec& spec = spec_of(unit);
  const std::int64_t steps = divide_to_nearest(value, spec.divisor);
  std::int64_t power = 1;
  for (int digit = 0; digit < spec.decimals; ++digit) power *= 10;
  std::array<char, 48> text{};
  const auto magnitude = static_cast<unsigned long long>(std::llabs(steps));
  const auto whole = magnitude / static_cast<unsigned long long>(power);
  const auto part = magnitude % static_cast<unsigned long long>(power);
  const char* const sign = steps < 0 ? "-" : "";
  if (spec.decimals == 0) {
    std::snprintf(text.data(), text.size(), "%s%llu", sign, whole);
  } else {
    std::snprintf(text.data(), text.size(), "%s%llu.%0*llu", sign, whole, spec.decimals, part);
  }
  std::string result = text.data();
  if (!spec.symbol.empty()) result += " " + std::string(spec.symbol);
  return result;
}

std::string excess_text(Unit unit, std::int64_t given, std::int64_t asked) {
  return value_text(unit, given) + " given, " + value_text(unit, asked) + " asked for";
}

std::string to_text(const LikelyCause& cause) {
  switch (cause.key) {
    case WrongKey::none: return "";
    case WrongKey::invert_current:
      return "no charger is plugged in: where no motor brakes either, sensor/invert_current is the wrong way round";
    case WrongKey::invert_current_by_cells:
    case WrongKey::invert_current_by_step:
      return "the cells move against the current that the sensor sends: sensor/invert_current is the wrong way round";
    case WrongKey::invert_current_by_charger:
      return "the charger gives as much as the sensor sees leave the pack: where no load takes twice that, "
             "sensor/invert_current is the wrong way round";
    case WrongKey::second_is_reversed:
      return "the two sensors see the same current with opposite signs: sensor/second_is_reversed is the wrong way "
             "round";
    case WrongKey::both_signs:
      return "the two sensors see the same current with opposite signs, and the cells move against the first: "
             "sensor/invert_current and sensor/second_is_reversed are both the wrong way round";
    case WrongKey::little_endian:
      return "the sensor's results are out of range, as they are in the other byte order: sensor/little_endian";
    case WrongKey::buses:
      return "modules, power distribution unit or current sensor send on the vehicle bus: buses/internal and "
             "buses/vehicle are swapped";
    case WrongKey::link_decay: return decay_text(cause);
    case WrongKey::precharge_min: return fast_rise_text(cause);
    case WrongKey::precharge_energy:
    case WrongKey::precharge_timeout: return slow_rise_text(cause);
  }
  return "";
}

std::string to_text(const SensorSetupProblem& problem) {
  const std::string channel = std::string(channel_names.at(problem.channel)) + ": ";
  switch (problem.trouble) {
    case SensorSetupTrouble::none: return "";
    case SensorSetupTrouble::no_answer: return channel + "no answer";
    case SensorSetupTrouble::not_understood: return channel + "it does not know the command";
    default: break;
  }
  return channel + "found " + setting_text(problem.trouble, problem.found) + ", wanted " +
         setting_text(problem.trouble, problem.wanted);
}

bool Event::are_fields_possible() const {
  const auto is_one_of = [this](auto enumerator) {
    using Enum = decltype(enumerator);
    return number >= 0 && number < static_cast<std::int64_t>(enumerators_max) &&
           is_enumerator<Enum>(static_cast<std::underlying_type_t<Enum>>(number));
  };
  switch (id) {
    case EventId::opened: return cause != OpeningCause::permission || is_one_of(Blocker{});
    case EventId::close_refused: return is_one_of(Blocker{});
    case EventId::rest_changed: return is_one_of(RestPhase{});
    case EventId::former_charges: return is_one_of(FormerBook{});
    case EventId::charge_stage_changed: return is_one_of(ChargeStage{});
    case EventId::sensor_set_up:
    case EventId::sensor_set_up_failed: return is_possible(problem_in(*this)) && is_one_of(SensorSetupTrouble{});
    case EventId::balancing_stopped: return is_one_of(BalancingBlocker{});
    default: return true;
  }
}

bool is_about_link(FaultId fault) {
  constexpr std::array about_link{FaultId::precharge_failed,      FaultId::precharge_too_fast,
                                  FaultId::precharge_overcurrent, FaultId::contactor_welded,
                                  FaultId::link_not_following,    FaultId::link_not_discharging};
  return std::find(about_link.begin(), about_link.end(), fault) != about_link.end();
}

std::string refusal_text(Blocker blocker, FaultId fault, const Reading& reading, std::int64_t threshold) {
  std::string text(to_text(blocker));
  if (!reading.is_known) return text;
  if (blocker == Blocker::link_follows) return text + link_and_pack_text(reading, threshold);
  if (blocker != Blocker::fault) return text;
  const FaultRow& row = row_of(fault);
  const std::string where = to_text(reading.element);
  const std::string values = is_about_link(fault) && threshold > 0 ? link_and_pack_text(reading, threshold)
                                                                   : limit_text(row, reading, threshold);
  text += ": " + std::string(row.meaning);
  // A fault may stay long after its values are others.
  if (!values.empty()) text += "; when it was confirmed";
  return text + (where.empty() ? "" : ": " + where) + values;
}

std::string to_text(const Event& event) {
  const std::string number = std::to_string(event.number);
  switch (event.id) {
    case EventId::fault_warned: return "warning: " + text_of_fault(event);
    case EventId::fault_warning_over: return "warning over: " + std::string(row_of(event.fault).meaning);
    case EventId::fault_confirmed: return "fault: " + text_of_fault(event);
    case EventId::fault_cause_gone:
      return "cause gone, fault stays until cleared: " + std::string(row_of(event.fault).meaning);
    case EventId::fault_cleared: return "fault cleared: " + std::string(row_of(event.fault).meaning);
    case EventId::phase_changed:
      return "contactors: " + std::string(to_text(event.phase_from)) + " -> " + std::string(to_text(event.phase_to));
    case EventId::precharge_done: return "precharged in " + number + " ms";
    case EventId::precharge_gave_up:
      return "precharge given up after " + number + " ms" + link_and_pack_text(event.reading, event.threshold);
    case EventId::opened: return text_of_opening(event);
    case EventId::close_requested: return "close requested";
    case EventId::close_request_over: return "close request over";
    case EventId::close_refused:
      return "close request refused, ask again when this is over: " +
             refusal_text(static_cast<Blocker>(event.number), event.fault, event.reading, event.threshold);
    case EventId::rest_changed:
      return "modules after an undervoltage: " + std::string(to_text(static_cast<RestPhase>(event.number)));
    case EventId::soc_started: return "state of charge starts at " + value_text(Unit::permille, event.number);
    case EventId::former_charges:
      return "what the cells missed before the start: " + std::string(to_text(static_cast<FormerBook>(event.number)));
    case EventId::module_identified:
      return "module " + std::to_string(event.reading.element.module_node) + " is serial number " + number;
    case EventId::module_out_of_place:
      return "module " + std::to_string(event.reading.element.module_node) + " is serial number " + number + ", not " +
             std::to_string(event.threshold);
    case EventId::module_accepted:
      return "module " + std::to_string(event.reading.element.module_node) + " is serial number " + number +
             " from now on";
    case EventId::module_given_node:
      return "serial number " + number + " has taken node " + std::to_string(event.reading.element.module_node);
    case EventId::module_node_not_taken:
      return "serial number " + number + " was not seen on node " + std::to_string(event.reading.element.module_node) +
             " after it was given this number";
    case EventId::module_restarted: return "module " + number + " restarted";
    case EventId::module_limits_set: return "module " + number + " has taken over the cell limits";
    case EventId::module_refused_limits: return "module " + number + " refused the cell limits";
    case EventId::balancing_began: return "balancing: cells that bleed: " + number;
    case EventId::balancing_stopped:
      return "balancing stopped: " + std::string(row_of(static_cast<BalancingBlocker>(event.number)).meaning);
    case EventId::module_refused_balancing: return "module " + number + " refused to balance its cells";
    case EventId::module_ignores_balancing: return "module " + number + " does not answer when told to balance";
    case EventId::modules_stay_awake: return "told to sleep again and again, some module goes on answering";
    case EventId::charge_stage_changed:
      return "charge: " + std::string(to_text(static_cast<ChargeStage>(event.number)));
    case EventId::sensor_set_up: return text_of_set_up(problem_in(event));
    case EventId::sensor_set_up_failed: {
      const SensorSetupProblem problem = problem_in(event);
      return std::string(sensor_name(problem.channel)) + " is not used: " + to_text(problem);
    }
    case EventId::sensor_restarted: return std::string(sensor_name(event.reading.element.number)) + " started anew";
    case EventId::port_up: return std::string(to_text(event.port)) + " bus is up";
    case EventId::port_down: return std::string(to_text(event.port)) + " bus is down";
    case EventId::loop_gap: return "stopped or starved for " + number + " ms: opened, everything known is forgotten";
    case EventId::gate_refused: return "frame " + hex_id(event.number) + " refused by the output gate";
    case EventId::shutting_down: return "shutting down: opening";
    case EventId::shut_down_unconfirmed:
      return "nobody has confirmed that the contactors are open; ending all the same";
  }
  return "?";
}

}  // namespace bmu

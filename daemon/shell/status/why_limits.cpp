#include "daemon/shell/status/why_limits.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <string>
#include <utility>

#include "daemon/core/limits/current_prediction.hpp"
#include "daemon/shell/status/why_words.hpp"

namespace bmu {

namespace {

/// How a measured cause reduces the current.
enum class Way : std::uint8_t {
  line,   // from one value on, down to zero at another
  table,  // to a share of it
  held,   // to the current that keeps a voltage at its limit
};

/// A measured cause: its unit, its input, and the place of its limits in the pack file, or in the cell file, where it
/// follows the direction.
struct CauseRow {
  LimitCause cause;
  Unit unit;
  std::string_view input;
  std::string_view place;
  Way way = Way::line;
};
constexpr CauseRow cause_table[] = {
    {LimitCause::cell_voltage_low, Unit::uV, "lowest cell voltage", "limits/cell_undervoltage"},
    {LimitCause::cell_voltage_high, Unit::uV, "highest cell voltage", "limits/cell_overvoltage"},
    {LimitCause::cell_imbalance, Unit::uV, "cell voltage spread", "limits/cell_imbalance"},
    {LimitCause::cell_hot, Unit::dC, "highest cell temperature", "limits/cell_overtemperature"},
    {LimitCause::cell_cold, Unit::dC, "lowest cell temperature", "limits/cell_undertemperature"},
    {LimitCause::too_hot_to_charge, Unit::dC, "highest cell temperature", "limits/charge_overtemperature"},
    {LimitCause::too_cold_to_charge, Unit::dC, "lowest cell temperature", "limits/charge_undertemperature"},
    {LimitCause::temperature_spread, Unit::dC, "cell temperature spread", "limits/temperature_spread"},
    {LimitCause::board_hot, Unit::dC, "highest module board temperature", "limits/board_overtemperature"},
    {LimitCause::drawn_too_much, Unit::mA, "discharge current", "limits/discharge_overcurrent"},
    {LimitCause::charged_too_much, Unit::mA, "charge current", "limits/charge_overcurrent"},
    {LimitCause::overload, Unit::permille, "peak budget used", "current"},
    {LimitCause::voltage_would_fall, Unit::uV, "cell voltage", "limits/cell_undervoltage", Way::held},
    {LimitCause::voltage_would_rise, Unit::uV, "cell voltage", "limits/cell_overvoltage", Way::held},
    {LimitCause::cold, Unit::dC, "lowest cell temperature", "over_temperature", Way::table},
    {LimitCause::hot, Unit::dC, "highest cell temperature", "over_temperature", Way::table},
    {LimitCause::empty, Unit::permille, "state of charge", "over_soc", Way::table},
    {LimitCause::full, Unit::permille, "state of charge", "over_soc", Way::table},
};

const CauseRow* find_row(LimitCause cause) {
  const auto* row = std::find_if(std::begin(cause_table), std::end(cause_table),
                                 [cause](const CauseRow& one) { return one.cause == cause; });
  return row == std::end(cause_table) ? nullptr : row;
}

/// Settings of the pack file for one direction.
struct DirectionConfig {
  std::string_view name;
  std::int32_t continuous_mA;
  std::int32_t peak_mA;
  Duration peak_for;
  std::int64_t overcurrent_warn_mA;
};

DirectionConfig config_of(Concerns direction, const CoreConfig& config) {
  const CurrentLimitConfig& current = config.current;
  if (direction == Concerns::charge) {
    return {"charge", current.charge_continuous_mA, current.charge_peak_mA, current.charge_peak_for,
            config.limits.charge_overcurrent.warn};
  }
  return {"discharge", current.discharge_continuous_mA, current.discharge_peak_mA, current.discharge_peak_for,
          config.limits.discharge_overcurrent.warn};
}

std::string current_text(std::int64_t value_mA) {
  return value_text(Unit::mA, value_mA);
}

Duration forecast_span(double span_s) {
  return std::chrono::milliseconds(std::llround(span_s * 1'000));
}

// --- a measured reason ----------------------------------------------------------------------------------------------

Json measured_signal(const CauseRow& row, const CurrentLimit& limit) {
  const std::string place = element_text(limit.element, row.unit);
  Json json =
      step("signal", text(row.input) + (place.empty() ? "" : ", " + place) + ": " + value_text(row.unit, limit.value));
  json["input"] = row.input;
  json[key_with_unit("value", row.unit)] = limit.value;
  json["element"] = element_json(limit.element, row.unit);
  return json;
}

/// "derating from 80.0 A at 3.0000 V to zero at 2.8000 V"; a peak falls to the continuous current.
std::string line_text(const CauseRow& row, const CurrentLimit& limit, const DirectionConfig& config) {
  const bool is_peak = row.cause == LimitCause::overload;
  const std::string ends = is_peak ? "the continuous limit of " + current_text(config.continuous_mA) + ", opens at " +
                                         value_text(row.unit, limit.threshold)
                                   : "zero at " + value_text(row.unit, limit.threshold);
  return "derating from " + current_text(limit.unhindered_mA) + " at " + value_text(row.unit, limit.derates_from) +
         " to " + ends;
}

/// "cell/derating/charge_over_temperature: 25.0 % of 20.0 A".
Json table_limit(const CauseRow& row, const CurrentLimit& limit, const DirectionConfig& config) {
  const std::string place = "cell/derating/" + text(config.name) + "_" + text(row.place);
  Json json = step("limit", place + ": " + value_text(Unit::permille, limit.derates_from) + " of " +
                                current_text(limit.unhindered_mA));
  json["row"] = place;
  json["share_permille"] = limit.derates_from;
  json["unhindered_mA"] = limit.unhindered_mA;
  return json;
}

/// "limits/cell_overvoltage: a higher current would drive the cell beyond 4.2225 V within 10 s".
Json held_limit(const CauseRow& row, const CurrentLimit& limit, Duration within) {
  Json json = step("limit", text(row.place) + ": a higher current would drive the cell beyond " +
                                value_text(row.unit, limit.threshold) + " within " + span_text(within));
  json["row"] = row.place;
  json[key_with_unit("holds", row.unit)] = limit.threshold;
  json["unhindered_mA"] = limit.unhindered_mA;
  return json;
}

Json measured_limit(const CauseRow& row, const CurrentLimit& limit, const DirectionConfig& config) {
  if (row.way == Way::table) return table_limit(row, limit, config);
  if (row.way == Way::held) return held_limit(row, limit, forecast_span(forecast_peak_s));
  Json json = step("limit", text(row.place) + ": " + line_text(row, limit, config));
  json["row"] = row.place;
  json[key_with_unit("derates_from", row.unit)] = limit.derates_from;
  json[key_with_unit("threshold", row.unit)] = limit.threshold;
  json["unhindered_mA"] = limit.unhindered_mA;
  return json;
}

// --- the others -----------------------------------------------------------------------------------------------------

/// Each fault that requires zero current in this direction; one would be enough.
Json fault_steps(Concerns direction, const CoreView& view) {
  Json steps = Json::array();
  for (const FaultRow& row : fault_table()) {
    const FaultState& state = view.core.faults().state(row.id);
    const Reaction reaction = reaction_of(row, view.core.config().stricter_reactions).reaction;
    if (!is_about(row, direction) || !state.is_present() || reaction < Reaction::open_after_grace) continue;
    const std::string what = confirmed_text(row, state, view);
    Json json = step("fault", "fault " + text(row.name) + ": " + text(row.meaning) +
                                  (what.empty() ? "" : " (" + what + ")") + ", reaction: " + text(to_text(reaction)));
    json["name"] = row.name;
    json["reaction"] = to_text(reaction);
    steps.push_back(std::move(json));
  }
  return steps;
}

Json phase_step(const CoreView& view) {
  const std::string_view phase = to_text(view.core.sequence().phase);
  const bool may_stay = view.core.permission().may_stay_closed;
  Json json = step("state", "contactors in phase \"" + text(phase) + "\"" + (may_stay ? "" : ", closing inhibited"));
  json["phase"] = phase;
  json["may_stay_closed"] = may_stay;
  return json;
}

/// Where the pack file leaves a peak out it is the warning of the overcurrent (config/checks/pack_defaults.cpp); which
/// of the two was configured is unknown here.
std::string peak_origin(const DirectionConfig& config) {
  if (config.peak_mA != config.overcurrent_warn_mA) return {};
  return " (default: limits/" + text(config.name) + "_overcurrent/warn_mA)";
}

/// Nothing reduces the configured limit.
Json configured_step(const CurrentLimit& limit, const DirectionConfig& config) {
  const bool is_peak = limit.cause == LimitCause::peak;
  Json json = step("limit", is_peak ? "current/" + text(config.name) + "_peak_mA: " + current_text(config.peak_mA) +
                                          peak_origin(config) + " for " + span_text(config.peak_for) + ", then " +
                                          current_text(config.continuous_mA)
                                    : "current/" + text(config.name) +
                                          "_continuous_mA: " + current_text(config.continuous_mA) + " continuous");
  json["row"] = "current/" + text(config.name) + (is_peak ? "_peak_mA" : "_continuous_mA");
  json["continuous_mA"] = config.continuous_mA;
  if (is_peak) json["peak_for_ms"] = to_ms(config.peak_for);
  return json;
}

/// "component_limits: rating of main fuse: 100 A".
Json part_step(const CurrentLimit& limit, const CoreConfig& config) {
  const std::string name = part_text(limit, config);
  Json json = step("limit", "component_limits: rating of " + name + ": " + current_text(limit.limit_mA));
  json["row"] = "component_limits/" + std::to_string(limit.part);
  json["part"] = name;
  return json;
}

/// "soc/resistance_pause_permille: charging paused at 50.0 % for 5.0 s to measure the resistance".
Json pause_step(const SocConfig& soc) {
  const std::string place = "soc/resistance_pause_permille";
  Json json =
      step("limit", place + ": charging paused at " + value_text(Unit::permille, soc.resistance_pause_permille) +
                        " for " + span_text(soc.resistance_pause) + " to measure the resistance");
  json["row"] = place;
  json["pause_ms"] = to_ms(soc.resistance_pause);
  return json;
}

/// "pack_limits/power_max_W: 80000 W are 133.333 A at 600.000 V".
Json power_step(const CurrentLimit& limit) {
  const std::string place = "pack_limits/power_max_W";
  const bool is_known = limit.cause == LimitCause::power;
  Json json = step("limit", is_known ? place + ": " + std::to_string(limit.threshold) + " W are " +
                                           current_text(limit.limit_mA) + " at " + value_text(Unit::mV, limit.value)
                                     : place + ": no current permitted while the pack voltage is unknown");
  json["row"] = place;
  json["power_max_W"] = limit.threshold;
  if (is_known) json["pack_voltage_mV"] = limit.value;
  return json;
}

/// Causes that are a setting of the pack file, or the previous limit.
Json plain_step(Concerns direction, const CurrentLimit& limit, const CoreConfig& config) {
  const DirectionConfig names = config_of(direction, config);
  if (limit.cause == LimitCause::component) return part_step(limit, config);
  if (limit.cause == LimitCause::rising) {
    Json json = step("limit", "limit_ramp: ramping to " + current_text(limit.unhindered_mA));
    json["row"] = "limit_ramp";
    json["target_mA"] = limit.unhindered_mA;
    return json;
  }
  if (limit.cause == LimitCause::measuring) return pause_step(config.soc);
  if (limit.cause == LimitCause::power || limit.cause == LimitCause::not_sensed) return power_step(limit);
  const bool is_user = limit.cause == LimitCause::user;
  const bool is_soc = limit.cause == LimitCause::charge_not_known;
  const std::string place = is_user  ? "user_limits"
                            : is_soc ? "cell/derating/" + text(names.name) + "_over_soc"
                                     : "current/limp_home_discharge_mA";
  Json json = step(
      "limit", place + ": " + current_text(limit.limit_mA) + (is_soc ? ", minimum of the table (SOC unknown)" : ""));
  json["row"] = place;
  return json;
}

Json decision_step(const CurrentLimit& limit) {
  const bool is_derated = find_row(limit.cause) != nullptr;
  Json json = step("decision", "at most " + current_text(limit.limit_mA) +
                                   (is_derated ? " of " + current_text(limit.unhindered_mA) : "") + ": " +
                                   text(to_text(limit.cause)));
  json["limit_mA"] = limit.limit_mA;
  json["cause"] = to_text(limit.cause);
  return json;
}

Json steps_before(Concerns direction, const CurrentLimit& limit, const CoreView& view) {
  const DirectionConfig config = config_of(direction, view.core.config());
  if (const CauseRow* row = find_row(limit.cause); row != nullptr) {
    return Json::array({measured_signal(*row, limit), measured_limit(*row, limit, config)});
  }
  if (limit.cause == LimitCause::fault) return fault_steps(direction, view);
  if (limit.cause == LimitCause::not_connected) return Json::array({phase_step(view)});
  const bool is_plain = limit.cause == LimitCause::peak || limit.cause == LimitCause::continuous;
  if (!is_plain) return Json::array({plain_step(direction, limit, view.core.config())});
  return Json::array({configured_step(limit, config)});
}

}  // namespace

std::string part_text(const CurrentLimit& limit, const CoreConfig& config) {
  const auto& name = config.component_limits[limit.part].name;
  const std::string padded(name.begin(), name.end());
  return padded.substr(0, padded.find_last_not_of(' ') + 1);
}

Json limit_json(const CurrentLimit& limit, const CoreConfig& config) {
  Json json{{"limit_mA", limit.limit_mA}, {"cause", to_text(limit.cause)}};
  if (limit.cause == LimitCause::component) json["part"] = part_text(limit, config);
  if (limit.cause == LimitCause::rising) json["target_mA"] = limit.unhindered_mA;
  if (limit.cause == LimitCause::power) json["pack_voltage_mV"] = limit.value;
  if (limit.cause == LimitCause::power || limit.cause == LimitCause::not_sensed) json["power_max_W"] = limit.threshold;
  const CauseRow* row = find_row(limit.cause);
  if (row == nullptr) return json;
  json[key_with_unit("value", row->unit)] = limit.value;
  json["input"] = row->input;
  if (row->way == Way::line) {
    json[key_with_unit("derates_from", row->unit)] = limit.derates_from;
    json[key_with_unit("threshold", row->unit)] = limit.threshold;
  } else if (row->way == Way::table) {
    json["share_permille"] = limit.derates_from;
  } else {
    json[key_with_unit("holds", row->unit)] = limit.threshold;
  }
  json["element"] = element_json(limit.element, row->unit);
  json["unhindered_mA"] = limit.unhindered_mA;
  return json;
}

Json limit_chain(Concerns direction, const CoreView& view) {
  const CurrentLimits& limits = view.core.limits();
  const CurrentLimit& limit = direction == Concerns::charge ? limits.charge : limits.discharge;
  Json steps = steps_before(direction, limit, view);
  std::string sentence = capitalised(text(config_of(direction, view.core.config()).name)) + " limit " +
                         current_text(limit.limit_mA) + ": " + text(to_text(limit.cause));
  for (const Json& one : steps) sentence += "; " + one["text"].get<std::string>();
  steps.push_back(decision_step(limit));
  return {{"text", sentence + "."}, {"steps", std::move(steps)}};
}

}  // namespace bmu

#include "daemon/shell/why_limits.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "daemon/shell/why_words.hpp"

namespace bmu {

namespace {

/// A reason that is measured: in which unit, what is looked at, and where in the pack file its limits stand.
struct CauseRow {
  LimitCause cause;
  Unit unit;
  std::string_view input;
  std::string_view place;
};
constexpr CauseRow cause_table[] = {
    {LimitCause::cell_voltage_low, Unit::uV, "lowest cell voltage", "limits/cell_undervoltage"},
    {LimitCause::cell_voltage_high, Unit::uV, "highest cell voltage", "limits/cell_overvoltage"},
    {LimitCause::cell_imbalance, Unit::uV, "highest less lowest cell voltage", "limits/cell_imbalance"},
    {LimitCause::cell_hot, Unit::dC, "highest cell temperature", "limits/cell_overtemperature"},
    {LimitCause::cell_cold, Unit::dC, "lowest cell temperature", "limits/cell_undertemperature"},
    {LimitCause::too_hot_to_charge, Unit::dC, "highest cell temperature", "limits/charge_overtemperature"},
    {LimitCause::too_cold_to_charge, Unit::dC, "lowest cell temperature", "limits/charge_undertemperature"},
    {LimitCause::temperature_spread, Unit::dC, "highest less lowest cell temperature", "limits/temperature_spread"},
    {LimitCause::board_hot, Unit::dC, "highest module board temperature", "limits/board_overtemperature"},
    {LimitCause::drawn_too_much, Unit::mA, "current out of the pack", "limits/discharge_overcurrent"},
    {LimitCause::charged_too_much, Unit::mA, "current into the pack", "limits/charge_overcurrent"},
    {LimitCause::overload, Unit::permille, "share of the peak that is used up", "current"},
};

const CauseRow* find_row(LimitCause cause) {
  const auto* row = std::find_if(std::begin(cause_table), std::end(cause_table),
                                 [cause](const CauseRow& one) { return one.cause == cause; });
  return row == std::end(cause_table) ? nullptr : row;
}

/// What the pack file says of one direction.
struct DirectionConfig {
  std::string_view name;
  std::int32_t continuous_mA;
  std::int32_t peak_mA;
  Duration peak_for;
};

DirectionConfig config_of(Concerns direction, const CurrentLimitConfig& current) {
  if (direction == Concerns::charge) {
    return {"charge", current.charge_continuous_mA, current.charge_peak_mA, current.charge_peak_for};
  }
  return {"discharge", current.discharge_continuous_mA, current.discharge_peak_mA, current.discharge_peak_for};
}

std::string current_text(std::int64_t value_mA) {
  return value_text(Unit::mA, value_mA);
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

/// "from 3.0000 V on the limit falls from 80.0 A to zero at 2.8000 V", of a peak to what stands for ever.
std::string line_text(const CauseRow& row, const CurrentLimit& limit, const DirectionConfig& config) {
  const bool is_peak = row.cause == LimitCause::overload;
  const std::string ends = is_peak ? current_text(config.continuous_mA) + ", which stand for ever; with " +
                                         value_text(row.unit, limit.threshold) + " it opens"
                                   : "zero at " + value_text(row.unit, limit.threshold);
  return "from " + value_text(row.unit, limit.derates_from) + " on the limit falls from " +
         current_text(limit.unhindered_mA) + " to " + ends;
}

Json measured_limit(const CauseRow& row, const CurrentLimit& limit, const DirectionConfig& config) {
  Json json = step("limit", text(row.place) + ": " + line_text(row, limit, config));
  json["row"] = row.place;
  json[key_with_unit("derates_from", row.unit)] = limit.derates_from;
  json[key_with_unit("threshold", row.unit)] = limit.threshold;
  json["unhindered_mA"] = limit.unhindered_mA;
  return json;
}

// --- the others -----------------------------------------------------------------------------------------------------

/// Each fault that asks for zero current in this direction; one would do.
Json fault_steps(Concerns direction, const CoreView& view) {
  Json steps = Json::array();
  for (const FaultRow& row : fault_table()) {
    const FaultState& state = view.core.faults().state(row.id);
    if (!is_about(row, direction) || !state.is_present() || row.reaction < Reaction::open_after_grace) continue;
    const std::string what = confirmed_text(row, state, view);
    Json json =
        step("fault", "fault " + text(row.name) + ": " + text(row.meaning) + (what.empty() ? "" : " (" + what + ")") +
                          ", reaction: " + text(to_text(row.reaction)));
    json["name"] = row.name;
    json["reaction"] = to_text(row.reaction);
    steps.push_back(std::move(json));
  }
  return steps;
}

Json phase_step(const CoreView& view) {
  const std::string_view phase = to_text(view.core.sequence().phase);
  const bool may_stay = view.core.permission().may_stay_closed;
  Json json = step("state", "the contactors are in phase \"" + text(phase) + "\"" +
                                (may_stay ? "" : ", and the pack may not be closed"));
  json["phase"] = phase;
  json["may_stay_closed"] = may_stay;
  return json;
}

/// Nothing speaks against what the pack file allows.
Json configured_step(const CurrentLimit& limit, const DirectionConfig& config) {
  const bool is_peak = limit.cause == LimitCause::peak;
  Json json =
      step("limit", is_peak ? "current/" + text(config.name) + "_peak_mA: " + current_text(config.peak_mA) + " for " +
                                  span_text(config.peak_for) + ", then " + current_text(config.continuous_mA)
                            : "current/" + text(config.name) + "_continuous_mA: " + current_text(config.continuous_mA) +
                                  " for ever");
  json["row"] = "current/" + text(config.name) + (is_peak ? "_peak_mA" : "_continuous_mA");
  json["continuous_mA"] = config.continuous_mA;
  if (is_peak) json["peak_for_ms"] = to_ms(config.peak_for);
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
  const DirectionConfig config = config_of(direction, view.core.config().current);
  if (const CauseRow* row = find_row(limit.cause); row != nullptr) {
    return Json::array({measured_signal(*row, limit), measured_limit(*row, limit, config)});
  }
  if (limit.cause == LimitCause::fault) return fault_steps(direction, view);
  if (limit.cause == LimitCause::not_connected) return Json::array({phase_step(view)});
  return Json::array({configured_step(limit, config)});
}

}  // namespace

Unit unit_of(LimitCause cause) {
  const CauseRow* row = find_row(cause);
  return row == nullptr ? Unit::none : row->unit;
}

std::string_view input_of(LimitCause cause) {
  const CauseRow* row = find_row(cause);
  return row == nullptr ? std::string_view{} : row->input;
}

Json limit_chain(Concerns direction, const CoreView& view) {
  const CurrentLimits& limits = view.core.limits();
  const CurrentLimit& limit = direction == Concerns::charge ? limits.charge : limits.discharge;
  Json steps = steps_before(direction, limit, view);
  std::string sentence = capitalised(text(config_of(direction, view.core.config().current).name)) + " limit " +
                         current_text(limit.limit_mA) + ": " + text(to_text(limit.cause));
  for (const Json& one : steps) sentence += "; " + one["text"].get<std::string>();
  steps.push_back(decision_step(limit));
  return {{"text", sentence + "."}, {"steps", std::move(steps)}};
}

}  // namespace bmu

#include "daemon/core/limits/limits.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdlib>

namespace bmu {

std::string_view to_text(LimitCause cause) {
  switch (cause) {
    case LimitCause::continuous: return "continuous limit";
    case LimitCause::peak: return "peak";
    case LimitCause::overload: return "peak used up";
    case LimitCause::drawn_too_much: return "too much is drawn";
    case LimitCause::charged_too_much: return "too much is charged";
    case LimitCause::not_connected: return "not connected";
    case LimitCause::fault: return "fault";
    case LimitCause::cell_voltage_low: return "cell voltage low";
    case LimitCause::cell_voltage_high: return "cell voltage high";
    case LimitCause::cell_imbalance: return "cells out of balance";
    case LimitCause::cell_hot: return "cell hot";
    case LimitCause::cell_cold: return "cell cold";
    case LimitCause::too_hot_to_charge: return "too hot to charge";
    case LimitCause::too_cold_to_charge: return "too cold to charge";
    case LimitCause::temperature_spread: return "temperatures too far apart";
    case LimitCause::board_hot: return "module board hot";
    case LimitCause::voltage_would_fall: return "cell voltage would fall too low";
    case LimitCause::voltage_would_rise: return "cell voltage would rise too high";
    case LimitCause::cold: return "cold";
    case LimitCause::hot: return "hot";
    case LimitCause::empty: return "empty";
    case LimitCause::full: return "full";
    case LimitCause::charge_not_known: return "state of charge not known";
    case LimitCause::component: return "component";
    case LimitCause::user: return "user";
    case LimitCause::limp_home: return "limp home";
    case LimitCause::measuring: return "paused to measure resistances";
    case LimitCause::rising: return "rising slowly";
    case LimitCause::power: return "pack power";
    case LimitCause::not_sensed: return "pack voltage or current not measured";
  }
  return "?";
}

namespace {

enum class Watched : std::uint8_t { min, max, width };
enum class Direction : std::uint8_t { discharge, charge, both };

/// One reason to lower a current limit: the monitored value, and the directions it concerns.
struct DeratingRow {
  LimitCause cause;
  LimitConfig LimitsConfig::*limit;
  Spread PackState::*spread;
  Watched watched;
  Direction direction;
};

constexpr std::array<DeratingRow, 9> derating_table{{
    {LimitCause::cell_voltage_low, &LimitsConfig::cell_undervoltage, &PackState::cell_voltage_uV, Watched::min,
     Direction::discharge},
    {LimitCause::cell_voltage_high, &LimitsConfig::cell_overvoltage, &PackState::cell_voltage_uV, Watched::max,
     Direction::charge},
    {LimitCause::cell_imbalance, &LimitsConfig::cell_imbalance, &PackState::cell_voltage_uV, Watched::width,
     Direction::both},
    {LimitCause::cell_hot, &LimitsConfig::cell_overtemperature, &PackState::cell_temperature_dC, Watched::max,
     Direction::both},
    {LimitCause::cell_cold, &LimitsConfig::cell_undertemperature, &PackState::cell_temperature_dC, Watched::min,
     Direction::both},
    {LimitCause::too_hot_to_charge, &LimitsConfig::charge_overtemperature, &PackState::cell_temperature_dC,
     Watched::max, Direction::charge},
    {LimitCause::too_cold_to_charge, &LimitsConfig::charge_undertemperature, &PackState::cell_temperature_dC,
     Watched::min, Direction::charge},
    {LimitCause::temperature_spread, &LimitsConfig::temperature_spread, &PackState::cell_temperature_dC, Watched::width,
     Direction::both},
    {LimitCause::board_hot, &LimitsConfig::board_overtemperature, &PackState::board_temperature_dC, Watched::max,
     Direction::both},
}};

constexpr std::int64_t all_permille = 1'000;
/// Half of the peak may be used at full height, then it falls linearly to the continuous current. That ends before
/// everything is used up: a draw of exactly the permitted current settles there, and never reaches the fault.
constexpr std::int64_t full_peak_until_permille = 500;
constexpr std::int64_t no_peak_from_permille = 900;

/// 1000 up to the start of the derating, 0 from the opening threshold on, linear in between.
std::int64_t share_permille(std::int64_t value, const LimitConfig& limit, bool is_lower_limit) {
  const std::int64_t span = std::llabs(std::int64_t{limit.derates_from()} - limit.open);
  const std::int64_t room = is_lower_limit ? value - limit.open : limit.open - value;
  if (room <= 0) return 0;
  return room >= span ? all_permille : room * all_permille / span;
}

std::int32_t value_of(const DeratingRow& row, const Spread& spread) {
  if (row.watched == Watched::min) return spread.min;
  return row.watched == Watched::max ? spread.max : spread.max - spread.min;
}

CurrentLimit zero(LimitCause cause) {
  return {.limit_mA = 0, .cause = cause};
}

// --- the four limits ------------------------------------------------------------------------------------------------

struct Bound {
  std::int32_t CurrentBounds::*continuous_mA;
  std::int32_t CurrentBounds::*peak_mA;
};

/// One direction: its members of the configuration and of the inputs.
struct Side {
  Direction direction;
  Bound bound;
  std::int32_t CurrentLimitConfig::*continuous_mA;
  std::int32_t CurrentLimitConfig::*peak_mA;
  std::int64_t LimitInputs::*used_permille;
  LimitConfig LimitsConfig::*overcurrent;
  LimitCause too_much;
  std::int32_t sign;  // of a current in this direction
  DeratingTable DeratingTables::*over_temperature;
  DeratingTable DeratingTables::*over_soc;
  std::optional<std::int32_t> LimitInputs::*soc_permille;
  LimitCause at_its_end;  // of the table over the state of charge
  LimitCause predicted;
};
constexpr Side discharge_side{Direction::discharge,
                              {&CurrentBounds::discharge_continuous_mA, &CurrentBounds::discharge_peak_mA},
                              &CurrentLimitConfig::discharge_continuous_mA,
                              &CurrentLimitConfig::discharge_peak_mA,
                              &LimitInputs::discharge_used_permille,
                              &LimitsConfig::discharge_overcurrent,
                              LimitCause::drawn_too_much,
                              1,
                              &DeratingTables::discharge_over_temperature,
                              &DeratingTables::discharge_over_soc,
                              &LimitInputs::soc_min_permille,
                              LimitCause::empty,
                              LimitCause::voltage_would_fall};
constexpr Side charge_side{Direction::charge,
                           {&CurrentBounds::charge_continuous_mA, &CurrentBounds::charge_peak_mA},
                           &CurrentLimitConfig::charge_continuous_mA,
                           &CurrentLimitConfig::charge_peak_mA,
                           &LimitInputs::charge_used_permille,
                           &LimitsConfig::charge_overcurrent,
                           LimitCause::charged_too_much,
                           -1,
                           &DeratingTables::charge_over_temperature,
                           &DeratingTables::charge_over_soc,
                           &LimitInputs::soc_max_permille,
                           LimitCause::full,
                           LimitCause::voltage_would_rise};

/// A direction and a duration.
struct Question {
  const PackState& pack;
  const CoreConfig& config;
  const LimitInputs& inputs;
  const Side& side;
  bool is_for_long;
  const PredictedLimit& predicted;
};

// --- limits that do not depend on the cells' state -----------------------------------------------------------------

/// Limit without any other cause: the peak, less the more of it is used up.
CurrentLimit unhindered(std::int32_t continuous_mA, std::int32_t peak_mA, std::int64_t used_permille) {
  if (peak_mA <= continuous_mA) return {.limit_mA = continuous_mA, .cause = LimitCause::continuous};
  if (used_permille <= full_peak_until_permille) return {.limit_mA = peak_mA, .cause = LimitCause::peak};
  const std::int64_t left = std::max<std::int64_t>(no_peak_from_permille - used_permille, 0);
  const std::int64_t above_mA =
      (std::int64_t{peak_mA} - continuous_mA) * left / (no_peak_from_permille - full_peak_until_permille);
  return {.limit_mA = static_cast<std::int32_t>(continuous_mA + above_mA),
          .cause = LimitCause::overload,
          .value = static_cast<std::int32_t>(used_permille),
          .derates_from = static_cast<std::int32_t>(full_peak_until_permille),
          .threshold = static_cast<std::int32_t>(all_permille),
          .unhindered_mA = peak_mA};
}

CurrentLimit unhindered(const Question& question, const CurrentLimitConfig& current) {
  const std::int32_t continuous_mA = current.*question.side.continuous_mA;
  if (question.is_for_long) return {.limit_mA = continuous_mA, .cause = LimitCause::continuous};
  return unhindered(continuous_mA, current.*question.side.peak_mA, question.inputs.*question.side.used_permille);
}

void lower_to(CurrentLimit& limit, const CurrentLimit& other) {
  if (other.limit_mA < limit.limit_mA) limit = other;
}

/// A bound of 0 is no bound.
void lower_to_bound(CurrentLimit& limit, const Question& question, const CurrentBounds& most, CurrentLimit bound) {
  bound.limit_mA = most.*(question.is_for_long ? question.side.bound.continuous_mA : question.side.bound.peak_mA);
  if (bound.limit_mA > 0) lower_to(limit, bound);
}

/// Lowers the limit by a current above the permitted one. Without a tier of its own the threshold of a current has no
/// effect before it opens: its warning lies above the permitted current anyway.
void lower_for_current(CurrentLimit& limit, const Question& question, std::int32_t unhindered_mA) {
  const LimitConfig& config = question.config.limits.*question.side.overcurrent;
  if (!config.limit.has_value() || !question.pack.current_mA.is_valid()) return;
  const std::int32_t value_mA = question.side.sign * question.pack.current_mA.value;
  const std::int64_t allowed_mA = share_permille(value_mA, config, false) * unhindered_mA / all_permille;
  lower_to(limit, {.limit_mA = static_cast<std::int32_t>(allowed_mA),
                   .cause = question.side.too_much,
                   .value = value_mA,
                   .derates_from = config.derates_from(),
                   .threshold = config.open,
                   .unhindered_mA = unhindered_mA});
}

void lower_for_prediction(CurrentLimit& limit, const Question& question, std::int32_t unhindered_mA) {
  const PredictedLimit& predicted = question.predicted;
  if (!predicted.is_known) return;
  lower_to(limit, {.limit_mA = predicted.limit_mA,
                   .cause = question.side.predicted,
                   .value = predicted.voltage_uV,
                   .threshold = predicted.holds_uV,
                   .element = predicted.element,
                   .unhindered_mA = unhindered_mA});
}

/// Limit by the components, the user, the predicted voltages, and the excess heat of all components.
CurrentLimit bearable(const Question& question, const CurrentLimit& top) {
  CurrentLimit limit = top;
  for (std::size_t part = 0; part < question.config.component_limits.size(); ++part) {
    lower_to_bound(
        limit, question, question.config.component_limits[part].most,
        {.cause = LimitCause::component, .unhindered_mA = top.limit_mA, .part = static_cast<std::uint8_t>(part)});
  }
  lower_to_bound(limit, question, question.config.user_limits,
                 {.cause = LimitCause::user, .unhindered_mA = top.limit_mA});
  lower_to(limit, unhindered(question, carried(question.config)));
  lower_for_current(limit, question, top.limit_mA);
  lower_for_prediction(limit, question, top.limit_mA);
  return limit;
}

// --- derating by the cells' state ----------------------------------------------------------------------------------

void lower_for_row(CurrentLimit& limit, const Question& question, const DeratingRow& row, std::int32_t unhindered_mA) {
  const LimitConfig& config = question.config.limits.*row.limit;
  const Spread& spread = question.pack.*row.spread;
  if (!spread.is_known()) return;
  const std::int32_t value = value_of(row, spread);
  const std::int64_t allowed_mA =
      share_permille(value, config, row.watched == Watched::min) * unhindered_mA / all_permille;
  lower_to(limit, {.limit_mA = static_cast<std::int32_t>(allowed_mA),
                   .cause = row.cause,
                   .value = value,
                   .derates_from = config.derates_from(),
                   .threshold = config.open,
                   .element = row.watched == Watched::min ? spread.min_at : spread.max_at,
                   .unhindered_mA = unhindered_mA});
}

/// A position on a table, and the cell that has it.
struct Place {
  std::int32_t at;
  LimitCause cause;
  Element element{};
};

void lower_to_share(CurrentLimit& limit, std::int32_t permille, const Place& place, std::int32_t unhindered_mA) {
  lower_to(limit, {.limit_mA = static_cast<std::int32_t>(std::int64_t{permille} * unhindered_mA / all_permille),
                   .cause = place.cause,
                   .value = place.at,
                   .derates_from = permille,
                   .element = place.element,
                   .unhindered_mA = unhindered_mA});
}

void lower_for_tables(CurrentLimit& limit, const Question& question, std::int32_t unhindered_mA) {
  const DeratingTable& over_temperature = question.config.derating.*question.side.over_temperature;
  const Spread& temperature_dC = question.pack.cell_temperature_dC;
  if (temperature_dC.is_known()) {
    const Place coldest{temperature_dC.min, LimitCause::cold, temperature_dC.min_at};
    const Place hottest{temperature_dC.max, LimitCause::hot, temperature_dC.max_at};
    lower_to_share(limit, share_permille(over_temperature, coldest.at), coldest, unhindered_mA);
    lower_to_share(limit, share_permille(over_temperature, hottest.at), hottest, unhindered_mA);
  }
  const DeratingTable& over_soc = question.config.derating.*question.side.over_soc;
  const std::optional<std::int32_t>& soc_permille = question.inputs.*question.side.soc_permille;
  if (soc_permille.has_value()) {
    const Place place{*soc_permille, question.side.at_its_end};
    lower_to_share(limit, share_permille(over_soc, place.at), place, unhindered_mA);
  } else {
    lower_to_share(limit, smallest_share_permille(over_soc), {0, LimitCause::charge_not_known}, unhindered_mA);
  }
}

/// Linear deratings and tables.
CurrentLimit derated(const Question& question, const CurrentLimit& top) {
  const Direction other = question.side.direction == Direction::charge ? Direction::discharge : Direction::charge;
  CurrentLimit limit = top;
  for (const DeratingRow& row : derating_table) {
    if (row.direction != other) lower_for_row(limit, question, row, top.limit_mA);
  }
  lower_for_tables(limit, question, top.limit_mA);
  return limit;
}

/// At a threshold no limp-home current is left, because the pack opens beyond it.
bool is_at_threshold(const CurrentLimit& limit) {
  return limit.limit_mA == 0 && is_protection(limit.cause);
}

CurrentLimit answer(const Question& question) {
  const CurrentLimit top = unhindered(question, question.config.current);
  const CurrentLimit bears = bearable(question, top);
  const CurrentLimit limit = derated(question, top);
  const std::int32_t floor_mA =
      question.side.direction == Direction::discharge ? question.config.current.limp_home_discharge_mA : 0;
  if (floor_mA > limit.limit_mA && bears.limit_mA > limit.limit_mA && !is_at_threshold(limit)) {
    const CurrentLimit floor{.limit_mA = floor_mA, .cause = LimitCause::limp_home, .unhindered_mA = bears.limit_mA};
    return bears.limit_mA < floor_mA ? bears : floor;
  }
  return bears.limit_mA < limit.limit_mA ? bears : limit;
}

bool is_watched(LimitCause cause) {
  return std::any_of(derating_table.begin(), derating_table.end(),
                     [cause](const DeratingRow& row) { return row.cause == cause; });
}

constexpr std::array all_limits{&CurrentLimits::discharge, &CurrentLimits::charge, &CurrentLimits::discharge_continuous,
                                &CurrentLimits::charge_continuous};

void bound_to_parts(std::int32_t& most_mA, std::int32_t bound_mA) {
  if (bound_mA > 0) most_mA = std::min(most_mA, bound_mA);
}

void bound_to(CurrentLimitConfig& current, const CurrentBounds& most) {
  bound_to_parts(current.discharge_continuous_mA, most.discharge_continuous_mA);
  bound_to_parts(current.discharge_peak_mA, most.discharge_peak_mA);
  bound_to_parts(current.charge_continuous_mA, most.charge_continuous_mA);
  bound_to_parts(current.charge_peak_mA, most.charge_peak_mA);
}

}  // namespace

bool is_measured_cause(LimitCause cause) {
  constexpr std::array others{LimitCause::drawn_too_much,
                              LimitCause::charged_too_much,
                              LimitCause::voltage_would_fall,
                              LimitCause::voltage_would_rise,
                              LimitCause::cold,
                              LimitCause::hot,
                              LimitCause::empty,
                              LimitCause::full};
  return is_watched(cause) || std::find(others.begin(), others.end(), cause) != others.end();
}

bool is_protection(LimitCause cause) {
  return is_watched(cause) || cause == LimitCause::not_connected || cause == LimitCause::fault ||
         cause == LimitCause::drawn_too_much || cause == LimitCause::charged_too_much;
}

CurrentLimitConfig carried(const CoreConfig& config) {
  CurrentLimitConfig current = config.current;
  for (const PartConfig& part : config.component_limits) bound_to(current, part.most);
  bound_to(current, config.user_limits);
  return current;
}

CurrentLimits evaluate_limits(const PackState& pack, const CoreConfig& config, const LimitInputs& inputs) {
  if (!inputs.is_connected) return {};
  const PredictedLimits& predicted = inputs.predicted;
  CurrentLimits limits{
      .discharge = answer({pack, config, inputs, discharge_side, false, predicted.discharge}),
      .charge = answer({pack, config, inputs, charge_side, false, predicted.charge}),
      .discharge_continuous = answer({pack, config, inputs, discharge_side, true, predicted.discharge_continuous}),
      .charge_continuous = answer({pack, config, inputs, charge_side, true, predicted.charge_continuous})};
  // The missing value may be the one that limits.
  if (!pack.cell_voltage_uV.is_complete() || !pack.cell_temperature_dC.is_complete() || !predicted.is_complete) {
    for (const auto one : all_limits) lower_to(limits.*one, inputs.before.*one);
  }
  if (inputs.is_charge_paused) lower_to(limits.charge, zero(LimitCause::measuring));
  lower_to(limits.discharge_continuous, limits.discharge);
  lower_to(limits.charge_continuous, limits.charge);
  if (!inputs.may_discharge) limits.discharge = limits.discharge_continuous = zero(LimitCause::fault);
  if (!inputs.may_charge) limits.charge = limits.charge_continuous = zero(LimitCause::fault);
  return limits;
}

}  // namespace bmu

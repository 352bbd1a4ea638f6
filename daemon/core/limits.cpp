#include "daemon/core/limits.hpp"

#include <algorithm>
#include <array>
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
  }
  return "?";
}

namespace {

enum class Watched : std::uint8_t { min, max, width };
enum class Direction : std::uint8_t { discharge, charge, both };

/// One reason to lower a current limit: what it watches, and which directions it concerns.
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
/// Half of the peak may be used at full height, then comes the slope down to the continuous current. It ends before
/// everything is used up: who draws exactly what is allowed comes to rest there, and never reaches the fault.
constexpr std::int64_t full_peak_until_permille = 500;
constexpr std::int64_t no_peak_from_permille = 900;

/// 1000 where the derating begins and before, 0 at the opening threshold and beyond, a straight line between.
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

/// What the pack gives if nothing speaks against it: the peak, and less of it the more is used up.
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

void lower(CurrentLimit& limit, const DeratingRow& row, const LimitConfig& config, const Spread& spread,
           std::int32_t unhindered_mA) {
  const std::int32_t value = value_of(row, spread);
  const std::int64_t allowed_mA =
      share_permille(value, config, row.watched == Watched::min) * unhindered_mA / all_permille;
  if (allowed_mA >= limit.limit_mA) return;
  limit = {.limit_mA = static_cast<std::int32_t>(allowed_mA),
           .cause = row.cause,
           .value = value,
           .derates_from = config.derates_from(),
           .threshold = config.open,
           .element = row.watched == Watched::min ? spread.min_at : spread.max_at,
           .unhindered_mA = unhindered_mA};
}

/// More current than is good asks for less. Without a tier of its own the limit of a current says nothing before it
/// opens: its warning lies above what is allowed anyway.
void lower_for_current(CurrentLimit& limit, const LimitConfig& config, std::int32_t value_mA, LimitCause cause,
                       std::int32_t unhindered_mA) {
  if (!config.limit.has_value()) return;
  const std::int64_t allowed_mA = share_permille(value_mA, config, false) * unhindered_mA / all_permille;
  if (allowed_mA >= limit.limit_mA) return;
  limit = {.limit_mA = static_cast<std::int32_t>(allowed_mA),
           .cause = cause,
           .value = value_mA,
           .derates_from = config.derates_from(),
           .threshold = config.open,
           .unhindered_mA = unhindered_mA};
}

void keep_down(CurrentLimit& limit, const CurrentLimit& before) {
  if (before.limit_mA < limit.limit_mA) limit = before;
}

}  // namespace

CurrentLimits evaluate_limits(const PackState& pack, const CoreConfig& config, const LimitInputs& inputs) {
  if (!inputs.is_connected) return {zero(LimitCause::not_connected), zero(LimitCause::not_connected)};
  const CurrentLimitConfig& current = config.current;
  const CurrentLimits top{
      unhindered(current.discharge_continuous_mA, current.discharge_peak_mA, inputs.discharge_used_permille),
      unhindered(current.charge_continuous_mA, current.charge_peak_mA, inputs.charge_used_permille)};
  CurrentLimits limits = top;
  for (const DeratingRow& row : derating_table) {
    const LimitConfig& limit = config.limits.*row.limit;
    const Spread& spread = pack.*row.spread;
    if (!spread.is_known()) continue;
    if (row.direction != Direction::charge) lower(limits.discharge, row, limit, spread, top.discharge.limit_mA);
    if (row.direction != Direction::discharge) lower(limits.charge, row, limit, spread, top.charge.limit_mA);
  }
  if (pack.current_mA.is_valid()) {
    const std::int32_t drawn_mA = pack.current_mA.value;
    lower_for_current(limits.discharge, config.limits.discharge_overcurrent, drawn_mA, LimitCause::drawn_too_much,
                      top.discharge.limit_mA);
    lower_for_current(limits.charge, config.limits.charge_overcurrent, -drawn_mA, LimitCause::charged_too_much,
                      top.charge.limit_mA);
  }
  // The missing value may be the one that limits.
  if (!pack.cell_voltage_uV.is_complete() || !pack.cell_temperature_dC.is_complete()) {
    keep_down(limits.discharge, inputs.before.discharge);
    keep_down(limits.charge, inputs.before.charge);
  }
  if (!inputs.may_discharge) limits.discharge = zero(LimitCause::fault);
  if (!inputs.may_charge) limits.charge = zero(LimitCause::fault);
  return limits;
}

}  // namespace bmu

#include "daemon/core/limits.hpp"

#include <array>
#include <cstdlib>

namespace bmu {

std::string_view to_text(LimitCause cause) {
  switch (cause) {
    case LimitCause::continuous: return "continuous limit";
    case LimitCause::not_connected: return "not connected";
    case LimitCause::fault: return "fault";
    case LimitCause::cell_voltage_low: return "cell voltage low";
    case LimitCause::cell_voltage_high: return "cell voltage high";
    case LimitCause::cell_hot: return "cell hot";
    case LimitCause::cell_cold: return "cell cold";
  }
  return "?";
}

namespace {

/// One reason to lower a current limit: what it watches, and which directions it concerns.
struct DeratingRow {
  LimitCause cause;
  LimitConfig LimitsConfig::*limit;
  Spread PackState::*spread;
  bool watches_min;
  bool limits_discharge;
  bool limits_charge;
};

constexpr std::array<DeratingRow, 4> derating_table{{
    {LimitCause::cell_voltage_low, &LimitsConfig::cell_undervoltage, &PackState::cell_voltage_uV, true, true, false},
    {LimitCause::cell_voltage_high, &LimitsConfig::cell_overvoltage, &PackState::cell_voltage_uV, false, false, true},
    {LimitCause::cell_hot, &LimitsConfig::cell_overtemperature, &PackState::cell_temperature_dC, false, true, true},
    {LimitCause::cell_cold, &LimitsConfig::cell_undertemperature, &PackState::cell_temperature_dC, true, true, true},
}};

/// 1000 at the warning threshold and before, 0 at the opening threshold and beyond, a straight line between.
std::int64_t share_permille(std::int64_t value, const LimitConfig& limit) {
  const std::int64_t span = std::llabs(std::int64_t{limit.warn} - limit.open);
  const std::int64_t room = limit.warn > limit.open ? value - limit.open : limit.open - value;
  if (room <= 0) return 0;
  return room >= span ? 1000 : room * 1000 / span;
}

CurrentLimit zero(LimitCause cause) {
  return {.limit_mA = 0, .cause = cause};
}

void lower(CurrentLimit& limit, const DeratingRow& row, const LimitConfig& config, const Spread& spread,
           std::int32_t continuous_mA) {
  const std::int32_t value = row.watches_min ? spread.min : spread.max;
  const std::int64_t allowed_mA = share_permille(value, config) * continuous_mA / 1000;
  if (allowed_mA >= limit.limit_mA) return;
  limit = {.limit_mA = static_cast<std::int32_t>(allowed_mA),
           .cause = row.cause,
           .value = value,
           .threshold = config.open,
           .element = row.watches_min ? spread.min_at : spread.max_at};
}

void keep_down(CurrentLimit& limit, const CurrentLimit& before) {
  if (before.limit_mA < limit.limit_mA) limit = before;
}

}  // namespace

CurrentLimits evaluate_limits(const PackState& pack, const CoreConfig& config, const LimitInputs& inputs) {
  if (!inputs.is_connected) return {zero(LimitCause::not_connected), zero(LimitCause::not_connected)};
  if (inputs.zero_is_demanded) return {zero(LimitCause::fault), zero(LimitCause::fault)};
  CurrentLimits limits{
      .discharge = {.limit_mA = config.current.discharge_continuous_mA, .cause = LimitCause::continuous},
      .charge = {.limit_mA = config.current.charge_continuous_mA, .cause = LimitCause::continuous}};
  for (const DeratingRow& row : derating_table) {
    const LimitConfig& limit = config.limits.*row.limit;
    const Spread& spread = pack.*row.spread;
    if (!spread.is_known()) continue;
    if (row.limits_discharge) lower(limits.discharge, row, limit, spread, config.current.discharge_continuous_mA);
    if (row.limits_charge) lower(limits.charge, row, limit, spread, config.current.charge_continuous_mA);
  }
  // The missing value may be the one that limits.
  if (!pack.cell_voltage_uV.is_complete() || !pack.cell_temperature_dC.is_complete()) {
    keep_down(limits.discharge, inputs.before.discharge);
    keep_down(limits.charge, inputs.before.charge);
  }
  return limits;
}

}  // namespace bmu

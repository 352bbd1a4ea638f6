#include "daemon/core/limits/power_limits.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "daemon/core/limits/current_prediction.hpp"
#include "daemon/core/types/memo.hpp"

namespace bmu {

namespace {

constexpr double per_thousand = 1e3;

struct LimitRow {
  CurrentLimit CurrentLimits::*current;
  PowerLimit PowerLimits::*power;
  double LoadResistance::*resistance_Ohm;
  double sign;  // of the current
};
constexpr std::array limit_rows{
    LimitRow{&CurrentLimits::discharge, &PowerLimits::discharge, &LoadResistance::peak_Ohm, 1.0},
    LimitRow{&CurrentLimits::charge, &PowerLimits::charge, &LoadResistance::peak_Ohm, -1.0},
    LimitRow{&CurrentLimits::discharge_continuous, &PowerLimits::discharge_continuous, &LoadResistance::continuous_Ohm,
             1.0},
    LimitRow{&CurrentLimits::charge_continuous, &PowerLimits::charge_continuous, &LoadResistance::continuous_Ohm, -1.0},
};

double or_else(double value, double otherwise) {
  return is_measured(value) ? value : otherwise;
}

double resistance_Ohm(const CellPoint& point, const CellDynamics& cell, double horizon_s) {
  double sum_Ohm = point.series_Ohm + point.kinetic_Ohm;
  for (std::size_t pair = 0; pair < CellDynamics::pairs; ++pair) {
    sum_Ohm -= point.pair_Ohm[pair] * std::expm1(-horizon_s / cell.pair_time_constant_s[pair]);
  }
  return sum_Ohm;
}

PowerLimit power_limit(const CurrentLimit& limit, const PackState& pack, double resistance_Ohm, double sign) {
  if (!pack.pack_voltage_mV.is_valid() || !pack.current_mA.is_valid()) {
    return {.cause = limit.limit_mA == 0 ? limit.cause : LimitCause::not_sensed};
  }
  const double limit_A = limit.limit_mA / per_thousand;
  const double now_V = pack.pack_voltage_mV.value / per_thousand;
  const double end_V = now_V + (pack.current_mA.value / per_thousand - sign * limit_A) * resistance_Ohm;
  const double power_W = limit_A * std::max(std::min(now_V, end_V), 0.0);
  return {.limit_W = static_cast<std::int32_t>(std::floor(power_W)), .cause = limit.cause};
}

}  // namespace

LoadResistance load_resistance(const PackEstimate& estimate) {
  LoadResistance resistance;
  const CellDynamics& cell = estimate.model();
  if (cell.rows.empty()) return resistance;
  constexpr double sigmas = 2.0;
  Memo<double, CellDynamics::Row> rows;
  for (std::size_t number = 0; number < estimate.size(); ++number) {
    const CellForecastInput known = estimate.forecast_input(number);
    const double temperature_C = or_else(known.temperature_C, cell.rows[0].temperature_C);
    const CellDynamics::Row& row = rows.of(temperature_C, [&] { return row_at(cell, temperature_C); });
    const CellPoint point = at(row, known.soc.is_known ? known.soc.soc : 0.0);
    const double share = 1.0 + or_else(known.resistance_share, 0.0) + sigmas * or_else(known.resistance_sigma, 0.0);
    resistance.peak_Ohm += share * resistance_Ohm(point, cell, forecast_peak_s);
    resistance.continuous_Ohm += share * resistance_Ohm(point, cell, forecast_continuous_s);
  }
  return resistance;
}

PowerLimits power_limits(const CurrentLimits& limits, const PackState& pack, const LoadResistance& resistance) {
  PowerLimits powers;
  for (const LimitRow& row : limit_rows) {
    powers.*row.power = power_limit(limits.*row.current, pack, resistance.*row.resistance_Ohm, row.sign);
  }
  return powers;
}

void lower_to_power(CurrentLimits& limits, const PackState& pack, const PackLimitsConfig& config) {
  if (config.power_max_W == 0) return;
  constexpr std::int64_t uW_per_W = 1'000'000;
  const Measured<std::int32_t>& voltage_mV = pack.pack_voltage_mV;
  const bool is_known = voltage_mV.is_valid() && voltage_mV.value > 0;
  for (const LimitRow& row : limit_rows) {
    CurrentLimit& limit = limits.*row.current;
    const std::int64_t allowed_mA = is_known ? config.power_max_W * uW_per_W / voltage_mV.value : 0;
    if (allowed_mA >= limit.limit_mA) continue;
    const CurrentLimit before = limit;
    limit = {.limit_mA = static_cast<std::int32_t>(allowed_mA),
             .cause = is_known ? LimitCause::power : LimitCause::not_sensed,
             .value = is_known ? voltage_mV.value : 0,
             .threshold = config.power_max_W,
             .unhindered_mA = before.limit_mA};
  }
}

}  // namespace bmu

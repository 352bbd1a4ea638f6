// Permissible power: that which the vehicle may draw and the charger may supply, now and for the next ten seconds, and
// continuously. It is the current limit of the same name times the pack voltage at the end of that time:
//
//   V_end = V + (I - I_end) * R          P = I_limit * min(V, V_end), at least 0
//
// with V and I the measured pack voltage and current, I_end the current of the limit with its sign (positive out of the
// pack), and R the resistance that the cells' model shows within the time. A discharge that rises lowers the voltage,
// so that V_end counts; a charge that rises only raises it, so that V counts.
//
// The cause is that of the current limit. Without a usable pack voltage or current there is no permission: 0 W.
//
// Conversely, a pack may have a maximum power in either direction (pack_limits/power_max_W): the current is then at
// most that power at the measured voltage.
//
// Evaluated when queried. Cost: for the resistance one evaluation of the model a cell, and one temperature row for each
// module; else some multiplications. Pure and without allocation.
#pragma once

#include <cstdint>

#include "daemon/core/estimation/pack_estimate.hpp"
#include "daemon/core/limits/limits.hpp"
#include "daemon/core/measurement/pack_state.hpp"
#include "daemon/core/types/core_config.hpp"

namespace bmu {

struct PowerLimit {
  std::int32_t limit_W = 0;  // a magnitude, in the direction of its name
  LimitCause cause = LimitCause::not_connected;
};

/// As CurrentLimits.
struct PowerLimits {
  PowerLimit discharge;
  PowerLimit charge;
  PowerLimit discharge_continuous;
  PowerLimit charge_continuous;
};

/// Resistance of the whole pack to a current of some duration, Ohm, 0 or more.
struct LoadResistance {
  double peak_Ohm = 0.0;        // after forecast_peak_s
  double continuous_Ohm = 0.0;  // after forecast_continuous_s
};

/// Sum of all cells at their state of charge and temperature, with two standard deviations of their resistance. An
/// unknown state of charge counts as empty, an unknown temperature as the coldest row of the model.
[[nodiscard]] LoadResistance load_resistance(const PackEstimate& estimate);

[[nodiscard]] PowerLimits power_limits(const CurrentLimits& limits, const PackState& pack,
                                       const LoadResistance& resistance);

/// Lowers each limit to `power_max_W` at the measured pack voltage, and to 0 while that is unknown. The cause is then
/// `power` (value: the pack voltage in mV, threshold: the power in W) or `not_sensed`. No effect if the pack file has
/// no such power.
void lower_to_power(CurrentLimits& limits, const PackState& pack, const PackLimitsConfig& config);

}  // namespace bmu

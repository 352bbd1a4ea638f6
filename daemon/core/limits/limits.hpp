// Permitted currents of the pack in both directions, and the causes that limit them. The vehicle receives them in 624h.
//
// For each direction there are two: the current permitted now and for some ten seconds, which is sent to the vehicle
// and the charger, and the current permitted continuously. Each is the smallest of
//
//   - the rating of the pack: the peak, which falls to the continuous current while the excess heat is used up, and
//     reaches it before all of it is: a permitted current never opens the pack for that;
//   - the monitored thresholds: from the middle tier to the opening threshold the permitted current falls linearly to
//     zero (BMU_13: limit before opening), also that of the current itself, where it has a tier of its own;
//   - the cell's tables: its current in the cold, in the heat, full and empty (BMU_15);
//   - the current that the predicted voltages permit for ten seconds, and continuously (current_prediction.hpp);
//   - the ratings of the components that the current flows through, and the user's limits;
//
// and has the name of its cause. Without permission it is zero. A power limit of the whole pack (power_limits.hpp) is
// applied after the ramps of the limits: such a rule does not wait for a ramp.
//
// If the pack file has one, there is a floor under the discharge current: tables and linear deratings do not lower it
// further. Opening thresholds, ratings of components, the user's limits and predicted voltages do. There is none for
// charging.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "daemon/core/measurement/pack_state.hpp"
#include "daemon/core/types/core_config.hpp"

namespace bmu {

enum class LimitCause : std::uint8_t {
  continuous,      // no other cause: the continuous rating of the pack
  peak,            // or its peak rating, for a limited time
  overload,        // the peak is being used up
  drawn_too_much,  // beyond the middle tier of the current's own threshold
  charged_too_much,
  not_connected,  // contactors are not closed, or may not stay so
  fault,          // a fault requires zero current
  cell_voltage_low,
  cell_voltage_high,
  cell_imbalance,
  cell_hot,
  cell_cold,
  too_hot_to_charge,
  too_cold_to_charge,
  temperature_spread,
  board_hot,
  voltage_would_fall,  // too low, within the time for which the limit is meant
  voltage_would_rise,  // too high
  cold,                // the cell's table over temperature
  hot,                 //
  empty,               // its table over the state of charge
  full,                //
  charge_not_known,    // there is such a table, and the SOC of the cells is unknown
  component,           // a component that the current flows through
  user,                // a lower limit of the user
  limp_home,           // would be less, but for the floor in the pack file
  measuring,           // a charger is paused to measure the cells' resistances (charge_pause.hpp)
  rising,              // ramping up to a higher target (limit_ramp.hpp)
  power,               // power limit of the pack as a whole (power_limits.hpp)
  not_sensed,          // such a power limit, and the pack voltage or current is unknown
};

[[nodiscard]] std::string_view to_text(LimitCause cause);

/// True if its value was measured, and changes with every sample.
[[nodiscard]] bool is_measured_cause(LimitCause cause);

/// True if a limit of zero with this cause protects the pack.
[[nodiscard]] bool is_protection(LimitCause cause);

struct CurrentLimit {
  std::int32_t limit_mA = 0;  // a magnitude, in the direction of its name
  LimitCause cause = LimitCause::not_connected;
  std::int32_t value = 0;         // of the cause, in the unit of the monitored threshold, table or voltage
  std::int32_t derates_from = 0;  // where the linear derating starts; of a table: the share, permille
  /// Value at which the limit reaches zero; of a peak: at which it is used up, and the pack opens; of a predicted
  /// voltage: at which it is held.
  std::int32_t threshold = 0;
  Element element{};
  std::int32_t unhindered_mA = 0;  // start of the derating: the limit without this cause; of `rising`: its target
  std::uint8_t part = 0;           // of `component`: its position in the pack file, from 0
};

struct CurrentLimits {
  CurrentLimit discharge;             // now, and for ten seconds
  CurrentLimit charge;                //
  CurrentLimit discharge_continuous;  // continuously; never more than the above
  CurrentLimit charge_continuous;     //
};

/// Limit by a predicted voltage; pack_forecast.hpp makes it.
struct PredictedLimit {
  bool is_known = false;
  std::int32_t limit_mA = 0;
  std::int32_t voltage_uV = 0;  // present voltage of the limiting cell
  std::int32_t holds_uV = 0;    // at which its voltage is held
  Element element{};
};
struct PredictedLimits {
  PredictedLimit discharge;
  PredictedLimit charge;
  PredictedLimit discharge_continuous;
  PredictedLimit charge_continuous;
  bool is_complete = true;  // false: some cell could not be predicted; then limits do not rise
};

struct LimitInputs {
  bool is_connected = false;  // closed and permitted to stay so
  bool may_discharge = false;
  bool may_charge = false;
  std::int64_t discharge_used_permille = 0;  // of the peak
  std::int64_t charge_used_permille = 0;
  CurrentLimits before{};  // of the last tick: while a cell or temperature is missing, limits do not rise
  std::optional<std::int32_t> soc_min_permille{};  // of the emptiest cell; not given: unknown
  std::optional<std::int32_t> soc_max_permille{};  // of the fullest
  bool is_charge_paused = false;                   // to measure resistances
  PredictedLimits predicted{};                     // not known: no limit by predicted voltages
};

[[nodiscard]] CurrentLimits evaluate_limits(const PackState& pack, const CoreConfig& config, const LimitInputs& inputs);

/// Ratings of the pack, limited by all its components and by the user: the counter of the excess heat uses them.
[[nodiscard]] CurrentLimitConfig carried(const CoreConfig& config);

}  // namespace bmu

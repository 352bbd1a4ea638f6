// How much current the pack may give and take now, and why not more. What the vehicle is told in 624h.
//
// For each direction there are two: what may flow at this moment and for some ten seconds, which the vehicle and the
// charger are told, and what may flow for long. Each is the smallest of
//
//   - what the pack carries: the peak, which sinks to the continuous current while the excess heat is used up, and is
//     there before all of it is: who draws what is allowed is never opened for it;
//   - the watched limits: from the middle tier to the opening threshold the allowed current falls in a straight line to
//     zero (BMU_13: limit before opening), also that of the current itself, where it has a tier of its own;
//   - the cell's tables: what it may carry in the cold, in the heat, full and empty (BMU_15);
//   - what the voltages will bear for ten seconds, and for long (current_prediction.hpp);
//   - the parts that the current flows through, and what the user wants;
//
// and has the name of what binds it. Without permission it is zero. What a power of the whole pack leaves of them
// (power_limits.hpp) is taken after the limits have moved: such a rule does not wait for a ramp.
//
// Only where the pack file says so there is a floor under what may be drawn: tables and lines do not take it below.
// What opens, what parts bear and what the voltages will bear does. There is none for charging.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "daemon/core/measurement/pack_state.hpp"
#include "daemon/core/types/core_config.hpp"

namespace bmu {

enum class LimitCause : std::uint8_t {
  continuous,      // nothing special: what the pack carries for ever
  peak,            // or more, for a while
  overload,        // the peak is being used up
  drawn_too_much,  // beyond the middle tier of the current's own limit
  charged_too_much,
  not_connected,  // contactors are not closed, or may not stay so
  fault,          // a fault asks for zero current
  cell_voltage_low,
  cell_voltage_high,
  cell_imbalance,
  cell_hot,
  cell_cold,
  too_hot_to_charge,
  too_cold_to_charge,
  temperature_spread,
  board_hot,
  voltage_would_fall,  // too low, before the time is over for which the limit is meant
  voltage_would_rise,  // too high
  cold,                // the cell's table over temperature
  hot,                 //
  empty,               // its table over the state of charge
  full,                //
  charge_not_known,    // there is such a table, and nobody knows where on it the cells are
  component,           // a part that the current flows through
  user,                // less is wanted
  limp_home,           // would be less, but for the floor in the pack file
  measuring,           // a charger is paused to see the cells' resistances (charge_pause.hpp)
  rising,              // could be more, and is on its way there (limit_ramp.hpp)
  power,               // what the pack as a whole may give or take (power_limits.hpp)
  not_sensed,          // such a power, and the pack voltage or current is not known
};

[[nodiscard]] std::string_view to_text(LimitCause cause);

/// Its value was measured, and moves with every sample.
[[nodiscard]] bool is_measured_cause(LimitCause cause);

/// A limit of zero for this is none of comfort.
[[nodiscard]] bool is_protection(LimitCause cause);

struct CurrentLimit {
  std::int32_t limit_mA = 0;  // a magnitude, in the direction of its name
  LimitCause cause = LimitCause::not_connected;
  std::int32_t value = 0;         // what caused it, in the unit of the watched limit, table or voltage
  std::int32_t derates_from = 0;  // where the line begins along which the limit falls; of a table: the share, permille
  /// At which it reaches zero; of a peak: at which all of it is used up, and it opens; of a voltage that would fall or
  /// rise: where it is held.
  std::int32_t threshold = 0;
  Element element{};
  std::int32_t unhindered_mA = 0;  // what the line begins with: the limit without this cause; of `rising`: its target
  std::uint8_t part = 0;           // of `component`: which in the pack file, from 0
};

struct CurrentLimits {
  CurrentLimit discharge;             // now, and for ten seconds
  CurrentLimit charge;                //
  CurrentLimit discharge_continuous;  // for long; never more than the above
  CurrentLimit charge_continuous;     //
};

/// What the voltages will bear; pack_forecast.hpp makes it.
struct PredictedLimit {
  bool is_known = false;
  std::int32_t limit_mA = 0;
  std::int32_t voltage_uV = 0;  // of the cell that binds, now
  std::int32_t holds_uV = 0;    // where its voltage is held
  Element element{};
};
struct PredictedLimits {
  PredictedLimit discharge;
  PredictedLimit charge;
  PredictedLimit discharge_continuous;
  PredictedLimit charge_continuous;
  bool is_complete = true;  // false: of some cell nothing could be said; then limits do not rise
};

struct LimitInputs {
  bool is_connected = false;  // closed and permitted to stay so
  bool may_discharge = false;
  bool may_charge = false;
  std::int64_t discharge_used_permille = 0;  // of the peak
  std::int64_t charge_used_permille = 0;
  CurrentLimits before{};  // of the last tick: while a cell or temperature is missing, limits do not rise
  std::optional<std::int32_t> soc_min_permille{};  // of the emptiest cell; not given: not known
  std::optional<std::int32_t> soc_max_permille{};  // of the fullest
  bool is_charge_paused = false;                   // to measure
  PredictedLimits predicted{};                     // not known: nothing is said of the voltages to come
};

[[nodiscard]] CurrentLimits evaluate_limits(const PackState& pack, const CoreConfig& config, const LimitInputs& inputs);

/// What the pack carries through all its parts, and as the user wants it: what the counter of the excess heat is to
/// count with.
[[nodiscard]] CurrentLimitConfig carried(const CoreConfig& config);

}  // namespace bmu

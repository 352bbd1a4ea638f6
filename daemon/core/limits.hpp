// How much current the pack may give and take now, and why not more. What the vehicle is told in 624h.
//
// Above stands the peak current, which sinks to the continuous one while the excess heat is used up, and is there
// before all of it is: who draws what is allowed is never opened for it. A current beyond the middle tier of its own
// limit, where that has one, is answered with less. From a limit's middle tier to its opening threshold the allowed
// current falls in a straight line to zero (BMU_13: limit before opening). Without permission it is zero. The smallest
// wins and is the cause that is reported.
#pragma once

#include <cstdint>
#include <string_view>

#include "daemon/core/core_config.hpp"
#include "daemon/core/pack_state.hpp"

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
};

[[nodiscard]] std::string_view to_text(LimitCause cause);

struct CurrentLimit {
  std::int32_t limit_mA = 0;  // a magnitude, in the direction of its name
  LimitCause cause = LimitCause::not_connected;
  std::int32_t value = 0;         // what caused it, in the unit of the watched limit
  std::int32_t derates_from = 0;  // where the line begins along which the limit falls
  std::int32_t threshold = 0;     // at which it reaches zero; of a peak: at which all of it is used up, and it opens
  Element element;
  std::int32_t unhindered_mA = 0;  // what the line begins with: the limit without this cause
};

struct CurrentLimits {
  CurrentLimit discharge;
  CurrentLimit charge;
};

struct LimitInputs {
  bool is_connected = false;  // closed and permitted to stay so
  bool may_discharge = false;
  bool may_charge = false;
  std::int64_t discharge_used_permille = 0;  // of the peak
  std::int64_t charge_used_permille = 0;
  CurrentLimits before{};  // of the last tick: while a cell or temperature is missing, limits do not rise
};

[[nodiscard]] CurrentLimits evaluate_limits(const PackState& pack, const CoreConfig& config, const LimitInputs& inputs);

}  // namespace bmu

// How much current the pack may give and take now, and why not more. What the vehicle is told in 624h.
//
// Between a limit's warning and its opening threshold the current limit falls in a straight line from the continuous
// value to zero (BMU_13: limit before opening). Without permission both limits are zero. The smallest wins and is the
// cause that is reported.
#pragma once

#include <cstdint>
#include <string_view>

#include "daemon/core/core_config.hpp"
#include "daemon/core/pack_state.hpp"

namespace bmu {

enum class LimitCause : std::uint8_t {
  continuous,     // nothing special: the configured continuous current
  not_connected,  // contactors are not closed, or may not stay so
  fault,          // a fault asks for zero current before it opens
  cell_voltage_low,
  cell_voltage_high,
  cell_hot,
  cell_cold,
};

[[nodiscard]] std::string_view to_text(LimitCause cause);

struct CurrentLimit {
  std::int32_t limit_mA = 0;  // a magnitude, in the direction of its name
  LimitCause cause = LimitCause::not_connected;
  std::int32_t value = 0;      // what caused it, in the unit of the watched limit
  std::int32_t threshold = 0;  // at which the limit reaches zero
  Element element;
};

struct CurrentLimits {
  CurrentLimit discharge;
  CurrentLimit charge;
};

struct LimitInputs {
  bool is_connected = false;      // closed and permitted to stay so
  bool zero_is_demanded = false;  // by a fault with a grace
  CurrentLimits before{};         // of the last tick: while a cell or temperature is missing, limits do not rise
};

[[nodiscard]] CurrentLimits evaluate_limits(const PackState& pack, const CoreConfig& config, const LimitInputs& inputs);

}  // namespace bmu

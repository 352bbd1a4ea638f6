// Current through a balancing resistor.
#pragma once

#include <cstdint>

#include "daemon/core/types/core_config.hpp"

namespace bmu {

/// Current that the bleed resistor draws from a cell at `voltage_uV`.
[[nodiscard]] constexpr std::int64_t bleed_uA(std::int32_t voltage_uV, const BalancingConfig& config) {
  return voltage_uV / config.bleed_resistance_Ohm;
}

}  // namespace bmu

// What a balancing resistor takes from its cell.
#pragma once

#include <cstdint>

#include "daemon/core/types/core_config.hpp"

namespace bmu {

/// The current a resistor takes from a cell.
[[nodiscard]] constexpr std::int64_t bleed_uA(std::int32_t voltage_uV, const BalancingConfig& config) {
  return voltage_uV / config.bleed_resistance_Ohm;
}

}  // namespace bmu

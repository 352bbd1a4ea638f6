// Part of the pack that a value belongs to.
#pragma once

#include <cstdint>

#include "daemon/core/types/contactor_id.hpp"

namespace bmu {

/// The cell, sensor, module, contactor or input that a value belongs to. All zero: the pack itself.
struct Element {
  std::uint8_t module_node = 0;   // 1 to 63
  std::uint8_t number = 0;        // cell or sensor within the module, from 1; board sensors follow the cell sensors
  std::uint16_t pack_number = 0;  // counted through the whole pack, from 1
  bool is_temperature_sensor = false;
  std::uint8_t contactor = 0;  // 1 + ContactorId
  std::uint8_t input = 0;      // number of an emergency stop, interlock or other input, from 1

  [[nodiscard]] constexpr bool are_fields_possible() const { return contactor <= contactor_id_count; }
  friend constexpr bool operator==(const Element&, const Element&) = default;
};

}  // namespace bmu

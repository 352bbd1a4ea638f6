// Where in the pack something is.
#pragma once

#include <cstdint>

#include "daemon/core/types/contactor_id.hpp"

namespace bmu {

/// Which cell, sensor, module, contactor or input a value belongs to. Zeros: the pack itself.
struct Element {
  std::uint8_t module_node = 0;   // 1 to 63
  std::uint8_t number = 0;        // cell or sensor within the module, from 1; board sensors follow those of the cells
  std::uint16_t pack_number = 0;  // counted through the whole pack, from 1
  bool is_temperature_sensor = false;
  std::uint8_t contactor = 0;  // 1 + ContactorId
  std::uint8_t input = 0;      // number of an emergency stop, interlock or other line, from 1

  [[nodiscard]] constexpr bool are_fields_possible() const { return contactor <= contactor_id_count; }
  friend constexpr bool operator==(const Element&, const Element&) = default;
};

}  // namespace bmu

// Contacts and inputs read from the GPIO lines of this host at one instant: the same signals as in PDU_STATUS, as far
// as there are lines for them.
#pragma once

#include <cstdint>

namespace bmu {

struct LineImage {
  bool is_failed = false;  // the lines cannot be read or driven: the values below are invalid
  // Auxiliary contacts, bit by ContactorId.
  std::uint8_t closed_contacts = 0;
  bool vehicle_on = false;
  bool charger_connected = false;
  bool resume_button = false;
  bool insulation_ok = false;
  bool supply_ok = false;
  // Emergency stops that are pressed and interlocks that are open, bits in the order of the pack file. A line that was
  // so even briefly since the previous image is included.
  std::uint16_t estops_pressed = 0;
  std::uint16_t interlocks_open = 0;

  friend constexpr bool operator==(const LineImage&, const LineImage&) = default;
};

}  // namespace bmu

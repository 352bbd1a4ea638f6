// What the lines of this machine say about contactors and inputs, taken at one moment: the same things PDU_STATUS says,
// as far as there are lines for them.
#pragma once

#include <cstdint>

namespace bmu {

struct LineImage {
  bool is_failed = false;  // the lines cannot be read or driven: nothing below means anything
  // Auxiliary contacts, bit by ContactorId.
  std::uint8_t closed_contacts = 0;
  bool vehicle_on = false;
  bool charger_connected = false;
  bool resume_button = false;
  bool insulation_ok = false;
  bool supply_ok = false;
  // Emergency stops that are pressed, and interlocks that are open, bit by their order in the pack file. A line that
  // was so for a moment since the last image counts as being so.
  std::uint16_t estops_pressed = 0;
  std::uint16_t interlocks_open = 0;

  friend constexpr bool operator==(const LineImage&, const LineImage&) = default;
};

}  // namespace bmu

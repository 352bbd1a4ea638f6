// Whether the daemon configures the CAN interfaces it uses, and their settings besides the bit rate of the internal
// bus.
#pragma once

#include <cstdint>

namespace bmu {

struct InterfaceConfig {
  bool set_up = false;
  std::int32_t vehicle_kbit_per_s = 500;      // of the vehicle bus, if it has an interface of its own
  std::int32_t charger_kbit_per_s = 0;        // of the charger's; 0: the first that every device there supports
  std::int32_t second_pack_kbit_per_s = 500;  // and of the second pack's
  std::int32_t inverter_kbit_per_s = 500;     // and of the inverter's
  std::int32_t restart_ms = 200;              // after bus-off; 0: the controller stays off the bus
};

}  // namespace bmu

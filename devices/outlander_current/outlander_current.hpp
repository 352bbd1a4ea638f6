// Current sensor of a Mitsubishi Outlander PHEV at its place in the car's battery: the frame of a LEM CAB, 3C2h every
// 10 ms with eight bytes, b4 = C8h and zeros after it.
//
// Below zero is discharge: in a capture of the precharge the sum of the 80 cells falls by 0.43 V at a raw value of -7.7
// A, and the car's own message of the current agrees in sign and size. The driver inverts the sign, so that a current
// out of the pack is positive as everywhere. A sensor that was removed and mounted in the opposite direction needs
// `sensor/invert_current`.
#pragma once

#include "devices/device.hpp"
#include "devices/lem_cab/lem_cab.hpp"

namespace bmu::outlander_current {

inline constexpr const MessageSpec* rows[] = {&lem_cab::current};
inline constexpr Catalogue catalogue{"outlander_current", rows};

/// Defined in current_sensor.cpp.
extern const CurrentSensorDriver driver;

inline constexpr Device device{.name = "outlander_current",
                               .title = "Mitsubishi Outlander PHEV current sensor",
                               .kind = DeviceKind::current_sensor,
                               .catalogue = &catalogue,
                               .bit_rates = only_500k,
                               .meaning = "a LEM CAB as mounted in the car: below zero on the wire is discharge",
                               .current = &driver};

}  // namespace bmu::outlander_current

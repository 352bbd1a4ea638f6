// LEM CAB 300 and CAB 500, a current sensor: one frame every 10 ms, big-endian, 500 kbit/s. The sensor of the
// Mitsubishi Outlander sends the same.
//
// What is not agreed on: the length, six bytes to some readers and eight to others. What may stand behind the fifth
// (name and version of its software, to one of them) is not told here, and any length from six to eight is taken. A
// sensor of the same name that sends 24 bits under 3C0h to 3C2h is another one. FFFFFFFFh, beyond what it can measure,
// is taken for a fault. In the car, positive is discharge.
#pragma once

#include "devices/device.hpp"
#include "devices/fields.hpp"

namespace bmu::lem_cab {

inline constexpr SpecialCode current_codes[] = {{0xFFFF'FFFF, Validity::sensor_fault}};
inline constexpr std::int64_t raw_of_no_current = 0x8000'0000;
inline constexpr field::Quantity current_mA{Unit::mA, 1, -raw_of_no_current};
/// Twice what the larger of the two is named after. A bound of ours: what is beyond it no such sensor has measured.
inline constexpr std::int64_t range_mA = 1'000'000;
/// What stands in `error_information` while nothing is wrong.
inline constexpr std::int64_t all_well = 0x64;
inline constexpr RawName error_names[] = {{all_well, "none"}};

inline constexpr SignalSpec current_signals[] = {
    field::within(raw_of_no_current - range_mA, raw_of_no_current + range_mA,
                  field::big("pack_current_mA", 0, 4, current_mA, current_codes)),
    field::bits("error_information", 4, 7, 7, error_names),
    field::flag("error", 4, 0),
};

inline constexpr MessageSpec current{.name = "LEM_CURRENT",
                                     .base_id = 0x3C2,
                                     .length = 8,
                                     .length_min = 6,
                                     .sender = Sender::sensor,
                                     .period = 10ms,
                                     .signals = current_signals,
                                     .meaning = "pack current, positive = discharge in the car"};

inline constexpr const MessageSpec* rows[] = {&current};
inline constexpr Catalogue catalogue{"lem_cab", rows};

extern const CurrentSensorDriver driver;

inline constexpr Device device{.name = "lem_cab",
                               .title = "LEM CAB 300 / CAB 500 current sensor",
                               .kind = DeviceKind::current_sensor,
                               .catalogue = &catalogue,
                               .bit_rates = only_500k,
                               .meaning = "the current, a hundred times a second, without counter and checksum",
                               .current = &driver};

}  // namespace bmu::lem_cab

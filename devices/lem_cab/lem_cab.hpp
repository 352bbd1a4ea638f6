// LEM CAB 300 and CAB 500, a current sensor: one frame every 10 ms, big-endian, 500 kbit/s. The sensor of the
// Mitsubishi Outlander sends the same (outlander_current).
//
// The sign of the value is that of the mounting: nothing in the frame gives the direction out of the pack. The signal
// is therefore no `pack_current_mA`.
//
// Sensors as delivered send eight bytes that end with CAh B5h 16h; some sources have six. Any length from six to eight
// is accepted, and the bytes after the fifth are not decoded. Several sensors on one bus use 3C2h to 3CAh; only 3C2h is
// decoded. A sensor of the same name that sends 24 bits under 3C0h to 3C2h is another type. FFFFFFFFh, beyond the
// measuring range, is a fault of the sensor. A frame with a b4 other than C8h and a value beyond the range is a frame
// of another device.
#pragma once

#include "devices/device.hpp"
#include "devices/fields.hpp"

namespace bmu::lem_cab {

inline constexpr SpecialCode current_codes[] = {{0xFFFF'FFFF, Validity::sensor_fault}};
inline constexpr std::int64_t raw_of_no_current = 0x8000'0000;
inline constexpr field::Quantity offset_binary_mA{Unit::mA, 1, -raw_of_no_current};
/// Twice the nominal current of the larger of the two. A bound chosen by this program: no such sensor measures beyond
/// it.
inline constexpr std::int64_t range_mA = 1'000'000;
/// `error_information` without an error.
inline constexpr std::int64_t all_well = 0x64;
inline constexpr RawName error_names[] = {{all_well, "none"}};

inline constexpr SignalSpec current_signals[] = {
    field::within(raw_of_no_current - range_mA, raw_of_no_current + range_mA,
                  field::big("sensor_current_mA", 0, 4, offset_binary_mA, current_codes)),
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
                                     .meaning =
                                         "current in the sensor's own direction; below zero = discharge in an "
                                         "Outlander"};

inline constexpr const MessageSpec* rows[] = {&current};
inline constexpr Catalogue catalogue{"lem_cab", rows};

extern const CurrentSensorDriver driver;

/// Decodes a frame of the sensor, in its own direction.
[[nodiscard]] CurrentNews take(const CanFrame& frame);
/// Encodes a current in the sensor's own direction.
[[nodiscard]] CanFrame report(const SignalValue& current_mA);

inline constexpr Device device{.name = "lem_cab",
                               .title = "LEM CAB 300 / CAB 500 current sensor",
                               .kind = DeviceKind::current_sensor,
                               .catalogue = &catalogue,
                               .bit_rates = only_500k,
                               .meaning = "the current, a hundred times a second, without counter and checksum",
                               .current = &driver};

}  // namespace bmu::lem_cab

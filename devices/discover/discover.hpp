// Protocol of Discover's batteries, which some inverters support: SMA's frames with the voltage of 356h in tenths of a
// volt, in captures of a pack of 52.2 V, and b4-5 of 355h not filled. Little-endian, 500 kbit/s. No document of its
// manufacturer was available: the other frames are those common to all protocols.
#pragma once

#include "devices/device.hpp"
#include "devices/inverter_fields.hpp"

namespace bmu::discover {

inline constexpr SignalSpec charge_signals[] = {inverter::soc, inverter::soh};

inline constexpr MessageSpec limits =
    inverter::sent("DISCOVER_LIMITS", 0x351, inverter::limit_signals, "voltages and currents the battery allows");
inline constexpr MessageSpec charge =
    inverter::sent("DISCOVER_CHARGE", 0x355, charge_signals, "state of charge and health", 4);
inline constexpr MessageSpec measurements =
    inverter::sent("DISCOVER_MEASURES", 0x356, inverter::coarse_measurement_signals,
                   "voltage in tenths, current, temperature of the battery", 6);
inline constexpr MessageSpec items =
    inverter::sent("DISCOVER_ALARMS", 0x35A, inverter::item_signals, "alarms and warnings that came or went");
inline constexpr MessageSpec maker =
    inverter::sent("DISCOVER_MAKER", 0x35E, inverter::name_signals, "who made the battery");
inline constexpr MessageSpec keep_alive =
    inverter::heard("DISCOVER_ALIVE", 0x305, {}, "the inverter is there; no meaning of its bytes is known");

inline constexpr const MessageSpec* rows[] = {&limits, &charge, &measurements, &items, &maker, &keep_alive};
inline constexpr Catalogue catalogue{"discover", rows};

extern const InverterDriver driver;

inline constexpr Device device{.name = "discover",
                               .title = "inverter that understands Discover batteries",
                               .kind = DeviceKind::inverter,
                               .catalogue = &catalogue,
                               .bit_rates = only_500k,
                               .meaning = "limits, state and alarms, the voltage in tenths of a volt",
                               .inverter = &driver};

}  // namespace bmu::discover

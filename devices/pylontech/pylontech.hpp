// Pylontech's low-voltage protocol (version 1.2), which many inverters support: little-endian, 500 kbit/s, every frame
// once a second. The inverter sends a keep-alive once a second.
//
// Frames are read with the bytes that have a meaning and up to eight of them: the document does not give their lengths,
// and senders differ. Some units fill b6-7 of 351h with the discharge voltage limit, which the document does not use:
// it is decoded and never sent. b5-6 of 359h are "PN"; LG's batteries have other alarm bits under 359h, without this
// mark, which are not read. Some senders mix up bits of 359h (0Ch for too hot, which is too hot and undervoltage
// together; 80h for a system error): the bits here are those of the document.
#pragma once

#include "devices/device.hpp"
#include "devices/inverter_fields.hpp"

namespace bmu::pylontech {

inline constexpr SignalSpec limit_signals[] = {inverter::charge_voltage_limit, inverter::charge_current_limit,
                                               inverter::discharge_current_limit,
                                               inverter::optional_discharge_voltage_limit};
inline constexpr SignalSpec charge_signals[] = {inverter::soc, inverter::soh};

/// "PN". Without it the preceding bits are those of another manufacturer.
inline constexpr std::int64_t paper_mark = 0x50'4E;
namespace detail {

/// Signal that exists only in frames with the mark.
consteval SignalSpec marked(SignalSpec signal) {
  return field::when(paper_mark, signal);
}
consteval SignalSpec flag(std::string_view name, unsigned at, unsigned in_byte) {
  return marked(field::flag(name, at, in_byte));
}

}  // namespace detail

/// Protection: the battery has stopped. Alarm: it is about to stop.
inline constexpr SignalSpec alarm_signals[] = {
    field::within(paper_mark, paper_mark, field::letters("mark", 5, 2)),
    detail::flag("protection_discharge_overcurrent", 0, 7),
    detail::flag("protection_cold", 0, 4),
    detail::flag("protection_hot", 0, 3),
    detail::flag("protection_undervoltage", 0, 2),
    detail::flag("protection_overvoltage", 0, 1),
    detail::flag("protection_system_error", 1, 3),
    detail::flag("protection_charge_overcurrent", 1, 0),
    detail::flag("alarm_discharge_overcurrent", 2, 7),
    detail::flag("alarm_cold", 2, 4),
    detail::flag("alarm_hot", 2, 3),
    detail::flag("alarm_undervoltage", 2, 2),
    detail::flag("alarm_overvoltage", 2, 1),
    detail::flag("alarm_internal_communication", 3, 3),
    detail::flag("alarm_charge_overcurrent", 3, 0),
    detail::marked(field::u8("module_count", 4)),
};
inline constexpr SignalSpec request_signals[] =
    {
        field::flag("charge_enabled", 0, 7),      field::flag("discharge_enabled", 0, 6),
        field::flag("force_charge_1", 0, 5),      field::flag("force_charge_2", 0, 4),
        field::flag("full_charge_request", 0, 3),  // if 97 % has not been exceeded for 30 days
};

inline constexpr MessageSpec limits =
    inverter::sent("PYLON_LIMITS", 0x351, limit_signals, "voltage and currents the battery allows", 6);
inline constexpr MessageSpec charge =
    inverter::sent("PYLON_CHARGE", 0x355, charge_signals, "state of charge and health", 4);
inline constexpr MessageSpec measurements = inverter::sent("PYLON_MEASURES", 0x356, inverter::measurement_signals,
                                                           "voltage, current, temperature of the battery", 6);
inline constexpr MessageSpec alarms =
    inverter::sent("PYLON_ALARMS", 0x359, alarm_signals, "what has stopped the battery, and what is about to", 7);
inline constexpr MessageSpec requests =
    inverter::sent("PYLON_REQUESTS", 0x35C, request_signals, "what the battery allows and asks for", 1);
inline constexpr MessageSpec name = inverter::sent("PYLON_NAME", 0x35E, inverter::name_signals, "who made the battery");
inline constexpr MessageSpec keep_alive =
    inverter::heard("PYLON_ALIVE", 0x305, {}, "the inverter is there; its eight bytes are 0");

inline constexpr const MessageSpec* rows[] = {&limits, &charge, &measurements, &alarms, &requests, &name, &keep_alive};
inline constexpr Catalogue catalogue{"pylontech", rows};

extern const InverterDriver driver;

inline constexpr Device device{.name = "pylontech",
                               .title = "inverter that understands Pylontech batteries",
                               .kind = DeviceKind::inverter,
                               .catalogue = &catalogue,
                               .bit_rates = only_500k,
                               .meaning = "limits, state, alarms and requests of a low-voltage battery",
                               .inverter = &driver};

}  // namespace bmu::pylontech

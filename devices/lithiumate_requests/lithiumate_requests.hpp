// Requests for single values, as Elithion's Lithiumate answers them: a request has a parameter and a number (of a cell,
// a bank, a battery), the reply has up to four bytes. Big-endian; 125, 250, 500 kbit/s or 1 Mbit/s.
//
// The request's identifier may be another; the reply's is always 8 above. Only the parameters of the manufacturer's own
// table are decoded; any other shows the number of bytes, mode and parameter. The bits of the stored fault and of the
// warnings are those of 622h (protocol/tables/vehicle_bus_elithion.hpp); the manufacturer's sheet and other readers
// differ on the warnings. No source gives the unit of the time since power-up.
#pragma once

#include "devices/device.hpp"
#include "devices/fields.hpp"
#include "protocol/tables/vehicle_bus_elithion.hpp"

namespace bmu::lithiumate_requests {

inline constexpr std::uint32_t default_request_id = 0x745;
inline constexpr std::uint32_t reply_distance = 8;

inline constexpr RawName parameter_names[] = {{0x11, "cell status"},
                                              {0x14, "cell voltage"},
                                              {0x18, "cell temperature"},
                                              {0x1B, "cell resistance"},
                                              {0x20, "bank extent"},
                                              {0x21, "bank status"},
                                              {0x22, "bank missing"},
                                              {0x23, "bank lowest voltage"},
                                              {0x24, "bank average voltage"},
                                              {0x25, "bank highest voltage"},
                                              {0x26, "bank voltage"},
                                              {0x27, "bank coldest"},
                                              {0x28, "bank average temperature"},
                                              {0x29, "bank hottest"},
                                              {0x2A, "bank lowest resistance"},
                                              {0x2B, "bank average resistance"},
                                              {0x2C, "bank highest resistance"},
                                              {0x2D, "bank resistance"},
                                              {0x30, "battery extent"},
                                              {0x31, "battery status"},
                                              {0x32, "battery missing"},
                                              {0x33, "battery lowest voltage"},
                                              {0x34, "battery average voltage"},
                                              {0x35, "battery highest voltage"},
                                              {0x36, "battery voltage"},
                                              {0x37, "battery coldest"},
                                              {0x38, "battery average temperature"},
                                              {0x39, "battery hottest"},
                                              {0x3A, "battery lowest resistance"},
                                              {0x3B, "battery average resistance"},
                                              {0x3C, "battery highest resistance"},
                                              {0x3D, "battery resistance"},
                                              {0x40, "pack extent"},
                                              {0x41, "pack status"},
                                              {0x42, "pack missing"},
                                              {0x43, "pack lowest voltage"},
                                              {0x44, "pack average voltage"},
                                              {0x45, "pack highest voltage"},
                                              {0x46, "pack voltage"},
                                              {0x47, "pack coldest"},
                                              {0x48, "pack average temperature"},
                                              {0x49, "pack hottest"},
                                              {0x4A, "pack lowest resistance"},
                                              {0x4B, "pack average resistance"},
                                              {0x4C, "pack highest resistance"},
                                              {0x4D, "pack resistance"},
                                              {0x50, "state of charge"},
                                              {0x51, "capacity"},
                                              {0x52, "depth of discharge"},
                                              {0x53, "power"},
                                              {0x54, "energy in"},
                                              {0x55, "energy out"},
                                              {0x56, "state of health"},
                                              {0x60, "power cycles"},
                                              {0x61, "time since power-up"},
                                              {0x62, "faults"},
                                              {0x63, "relays"},
                                              {0x64, "charge limit"},
                                              {0x65, "discharge limit"},
                                              {0x66, "inputs"},
                                              {0x67, "outputs"},
                                              {0x68, "pack current"},
                                              {0x69, "average source current"},
                                              {0x6A, "average load current"},
                                              {0x6B, "source current"},
                                              {0x6C, "load current"},
                                              {0x70, "revision"},
                                              {0x71, "setting"}};
inline constexpr RawName request_mode_names[] = {{0x10, "read"}, {0x14, "clear"}, {0xA2, "force outputs"}};
inline constexpr RawName reply_mode_names[] = {{0x50, "read"}, {0x54, "cleared"}, {0xE2, "outputs forced"}};
inline constexpr RawName cell_status_names[] = {
    {0x01, "voltage read"},  {0x02, "temperature read"},  {0x04, "resistance known"}, {0x08, "balancing"},
    {0x10, "voltage fault"}, {0x20, "temperature fault"}, {0x40, "resistance fault"}, {0x80, "load fault"}};
inline constexpr RawName relay_names[] = {{0x00, "off"}, {0x11, "on"}};
inline constexpr RawName limit_cause_names[] = {{0, "none"},
                                                {1, "pack voltage low"},
                                                {2, "pack voltage high"},
                                                {3, "cell voltage low"},
                                                {4, "cell voltage high"},
                                                {5, "too hot to charge"},
                                                {6, "too cold to charge"},
                                                {7, "too hot to discharge"},
                                                {8, "too cold to discharge"},
                                                {9, "charge peak too long"},
                                                {10, "discharge peak too long"}};
inline constexpr RawName input_names[] = {
    {0x01, "source power"}, {0x02, "load power"},       {0x04, "interlock tripped"},   {0x08, "wired request"},
    {0x10, "CAN request"},  {0x20, "charging blocked"}, {0x40, "discharging blocked"}, {0x80, "fan on"}};
inline constexpr RawName output_names[] = {{0x01, "fault"},
                                           {0x02, "K1"},
                                           {0x04, "K2"},
                                           {0x08, "K3"},
                                           {0x10, "positive switch"},
                                           {0x20, "negative switch"},
                                           {0x40, "precharge test"},
                                           {0x80, "forced"}};

namespace detail {

/// As the manufacturer encodes them: a cell's voltage from 2 V on, degrees from -128, tenths of a milliohm.
inline constexpr field::Quantity voltage{Unit::uV, 10'000, 2'000'000};
inline constexpr field::Quantity temperature = field::degrees_from(-128);
inline constexpr field::Quantity resistance{Unit::uOhm, 100};
inline constexpr field::Quantity energy{Unit::mWh, 1'000'000};
inline constexpr field::Quantity power{Unit::W, 100};

inline constexpr SignalSpec parameter = field::named(field::u8("parameter", 2), parameter_names);
inline constexpr SignalSpec byte_count = field::u8("byte_count", 0);
inline constexpr SignalSpec number = field::u8("number", 3);

/// Signal of a bank (2Xh), a battery (3Xh) or the pack (4Xh): their parameters have the same last digit.
consteval SignalSpec of_any(unsigned last_digit, SignalSpec signal) {
  return field::when(0x20 + last_digit, signal, 3, 0x10);
}
consteval SignalSpec current(unsigned which, std::string_view name) {
  return field::when(which, field::as_signed(field::big(name, 4, 2, field::tenth_of_A)));
}

}  // namespace detail

inline constexpr SignalSpec request_signals[] = {
    detail::parameter,
    detail::byte_count,
    field::named(field::u8("mode", 1), request_mode_names),
    detail::number,
    field::when(0x67, field::bits("forced_bits", 4, 7, 8, output_names)),
    field::when(0x71, field::u8("new_value", 4)),
    field::when(0x71, field::big("write_key", 5, 3)),  // 123456h to write
};
inline constexpr SignalSpec reply_signals[] = {
    detail::parameter,
    detail::byte_count,
    field::named(field::u8("mode", 1), reply_mode_names),
    detail::number,
    field::when(0x11, field::bits("cell_status_bits", 4, 7, 8, cell_status_names)),
    field::when(0x11, field::u8("cell_loads_on", 5)),
    field::when(0x14, field::u8("cell_voltage_uV", 4, detail::voltage)),
    field::when(0x18, field::u8("cell_temperature_dC", 4, detail::temperature)),  // of boards with the load off
    field::when(0x18, field::u8("cell_temperature_any_dC", 6, detail::temperature)),
    field::when(0x1B, field::u8("cell_resistance_uOhm", 4, detail::resistance)),
    detail::of_any(0x0, field::u8("first_cell", 4)),
    detail::of_any(0x0, field::u8("cell_count", 5)),
    detail::of_any(0x0, field::u8("first_bank", 6)),
    detail::of_any(0x0, field::u8("bank_count", 7)),
    detail::of_any(0x1, field::u8("status_code", 4)),
    detail::of_any(0x1, field::u8("loads_on", 5)),
    detail::of_any(0x2, field::u8("missing_cell_count", 4)),
    detail::of_any(0x2, field::u8("missing_cell", 5)),
    detail::of_any(0x2, field::u8("missing_bank_count", 6)),
    detail::of_any(0x2, field::u8("missing_bank", 7)),
    detail::of_any(0x3, field::u8("cell_voltage_min_uV", 4, detail::voltage)),
    detail::of_any(0x3, field::u8("cell_voltage_min_cell", 5)),
    detail::of_any(0x4, field::u8("cell_voltage_average_uV", 4, detail::voltage)),
    detail::of_any(0x5, field::u8("cell_voltage_max_uV", 4, detail::voltage)),
    detail::of_any(0x5, field::u8("cell_voltage_max_cell", 5)),
    detail::of_any(0x6, field::big("total_voltage_mV", 4, 2, field::tenth_of_V)),
    detail::of_any(0x7, field::u8("temperature_min_dC", 4, detail::temperature)),
    detail::of_any(0x7, field::u8("temperature_min_cell", 5)),
    detail::of_any(0x7, field::u8("temperature_min_any_dC", 6, detail::temperature)),
    detail::of_any(0x7, field::u8("temperature_min_any_cell", 7)),
    detail::of_any(0x8, field::u8("temperature_average_dC", 4, detail::temperature)),
    detail::of_any(0x8, field::u8("temperature_average_any_dC", 6, detail::temperature)),
    detail::of_any(0x9, field::u8("temperature_max_dC", 4, detail::temperature)),
    detail::of_any(0x9, field::u8("temperature_max_cell", 5)),
    detail::of_any(0x9, field::u8("temperature_max_any_dC", 6, detail::temperature)),
    detail::of_any(0x9, field::u8("temperature_max_any_cell", 7)),
    detail::of_any(0xA, field::u8("cell_resistance_min_uOhm", 4, detail::resistance)),
    detail::of_any(0xA, field::u8("cell_resistance_min_cell", 5)),
    detail::of_any(0xB, field::u8("cell_resistance_average_uOhm", 4, detail::resistance)),
    detail::of_any(0xC, field::u8("cell_resistance_max_uOhm", 4, detail::resistance)),
    detail::of_any(0xC, field::u8("cell_resistance_max_cell", 5)),
    detail::of_any(0xD, field::big("total_resistance_uOhm", 4, 2, detail::resistance)),
    field::when(0x50, field::u8("soc_permille", 4, field::percent)),
    field::when(0x51, field::big("capacity_uAs", 4, 2, field::whole_Ah)),
    field::when(0x52, field::big("depth_of_discharge_uAs", 4, 2, field::whole_Ah)),
    field::when(0x53, field::as_signed(field::big("power_W", 4, 2, detail::power))),
    field::when(0x54, field::big("energy_in_mWh", 4, 3, detail::energy)),
    field::when(0x55, field::big("energy_out_mWh", 4, 3, detail::energy)),
    field::when(0x56, field::u8("soh_permille", 4, field::percent)),
    field::when(0x60, field::big("power_cycles", 4, 2)),
    field::when(0x61, field::big("time_since_power_up", 4, 3)),
    field::when(0x62, field::bits("fault_bits", 4, 7, 8, vehicle_bus_elithion::fault_names)),
    field::when(0x62, field::named(field::u8("stored_fault", 5), vehicle_bus_elithion::stored_fault_names)),
    field::when(0x62, field::bits("warning_bits", 6, 7, 8, vehicle_bus_elithion::warning_names)),
    field::when(0x63, field::named(field::u8("relays", 4), relay_names)),
    field::when(0x64, field::u8("limit_of_255", 4), 2),  // in 1/255 of the maximum
    field::when(0x64, field::named(field::u8("limit_cause", 5), limit_cause_names), 2),
    field::when(0x66, field::bits("input_bits", 4, 7, 8, input_names)),
    field::when(0x67, field::bits("output_bits", 4, 7, 8, output_names)),
    detail::current(0x68, "pack_current_mA"),
    detail::current(0x69, "average_source_current_mA"),
    detail::current(0x6A, "average_load_current_mA"),
    detail::current(0x6B, "source_current_mA"),
    detail::current(0x6C, "load_current_mA"),
    field::when(0x70, field::letters("revision", 4, 4)),
    field::when(0x71, field::u8("setting_value", 4)),
};

inline constexpr MessageSpec request{.name = "LITHIUMATE_REQUEST",
                                     .base_id = default_request_id,
                                     .sender = Sender::tool,
                                     .signals = request_signals,
                                     .meaning = "asks for a parameter, clears it or forces it"};
inline constexpr MessageSpec reply{.name = "LITHIUMATE_REPLY",
                                   .base_id = default_request_id + reply_distance,
                                   .sender = Sender::bmu,
                                   .signals = reply_signals,
                                   .meaning = "the parameter's value"};

inline constexpr const MessageSpec* rows[] = {&request, &reply};
inline constexpr Catalogue catalogue{"lithiumate_requests", rows};

inline constexpr Device device{.name = "lithiumate_requests",
                               .title = "Elithion Lithiumate, requests for single values",
                               .kind = DeviceKind::cell_requests,
                               .catalogue = &catalogue,
                               .bit_rates = any_bit_rate,
                               .meaning = "cells, banks, pack and settings, one request and one reply each"};

}  // namespace bmu::lithiumate_requests

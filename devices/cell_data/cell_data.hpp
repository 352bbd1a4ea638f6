// Cyclic messages with a pack's cell voltages and temperatures on the vehicle bus: sent by this daemon for other
// control units if the pack file gives them identifiers (vehicle/cell_voltages_id, cell_temperatures_id).
//
// A frame has three values, the first of which is number 3 * block + 1 through the pack; a round goes from block 0 to
// `last_block`, so that a receiver can determine how many blocks there are and when it has all of them. Big-endian; an
// unknown value, or one after the last cell or sensor, is FFFFh or 8000h. The identifiers are those of the
// documentation; the pack file may set others.
#pragma once

#include "devices/device.hpp"
#include "devices/fields.hpp"

namespace bmu::cell_data {

inline constexpr std::size_t values_per_frame = 3;

inline constexpr SpecialCode voltage_codes[] = {{0xFFFF, Validity::unknown}};
inline constexpr SpecialCode temperature_codes[] = {{-0x8000, Validity::unknown}};
inline constexpr field::Quantity tenth_of_mV{Unit::uV, 100};

inline constexpr SignalSpec voltage_signals[] = {
    field::u8("block", 0),
    field::u8("last_block", 1),
    field::big("cell_voltage_1_uV", 2, 2, tenth_of_mV, voltage_codes),
    field::big("cell_voltage_2_uV", 4, 2, tenth_of_mV, voltage_codes),
    field::big("cell_voltage_3_uV", 6, 2, tenth_of_mV, voltage_codes),
};
inline constexpr SignalSpec temperature_signals[] = {
    field::u8("block", 0),
    field::u8("last_block", 1),
    field::as_signed(field::big("cell_temperature_1_dC", 2, 2, field::tenth_of_C, temperature_codes)),
    field::as_signed(field::big("cell_temperature_2_dC", 4, 2, field::tenth_of_C, temperature_codes)),
    field::as_signed(field::big("cell_temperature_3_dC", 6, 2, field::tenth_of_C, temperature_codes)),
};
/// Index of the first value in both signal lists.
inline constexpr std::size_t first_value = 2;

inline constexpr MessageSpec voltages{.name = "CELL_VOLTAGES",
                                      .base_id = 0x650,
                                      .length = 8,
                                      .sender = Sender::bmu,
                                      .period = 1s,
                                      .signals = voltage_signals,
                                      .meaning = "three cells, the first is number 3 * block + 1"};
inline constexpr MessageSpec temperatures{.name = "CELL_TEMPERATURES",
                                          .base_id = 0x651,
                                          .length = 8,
                                          .sender = Sender::bmu,
                                          .period = 1s,
                                          .signals = temperature_signals,
                                          .meaning = "three sensors, the first is number 3 * block + 1"};

inline constexpr const MessageSpec* rows[] = {&voltages, &temperatures};
inline constexpr Catalogue catalogue{"cell_data", rows};

inline constexpr Device device{.name = "cell_data",
                               .title = "bmud, cell voltages and temperatures",
                               .kind = DeviceKind::cell_data,
                               .catalogue = &catalogue,
                               .bit_rates = any_bit_rate,
                               .meaning = "all cells and sensors of a pack, three in a frame, once a period"};

}  // namespace bmu::cell_data

// Modules of a Mitsubishi Outlander PHEV: ten of eight cells each, 500 kbit/s, big-endian, without counter and
// checksum. They send nothing until the master's frame is other than zeros, and answer each such frame with a burst
// about 30 ms later. The master of the car sends it every 40 ms, after four frames of zeros at the start.
//
// A module's number is the third digit of its identifiers: 611h to 614h are module 1, 6B1h to 6B4h module 11. The car
// has 1 to 5 and 7 to 11; 6 is a row here, too, as modules can be renumbered.
//
// An answer does not show which of the master's frames it belongs to. Those 30 ms are the only criterion: an answer
// within half of that time is late, and after a frame that no module answered it may be (ModuleTable).
//
// With balancing off the car's master sends 2.510 V as the target in the first 10 s, and then the voltage of the lowest
// cell. The daemon sends the lowest cell as soon as all cells are known.
//
// A module that balances does so by itself: it bleeds its cells above the voltage that the master sends, until the
// master disables balancing. Its behaviour without a master is unknown.
//
// Sources disagree on:
//   - the temperatures: bytes from -50 C on, which is used here; it fits frames of a car and the values the car itself
//     reported at that moment. Two readers take pairs of bytes as one number, which those frames contradict;
//   - which of 6X2 and 6X3 has cells 1 to 4: 6X2 in all working implementations, 6X3 in one document;
//   - b3 of the master's frame: 0 in the car, 4 in all others. Its bit 2 may allow modules to be renumbered: send 0.
// The current sensor's value is in its own direction: below zero is discharge (outlander_current).
#pragma once

#include "devices/device.hpp"
#include "devices/fields.hpp"
#include "devices/lem_cab/lem_cab.hpp"

namespace bmu::outlander_cmu {

inline constexpr std::uint8_t node_max = 11;
inline constexpr unsigned cells_per_module = 8;
inline constexpr unsigned temperatures_per_module = 5;
/// Valid ranges of a cell voltage and of a raw temperature; any other value is rejected as out of range.
inline constexpr std::int64_t cell_min_mV = 1;
inline constexpr std::int64_t cell_max_mV = 5'000;
inline constexpr std::int64_t temperature_raw_max = 170;

inline constexpr SpecialCode cell_codes[] = {{0xFFFF, Validity::not_fitted}};
inline constexpr SpecialCode temperature_codes[] = {{0xFF, Validity::not_fitted}};  // as for cells, by analogy
inline constexpr RawName balance_names[] = {{0, "off"}, {1, "on"}};

namespace detail {

consteval SignalSpec cell(std::string_view name, unsigned place) {
  return field::within(cell_min_mV, cell_max_mV, field::big(name, 2 * place, 2, field::cell_mV, cell_codes));
}
consteval SignalSpec temperature(std::string_view name, unsigned at) {
  return field::within(0, temperature_raw_max, field::u8(name, at, field::degrees_from(-50), temperature_codes));
}

}  // namespace detail

inline constexpr SignalSpec master_signals[] = {
    field::big("target_voltage_uV", 0, 2, field::cell_mV), field::named(field::u8("balancing", 2), balance_names),
    field::flag("renumbering_allowed", 3, 2), field::u8("run_code", 4),  // 3 in all frames but the zeros of the start
};
inline constexpr SignalSpec status_signals[] = {
    field::bits("balancing_cells", 0, 7, 8),    field::u8("status_code", 1),  // 30h was observed
    detail::temperature("temperature_1_dC", 2), detail::temperature("temperature_2_dC", 3),
    detail::temperature("temperature_3_dC", 4), detail::temperature("temperature_4_dC", 5),
    detail::temperature("temperature_5_dC", 6),
};

namespace detail {

consteval MessageSpec answer(std::string_view name, std::uint32_t index, std::span<const SignalSpec> signals,
                             std::string_view meaning) {
  return {.name = name,
          .base_id = 0x600 + index,
          .node_min = 1,
          .node_max = node_max,
          .node_shift = 4,
          .sender = Sender::module,
          .signals = signals,
          .meaning = meaning};
}

}  // namespace detail

inline constexpr SignalSpec cells_1_signals[] = {
    detail::cell("cell_voltage_1_uV", 0), detail::cell("cell_voltage_2_uV", 1), detail::cell("cell_voltage_3_uV", 2),
    detail::cell("cell_voltage_4_uV", 3)};
inline constexpr SignalSpec cells_2_signals[] = {
    detail::cell("cell_voltage_5_uV", 0), detail::cell("cell_voltage_6_uV", 1), detail::cell("cell_voltage_7_uV", 2),
    detail::cell("cell_voltage_8_uV", 3)};
inline constexpr SignalSpec cells_3_signals[] = {
    detail::cell("cell_voltage_9_uV", 0), detail::cell("cell_voltage_10_uV", 1), detail::cell("cell_voltage_11_uV", 2),
    detail::cell("cell_voltage_12_uV", 3)};

inline constexpr MessageSpec master{.name = "CMU_MASTER",
                                    .base_id = 0x3C3,
                                    .sender = Sender::bmu,
                                    .period = 40ms,
                                    .signals = master_signals,
                                    .meaning = "asks all modules, and tells them above what to bleed"};
inline constexpr MessageSpec status =
    detail::answer("CMU_STATUS", 1, status_signals, "which cells are bled, and temperatures");
inline constexpr MessageSpec cells_1 = detail::answer("CMU_CELLS_1", 2, cells_1_signals, "cells 1 to 4");
inline constexpr MessageSpec cells_2 = detail::answer("CMU_CELLS_2", 3, cells_2_signals, "cells 5 to 8");
inline constexpr MessageSpec cells_3 =
    detail::answer("CMU_CELLS_3", 4, cells_3_signals, "cells 9 to 12, which no module of this car has");
/// CMU_CELLS_1 to 3 in order; the first four signals of each are its cell voltages.
inline constexpr const MessageSpec* cells_rows[] = {&cells_1, &cells_2, &cells_3};

inline constexpr const MessageSpec* rows[] = {&master, &lem_cab::current, &status, &cells_1, &cells_2, &cells_3};
inline constexpr Catalogue catalogue{"outlander_cmu", rows};

/// Defined in modules.cpp.
extern const ModuleDriver driver;

inline constexpr Device device{.name = "outlander_cmu",
                               .title = "Mitsubishi Outlander PHEV modules",
                               .kind = DeviceKind::modules,
                               .catalogue = &catalogue,
                               .bit_rates = only_500k,
                               .meaning = "ten modules of eight cells, their master, and the car's current sensor",
                               .modules = &driver};

}  // namespace bmu::outlander_cmu

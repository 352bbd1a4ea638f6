// Export of the messages of a catalogue as a DBC file for other tools (SavvyCAN, Kvaser, cantools, ...).
//
// DBC has no "base + node": each message with a node becomes one BO_ for every requested node, named like CELLS_1_N03;
// a COMMAND to node 0, which addresses all nodes, is COMMAND_ALL. Identifiers of 29 bits have bit 31 set, as DBC
// requires. Values are scaled to the displayed unit (V, A, C), so names lose the suffix of the unit they are carried
// in: cell_voltage_1 in V. The meaning of a raw value that is not a number (not fitted, unknown) is listed in VAL_, as
// DBC has no better place; a plain DBC reader still scales it. The checksum, which is not a signal of a row, is listed
// as `crc`.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "protocol/message.hpp"

namespace bmu {

/// Text of the DBC file. `nodes` are the nodes to write, numbered as in the rows; a node 0 that addresses all nodes is
/// always written.
[[nodiscard]] std::string dbc_text(const Catalogue& catalogue, std::span<const std::uint8_t> nodes);

/// Number of the first bit as DBC counts: byte * 8 + bit in byte, of the most significant bit for big-endian fields,
/// of the least significant for little-endian ones.
[[nodiscard]] constexpr unsigned dbc_start_bit(const SignalSpec& signal) {
  const unsigned byte_index = signal.first_bit / 8U;
  return signal.order == ByteOrder::big ? byte_index * 8 + (7 - signal.first_bit % 8U) : signal.first_bit;
}

/// A carried number converted to the displayed unit, rounded once.
[[nodiscard]] constexpr double shown_value(const SignalSpec& signal, std::int64_t carried) {
  const UnitSpec& unit = spec_of(signal.unit);
  double steps_per_unit = 1.0;
  for (int decimal = 0; decimal < unit.decimals; ++decimal) steps_per_unit *= 10.0;
  return static_cast<double>(carried) / (static_cast<double>(unit.divisor) * steps_per_unit);
}

}  // namespace bmu

// The messages of a catalogue as a DBC file, so that other tools (SavvyCAN, Kvaser, cantools, ...) read our buses.
//
// DBC knows no "base + node": each message with a node becomes one BO_ for every node asked for, named like
// CELLS_1_N03; a COMMAND to node 0, which is all of them, is COMMAND_ALL. Identifiers of 29 bits have bit 31 set, as
// DBC has them. Values are scaled to the unit a person reads
// (V, A, C), so names lose the token of the unit they are carried in: cell_voltage_1 in V. What a raw value means that
// is no number (not fitted, unknown) stands in VAL_, as DBC has no better place; a plain DBC reader will still scale
// it. The checksum, which is no signal of ours, is listed as `crc`.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "protocol/message.hpp"

namespace bmu {

/// Text of the DBC. `nodes` are the nodes to write, as the rows count them; a node 0 that is all of them is always
/// written.
[[nodiscard]] std::string dbc_text(const Catalogue& catalogue, std::span<const std::uint8_t> nodes);

/// Number of the first bit as DBC counts: byte * 8 + bit in byte, of the most significant bit for big-endian fields,
/// of the least significant for little-endian ones.
[[nodiscard]] constexpr unsigned dbc_start_bit(const SignalSpec& signal) {
  const unsigned byte_index = signal.first_bit / 8U;
  return signal.order == ByteOrder::big ? byte_index * 8 + (7 - signal.first_bit % 8U) : signal.first_bit;
}

/// A carried number in the unit shown, rounded once.
[[nodiscard]] constexpr double shown_value(const SignalSpec& signal, std::int64_t carried) {
  const UnitSpec& unit = spec_of(signal.unit);
  double steps_per_unit = 1.0;
  for (int decimal = 0; decimal < unit.decimals; ++decimal) steps_per_unit *= 10.0;
  return static_cast<double>(carried) / (static_cast<double>(unit.divisor) * steps_per_unit);
}

}  // namespace bmu

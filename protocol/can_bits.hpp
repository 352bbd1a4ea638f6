// A classic CAN frame as bits on the wire (ISO 11898-1): how long it is, exactly, and what the bits are.
//
//   start of frame 1, identifier 11 (+ 2 + 18 when extended), remote 1, reserved 2, length 4, data, CRC 15   stuffed
//   CRC delimiter 1, acknowledgement 1, its delimiter 1, end of frame 7                                       not
//   between two frames 3
//
// Wherever five bits of the stuffed part are equal, the opposite one follows; it counts for the next five. So a length
// depends on what is in a frame: 111 to 135 bits for an 11-bit identifier and eight bytes, the bits between two frames
// included. Bits are bool, recessive true; the lower identifier therefore wins arbitration.
//
// Pure, no allocation; bits_on_wire() of eight bytes takes well under a microsecond.
#pragma once

#include <cstddef>
#include <cstdint>

#include "protocol/fixed_vector.hpp"
#include "protocol/frame.hpp"

namespace bmu {

inline constexpr std::int64_t can_bits_between_frames = 3;
/// CRC delimiter, acknowledgement, its delimiter, end of frame.
inline constexpr std::int64_t can_bits_of_trailer = 10;

/// The stuffed part at its longest: 118 bits of an extended frame with eight bytes, and 29 stuff bits.
using CanBits = FixedVector<bool, 118 + 29>;

/// The stuffed part of a data or remote frame, from the start of frame to the last stuff bit of its CRC. A remote frame
/// has a length but no data. Of an error frame, which has no bits of this kind, nothing.
[[nodiscard]] constexpr CanBits stuffed_bits(const CanFrame& frame);

/// All of a frame, the bits between it and the next included.
[[nodiscard]] constexpr std::int64_t bits_on_wire(const CanFrame& frame);

/// The longest that a frame of so many bytes can be, whatever is in it: a stuff bit after the first five bits and then
/// after each four. A bound that some frames reach and none passes.
[[nodiscard]] constexpr std::int64_t bits_on_wire_max(std::int64_t bytes, bool is_extended = false) {
  const std::int64_t stuffable = (is_extended ? 54 : 34) + 8 * bytes;
  return stuffable + (stuffable - 1) / 4 + can_bits_of_trailer + can_bits_between_frames;
}
[[nodiscard]] constexpr std::int64_t bits_on_wire_max(const CanFrame& frame) {
  return bits_on_wire_max(frame.is_remote ? 0 : frame.length, frame.is_extended);
}
static_assert(bits_on_wire_max(8) == 135);

// --------------------------------------------------------------------------------------------------------------------

namespace can_bits_detail {

/// Takes bits in their order; keeps the CRC and the run of equal bits along the way.
class Writer {
 public:
  constexpr void put(std::uint32_t value, unsigned width) {
    for (unsigned left = width; left > 0; --left) put_bit(((value >> (left - 1)) & 1U) != 0);
  }
  /// CRC-15 of what was put so far: polynomial 4599h, start value 0.
  [[nodiscard]] constexpr std::uint32_t crc() const { return crc_; }
  [[nodiscard]] constexpr const CanBits& bits() const { return bits_; }

 private:
  constexpr void put_bit(bool bit) {
    const bool is_odd = bit != ((crc_ >> 14) != 0);
    crc_ = ((crc_ << 1) & 0x7FFFU) ^ (is_odd ? 0x4599U : 0U);
    append(bit);
    if (run_ == 5) append(!bit);
  }
  constexpr void append(bool bit) {
    run_ = !bits_.empty() && bits_.back() == bit ? run_ + 1 : 1;
    bits_.push_back(bit);
  }

  CanBits bits_;
  std::uint32_t crc_ = 0;
  unsigned run_ = 0;
};

}  // namespace can_bits_detail

constexpr CanBits stuffed_bits(const CanFrame& frame) {
  if (frame.is_error) return {};
  const std::uint32_t remote = frame.is_remote ? 1 : 0;
  can_bits_detail::Writer writer;
  writer.put(0, 1);
  if (frame.is_extended) {
    writer.put(frame.id >> 18, 11);
    writer.put(0b11, 2);  // substitute remote request, identifier extension
    writer.put(frame.id & 0x3FFFF, 18);
    writer.put(remote << 2, 3);
  } else {
    writer.put(frame.id, 11);
    writer.put(remote << 2, 3);
  }
  writer.put(frame.length, 4);
  for (std::size_t byte = 0; byte < frame.length && !frame.is_remote; ++byte) writer.put(frame.data[byte], 8);
  writer.put(writer.crc(), 15);
  return writer.bits();
}

constexpr std::int64_t bits_on_wire(const CanFrame& frame) {
  if (frame.is_error) return 0;
  return static_cast<std::int64_t>(stuffed_bits(frame).size()) + can_bits_of_trailer + can_bits_between_frames;
}

}  // namespace bmu

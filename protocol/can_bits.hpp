// Bits of a classic CAN frame on the wire (ISO 11898-1): the exact length and the bits themselves.
//
//   start of frame 1, identifier 11 (+ 2 + 18 when extended), remote 1, reserved 2, length 4, data, CRC 15   stuffed
//   CRC delimiter 1, acknowledgement 1, its delimiter 1, end of frame 7                                       not
//   between two frames 3
//
// After five equal bits of the stuffed part, a bit of opposite value is inserted; it counts towards the next five. The
// length therefore depends on the content: 111 to 135 bits for an 11-bit identifier and eight bytes, including the bits
// between two frames. Bits are bool, recessive is true; the lower identifier therefore wins arbitration.
//
// Pure, no allocation. stuffed_bits() works bit by bit and returns the bits; bits_on_wire() uses tables, about 20 ns.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "protocol/fixed_vector.hpp"
#include "protocol/frame.hpp"

namespace bmu {

inline constexpr std::int64_t can_bits_between_frames = 3;
/// CRC delimiter, acknowledgement, its delimiter, end of frame.
inline constexpr std::int64_t can_bits_of_trailer = 10;

/// The stuffed part at its maximum length: 118 bits of an extended frame with eight bytes, and 29 stuff bits.
using CanBits = FixedVector<bool, 118 + 29>;

/// The stuffed part of a data or remote frame, from the start of frame to the last stuff bit of its CRC. A remote frame
/// has a length but no data. Empty for an error frame, which has no such bits.
[[nodiscard]] constexpr CanBits stuffed_bits(const CanFrame& frame);

/// Length of a whole frame, including the bits between it and the next.
[[nodiscard]] constexpr std::int64_t bits_on_wire(const CanFrame& frame);

/// Maximum length of a frame with `bytes` data bytes, for any content: a stuff bit after the first five bits and then
/// after every four. Some frames reach this bound, none exceeds it.
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

/// Appends bits in order; tracks the CRC and the run of equal bits.
class Writer {
 public:
  constexpr void put(std::uint32_t value, unsigned width) {
    for (unsigned left = width; left > 0; --left) put_bit(((value >> (left - 1)) & 1U) != 0);
  }
  /// CRC-15 of the bits appended so far: polynomial 4599h, start value 0.
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

namespace can_bits_detail {

/// State of a run of equal bits, in three bits: .2 is the value of the last bit, .1-.0 the length of the run, less one.
/// The length never reaches five: a stuff bit has started a new run by then.
struct Run {
  std::uint8_t run = 0b000;
  std::uint8_t stuff_bits = 0;

  constexpr void put(bool bit) {
    const bool is_same = ((run >> 2) & 1U) == (bit ? 1U : 0U);
    const unsigned length = is_same ? (run & 0b11U) + 2U : 1U;
    const bool is_stuffed = length == 5;
    if (is_stuffed) ++stuff_bits;
    run = static_cast<std::uint8_t>((bit != is_stuffed ? 0b100U : 0b000U) | (is_stuffed ? 0U : length - 1));
  }
};

/// Effect of a byte on each of the eight run states, packed into one number: for run r from bit 8 * r on, .7-.6 are the
/// stuff bits, .5-.3 the run after the byte, .2-.0 zero. The lower six bits are therefore the shift count for the next
/// byte, and processors evaluate only six bits of it: the lookup does not depend on the run, and only a shift leads
/// from run to run.
inline constexpr auto steps = [] {
  std::array<std::uint64_t, 256> table{};
  for (std::size_t byte = 0; byte != table.size(); ++byte) {
    for (std::uint8_t run = 0; run < 8; ++run) {
      Run after{run};
      for (unsigned left = 8; left > 0; --left) after.put(((byte >> (left - 1)) & 1U) != 0);
      table[byte] |= static_cast<std::uint64_t>((after.stuff_bits << 6U) | (after.run << 3U)) << (8U * run);
    }
  }
  return table;
}();

/// Counts stuff bits byte by byte. The initial run is a single 0.
class StuffCount {
 public:
  constexpr void put(std::uint8_t byte) {
    step_ = steps[byte] >> (step_ & 0b111'111U);
    count_at_bit_6_ += step_ & 0b11'000'000U;
  }
  [[nodiscard]] constexpr std::int64_t count() const { return static_cast<std::int64_t>(count_at_bit_6_ >> 6U); }

 private:
  std::uint64_t step_ = 0;
  std::uint64_t count_at_bit_6_ = 0;
};

/// The CRC is the XOR of one table entry per byte, selected by its position, so that no lookup depends on another. At
/// most five bytes of header and eight of data; leading zeros change nothing, as the CRC starts with 0.
inline constexpr std::size_t crc_places = 13;
inline constexpr auto crc_of_place = [] {
  std::array<std::array<std::uint16_t, 256>, crc_places> table{};
  for (unsigned byte = 0; byte < 256; ++byte) {
    std::uint32_t crc = byte << 7U;
    for (std::size_t place = 0; place < crc_places; ++place) {
      for (unsigned bit = 0; bit < 8; ++bit) crc = ((crc << 1U) & 0x7FFFU) ^ ((crc & 0x4000U) != 0 ? 0x4599U : 0U);
      table[place][byte] = static_cast<std::uint16_t>(crc);
    }
  }
  return table;
}();

/// Header from the start of frame, which is a 0, to the length code: 19 bits, or 39 if extended.
constexpr std::uint64_t header_of(const CanFrame& frame) {
  const std::uint64_t remote = frame.is_remote ? 1 : 0;
  if (!frame.is_extended) return (std::uint64_t{frame.id} << 7U) | (remote << 6U) | frame.length;
  return (std::uint64_t{frame.id >> 18U} << 27U) | (0b11ULL << 25U) | (std::uint64_t{frame.id & 0x3FFFFU} << 7U) |
         (remote << 6U) | frame.length;
}

/// Padding of the first header byte: alternating bits that end with 1 add no stuff bit and leave the start of frame as
/// is.
constexpr std::uint64_t header_filling = 0b10101ULL << 19U;
constexpr std::uint64_t extended_header_filling = 0b1ULL << 39U;

/// Computes CRC and stuff bits of a frame, byte by byte.
class Length {
 public:
  constexpr Length(const CanFrame& frame, std::size_t bytes)
      : frame_(&frame),
        header_(header_of(frame)),
        filled_header_(header_ | (frame.is_extended ? extended_header_filling : header_filling)),
        bytes_(bytes) {}

  /// Adds the header byte that is followed by `behind` further ones.
  constexpr void put_header(std::size_t behind) {
    crc_ ^= crc_of_place[bytes_ + behind][(header_ >> (8 * behind)) & 0xFFU];
    stuff_.put(static_cast<std::uint8_t>(filled_header_ >> (8 * behind)));
  }
  constexpr void put_data(std::size_t at) {
    crc_ ^= crc_of_place[bytes_ - 1 - at][frame_->data[at]];
    stuff_.put(frame_->data[at]);
  }
  [[nodiscard]] constexpr std::int64_t bits() {
    const std::uint32_t filled_crc = (crc_ << 1U) | (~crc_ & 1U);  // an opposite bit after the last adds no stuff bit
    stuff_.put(static_cast<std::uint8_t>(filled_crc >> 8U));
    stuff_.put(static_cast<std::uint8_t>(filled_crc));
    const std::int64_t plain = 1 + (frame_->is_extended ? 38 : 18) + 8 * static_cast<std::int64_t>(bytes_) + 15;
    return plain + stuff_.count() + can_bits_of_trailer + can_bits_between_frames;
  }

 private:
  const CanFrame* frame_;
  std::uint64_t header_;
  std::uint64_t filled_header_;
  std::size_t bytes_;
  std::uint32_t crc_ = 0;
  StuffCount stuff_;
};

/// Eight bytes and an 11-bit identifier, the most common frame: no counting, no comparison, all positions are
/// constants.
template <std::size_t... At>
constexpr std::int64_t bits_of_usual(const CanFrame& frame, std::index_sequence<At...> /*bytes*/) {
  Length length(frame, sizeof...(At));
  length.put_header(2);
  length.put_header(1);
  length.put_header(0);
  (length.put_data(At), ...);
  return length.bits();
}

constexpr std::int64_t bits_of_any(const CanFrame& frame) {
  const std::size_t bytes = frame.is_remote ? 0 : frame.length;
  Length length(frame, bytes);
  for (std::size_t behind = frame.is_extended ? 5 : 3; behind-- > 0;) length.put_header(behind);
  for (std::size_t at = 0; at < bytes; ++at) length.put_data(at);
  return length.bits();
}

}  // namespace can_bits_detail

constexpr std::int64_t bits_on_wire(const CanFrame& frame) {
  using namespace can_bits_detail;
  if (frame.is_error) return 0;
  const bool is_usual = frame.length == 8 && !frame.is_extended && !frame.is_remote;
  return is_usual ? bits_of_usual(frame, std::make_index_sequence<8>()) : bits_of_any(frame);
}

}  // namespace bmu

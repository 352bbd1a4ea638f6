// Bit fields in the eight data bytes of a frame, and the checksums over them.
//
// A field is identified by its first bit. Big-endian fields start with their most significant bit, counted in the order
// of transmission: bit 0 is the most significant bit of b0, bit 63 the least significant of b7; `bit(2, 7)` is "b2 .7"
// of the protocol. Little-endian fields start with their least significant bit, counted from the least significant bit
// of b0 on: `bit_le(2, 7)` is the same bit. In both cases a field is a run of bits, and a field of whole bytes starts
// with `byte(n)`.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "protocol/frame.hpp"

namespace bmu {

enum class ByteOrder : std::uint8_t { big, little };

/// First bit of a field with its most significant bit at bit `in_byte` (7 = highest) of byte `byte`.
[[nodiscard]] consteval std::uint8_t bit(unsigned byte, unsigned in_byte) {
  return static_cast<std::uint8_t>(byte * 8 + (7 - in_byte));
}
/// First bit of a little-endian field with its least significant bit at bit `in_byte` (0 = lowest) of byte `byte`.
[[nodiscard]] consteval std::uint8_t bit_le(unsigned byte, unsigned in_byte) {
  return static_cast<std::uint8_t>(byte * 8 + in_byte);
}
/// First bit of a field that starts with a whole byte.
[[nodiscard]] consteval std::uint8_t byte(unsigned byte_index) {
  return static_cast<std::uint8_t>(byte_index * 8);
}

using FrameBytes = std::array<std::uint8_t, 8>;

/// The eight bytes as one number, b0 highest, and back: one load and one byte swap each.
[[nodiscard]] constexpr std::uint64_t load_big_endian(const FrameBytes& bytes) {
  const auto word = std::bit_cast<std::uint64_t>(bytes);
  return std::endian::native == std::endian::little ? __builtin_bswap64(word) : word;
}
[[nodiscard]] constexpr FrameBytes store_big_endian(std::uint64_t word) {
  return std::bit_cast<FrameBytes>(std::endian::native == std::endian::little ? __builtin_bswap64(word) : word);
}

[[nodiscard]] constexpr std::uint64_t mask_of(unsigned bit_count) {
  return bit_count >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << bit_count) - 1;
}

/// Unsigned value of a field. 1 <= bit_count, first_bit + bit_count <= 64.
[[nodiscard]] constexpr std::uint64_t extract_bits(std::uint64_t word, unsigned first_bit, unsigned bit_count,
                                                   ByteOrder order = ByteOrder::big) {
  if (order == ByteOrder::little) return (__builtin_bswap64(word) >> first_bit) & mask_of(bit_count);
  return (word >> (64 - first_bit - bit_count)) & mask_of(bit_count);
}
[[nodiscard]] constexpr std::uint64_t extract_bits(const FrameBytes& bytes, unsigned first_bit, unsigned bit_count,
                                                   ByteOrder order = ByteOrder::big) {
  return extract_bits(load_big_endian(bytes), first_bit, bit_count, order);
}

/// Mask of the bits of a field in the word that load_big_endian returns.
[[nodiscard]] constexpr std::uint64_t occupied_bits(unsigned first_bit, unsigned bit_count, ByteOrder order) {
  return order == ByteOrder::big ? mask_of(bit_count) << (64 - first_bit - bit_count)
                                 : __builtin_bswap64(mask_of(bit_count) << first_bit);
}

/// Writes the low `bit_count` bits of `value`; all other bits of the frame keep their values.
constexpr void insert_bits(FrameBytes& bytes, unsigned first_bit, unsigned bit_count, std::uint64_t value,
                           ByteOrder order = ByteOrder::big) {
  const std::uint64_t place = occupied_bits(first_bit, bit_count, order);
  const std::uint64_t run = order == ByteOrder::big ? (value & mask_of(bit_count)) << (64 - first_bit - bit_count)
                                                    : __builtin_bswap64((value & mask_of(bit_count)) << first_bit);
  bytes = store_big_endian((load_big_endian(bytes) & ~place) | run);
}

/// Value of a two's complement field of `bit_count` bits. Precondition: the bits of `raw` above it are 0.
[[nodiscard]] constexpr std::int64_t sign_extend(std::uint64_t raw, unsigned bit_count) {
  const std::uint64_t sign = mask_of(bit_count) ^ (mask_of(bit_count) >> 1);
  return static_cast<std::int64_t>((raw ^ sign) - sign);
}

namespace detail {

[[nodiscard]] consteval std::array<std::uint8_t, 256> make_crc8_table(std::uint8_t polynomial) {
  std::array<std::uint8_t, 256> table{};
  for (unsigned value = 0; value < 256; ++value) {
    unsigned crc = value;
    for (int step = 0; step < 8; ++step) crc = (crc & 0x80U) != 0 ? (crc << 1) ^ polynomial : crc << 1;
    table[value] = static_cast<std::uint8_t>(crc);
  }
  return table;
}

inline constexpr auto crc8h2f_table = make_crc8_table(0x2F);
inline constexpr auto crc8_1d_table = make_crc8_table(0x1D);

}  // namespace detail

/// CRC-8H2F: polynomial 2Fh, start FFh, final XOR FFh, not reflected. Among the usual 8-bit polynomials it keeps a
/// Hamming distance of 4 over all lengths used here (up to 14 protected bytes); 1Dh keeps only 3.
class Crc8H2F {
 public:
  constexpr void add(std::uint8_t one) { crc_ = detail::crc8h2f_table[crc_ ^ one]; }
  [[nodiscard]] constexpr std::uint8_t value() const { return static_cast<std::uint8_t>(crc_ ^ 0xFF); }

 private:
  std::uint8_t crc_ = 0xFF;
};

namespace detail {

/// The identifier's two bytes and b0 to b6.
inline constexpr std::size_t protected_bytes = 9;

/// Contribution of a byte to the checksum, by the number of bytes that follow it.
inline constexpr auto crc8h2f_of_place = [] {
  std::array<std::array<std::uint8_t, 256>, protected_bytes> table{crc8h2f_table};
  for (std::size_t place = 1; place < protected_bytes; ++place) {
    for (std::size_t value = 0; value < 256; ++value) table[place][value] = crc8h2f_table[table[place - 1][value]];
  }
  return table;
}();
inline constexpr std::uint8_t crc8h2f_of_zeros = [] {
  Crc8H2F crc;
  for (std::size_t place = 0; place < protected_bytes; ++place) crc.add(0);
  return crc.value();
}();

}  // namespace detail

/// Checksum of an internal frame: Crc8H2F over the identifier, high byte first, then b0 to b6. A frame received under
/// another identifier therefore fails as well. Computed as the XOR of one table entry per byte, selected by its
/// position, so that no lookup depends on the previous one.
[[nodiscard]] constexpr std::uint8_t frame_crc(const CanFrame& frame) {
  const auto& of_place = detail::crc8h2f_of_place;
  unsigned crc = detail::crc8h2f_of_zeros;
  crc ^= of_place[8][(frame.id >> 8U) & 0xFFU];
  crc ^= of_place[7][frame.id & 0xFFU];
  for (std::size_t index = 0; index < 7; ++index) crc ^= of_place[6 - index][frame.data[index]];
  return static_cast<std::uint8_t>(crc);
}

/// Checksum of a frame of BMW's modules: polynomial 1Dh, start 0, no final XOR, not reflected, over the identifier, low
/// byte first, and b0 to b6.
[[nodiscard]] constexpr std::uint8_t frame_crc_1d(const CanFrame& frame) {
  std::uint8_t crc = detail::crc8_1d_table[frame.id & 0xFFU];
  crc = detail::crc8_1d_table[crc ^ ((frame.id >> 8U) & 0xFFU)];
  for (std::size_t index = 0; index < 7; ++index) crc = detail::crc8_1d_table[crc ^ frame.data[index]];
  return crc;
}

}  // namespace bmu

// Text as 64-bit words, eight characters at once, the first one highest: a few additions replace a loop over the
// characters. For parsers of millions of lines.
//
//   const std::uint64_t letters = load_letters(at);      eight must be there
//   if (are_hex(letters)) id = hex_number(letters);      "18FF50E5" is 18FF50E5h
//
// No branch, no table, no allocation; about a nanosecond each.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "protocol/bits.hpp"

namespace bmu {

inline constexpr std::size_t letters_at_once = 8;

[[nodiscard]] constexpr std::uint64_t load_letters(const char* at) {
  std::array<char, letters_at_once> letters{};
  std::copy_n(at, letters.size(), letters.begin());
  return load_big_endian(std::bit_cast<FrameBytes>(letters));
}

/// The same byte eight times.
[[nodiscard]] constexpr std::uint64_t eight_times(unsigned byte) {
  return std::uint64_t{0x0101'0101'0101'0101} * byte;
}

/// Mark of a character: bit 7 of its byte, which ASCII does not use.
inline constexpr std::uint64_t all_marks = eight_times(0x80);

/// Marks the characters `low` to `high`, both ASCII. A constant is added to the lower seven bits of each byte, so that
/// the sum carries into the eighth bit from `low` on, or above `high`, and never further.
[[nodiscard]] constexpr std::uint64_t marks_between(std::uint64_t letters, char low, char high) {
  const std::uint64_t sevens = letters & ~all_marks;
  const std::uint64_t from_low = sevens + eight_times(0x80U - static_cast<unsigned char>(low));
  const std::uint64_t behind_high = sevens + eight_times(0x7FU - static_cast<unsigned char>(high));
  return from_low & ~behind_high & ~letters & all_marks;
}

/// Number of marked characters before the first one without mark.
[[nodiscard]] constexpr std::size_t marked_at_start(std::uint64_t marks) {
  return static_cast<std::size_t>(std::countl_zero(marks ^ all_marks)) / 8;
}

/// Values of eight decimal digits. Other characters give bit 7 set, or 10 to 127.
[[nodiscard]] constexpr std::uint64_t above_zero(std::uint64_t letters) {
  return letters ^ eight_times('0');
}
[[nodiscard]] constexpr bool are_decimal(std::uint64_t letters) {
  const std::uint64_t digits = above_zero(letters);
  return ((digits | (digits + eight_times(0x80 - 10))) & all_marks) == 0;
}

/// The number that eight decimal digits represent. Neighbours are joined to four numbers below 100, to two, to one.
[[nodiscard]] constexpr std::uint32_t decimal_number(std::uint64_t letters) {
  const std::uint64_t ones = above_zero(letters);
  const std::uint64_t twos = (ones + (ones >> 8U) * 10) & 0x00FF'00FF'00FF'00FF;
  const std::uint64_t fours = (twos + (twos >> 16U) * 100) & 0x0000'FFFF'0000'FFFF;
  return static_cast<std::uint32_t>(fours + (fours >> 32U) * 10'000);
}

[[nodiscard]] constexpr bool are_hex(std::uint64_t letters) {
  constexpr std::uint64_t to_small = eight_times('a' - 'A');  // leaves digits unchanged and creates none
  return (marks_between(letters, '0', '9') | marks_between(letters | to_small, 'a', 'f')) == all_marks;
}

/// The number that eight hexadecimal digits represent, upper or lower case.
[[nodiscard]] constexpr std::uint32_t hex_number(std::uint64_t letters) {
  const std::uint64_t are_letters = (letters >> 6U) & eight_times(0x01);  // low nibble of 'A' and 'a' is 1, value 10
  const std::uint64_t ones = (letters & eight_times(0x0F)) + are_letters * 9;
  const std::uint64_t twos = (ones | (ones >> 4U)) & 0x00FF'00FF'00FF'00FF;
  const std::uint64_t fours = (twos | (twos >> 8U)) & 0x0000'FFFF'0000'FFFF;
  return static_cast<std::uint32_t>(fours | (fours >> 16U));
}

}  // namespace bmu

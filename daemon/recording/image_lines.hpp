// Image of a core (core_image.hpp) as lines of a recording. Most of it are zeros, of modules that the pack does not
// have: they are counted instead of written.
//
//   # image 0gEAAAAB...        270 bytes in base64 (the last line fewer)
//   # zeros 1620               number of zero bytes
//
// The checksum is FNV-1a in words of 64 bits over the pieces that are not zero and their offsets: its cost depends on
// the size of the pack, and a change of any single word changes it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace bmu {

void append_image_lines(std::span<const std::uint8_t> bytes, std::string& to);

/// Append the bytes of an `image` or `zeros` line, without its word. False: invalid, or more than `size_max` bytes.
[[nodiscard]] bool append_image_bytes(std::string_view rest, std::size_t size_max, std::vector<std::uint8_t>& to);
[[nodiscard]] bool append_image_zeros(std::string_view rest, std::size_t size_max, std::vector<std::uint8_t>& to);

[[nodiscard]] std::uint64_t image_checksum(std::span<const std::uint8_t> bytes);

}  // namespace bmu

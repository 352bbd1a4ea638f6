#include "daemon/recording/image_lines.hpp"

#include <algorithm>
#include <bit>
#include <cstring>

#include "daemon/recording/base64.hpp"
#include "protocol/fnv.hpp"
#include "protocol/number_text.hpp"

namespace bmu {

namespace {

/// Whole groups of three, so that each line is base64 by itself.
constexpr std::size_t piece_bytes = 270;

bool is_zero(std::span<const std::uint8_t> piece) {
  return piece[0] == 0 && std::memcmp(piece.data(), piece.data() + 1, piece.size() - 1) == 0;
}

constexpr std::size_t word_bytes = 8;

/// Little-endian, on every machine. Up to eight bytes.
std::uint64_t word_of(std::span<const std::uint8_t> bytes) {
  std::uint64_t word = 0;
  std::memcpy(&word, bytes.data(), bytes.size());
  if constexpr (std::endian::native == std::endian::big) word = __builtin_bswap64(word);
  return word;
}

/// Calls `zeros(count)` for each run of pieces of zeros, `bytes(offset, piece)` for each other one.
template <class Zeros, class Bytes>
void for_each_piece(std::span<const std::uint8_t> all, const Zeros& zeros, const Bytes& bytes) {
  std::size_t zero_count = 0;
  for (std::size_t at = 0; at < all.size(); at += piece_bytes) {
    const auto piece = all.subspan(at, std::min(piece_bytes, all.size() - at));
    if (is_zero(piece)) {
      zero_count += piece.size();
      continue;
    }
    if (zero_count > 0) zeros(zero_count);
    zero_count = 0;
    bytes(at, piece);
  }
  if (zero_count > 0) zeros(zero_count);
}

}  // namespace

void append_image_lines(std::span<const std::uint8_t> bytes, std::string& to) {
  for_each_piece(
      bytes, [&](std::size_t count) { to += "# zeros " + std::to_string(count) + "\n"; },
      [&](std::size_t, std::span<const std::uint8_t> piece) { to += "# image " + to_base64(piece) + "\n"; });
}

bool append_image_bytes(std::string_view rest, std::size_t size_max, std::vector<std::uint8_t>& to) {
  return append_base64(rest, to) && to.size() <= size_max;
}

bool append_image_zeros(std::string_view rest, std::size_t size_max, std::vector<std::uint8_t>& to) {
  const auto count = number_of_text<std::size_t>(rest);
  if (!count || *count > size_max || to.size() > size_max - *count) return false;
  to.resize(to.size() + *count);
  return true;
}

std::uint64_t image_checksum(std::span<const std::uint8_t> bytes) {
  std::uint64_t sum = fnv_start;
  const auto add = [&](std::uint64_t word) { sum = (sum ^ word) * fnv_prime; };
  for_each_piece(
      bytes, [](std::size_t) {},
      [&](std::size_t at, std::span<const std::uint8_t> piece) {
        add(at);
        for (; piece.size() >= word_bytes; piece = piece.subspan(word_bytes)) add(word_of(piece.first(word_bytes)));
        if (!piece.empty()) add(word_of(piece));
      });
  return sum;
}

}  // namespace bmu

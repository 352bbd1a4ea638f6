// Checksum over lines of a recording, which detects a missing, changed or added line. FNV-1a in words of 64 bits, each
// line with its length, folded to 32 bits in the end: a difference is missed once in four thousand million times. No
// protection against deliberate forgery.
//
// Cost: a multiplication for eight characters.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string_view>

#include "protocol/fnv.hpp"

namespace bmu {

class LineSum {
 public:
  /// Adds a line without its line feed, and without a carriage return that another system put before it.
  void add(std::string_view line) {
    if (line.ends_with('\r')) line.remove_suffix(1);
    mix(line.size());
    if (line.size() < word_bytes) return mix(short_word(line));
    for (std::size_t at = 0; at + word_bytes < line.size(); at += word_bytes) mix(word_at(line, at));
    mix(word_at(line, line.size() - word_bytes));  // which may overlap the one before
  }
  /// Adds each of the lines, which have their line feeds.
  void add_lines(std::string_view lines) {
    while (!lines.empty()) {
      const std::size_t size = std::min(lines.find('\n'), lines.size());
      add(lines.substr(0, size));
      lines.remove_prefix(std::min(size + 1, lines.size()));
    }
  }
  [[nodiscard]] std::uint32_t value() const { return static_cast<std::uint32_t>(sum_ ^ (sum_ >> 32U)); }

 private:
  static constexpr std::size_t word_bytes = 8;

  /// The first character lowest, on every machine.
  [[nodiscard]] static std::uint64_t word_at(std::string_view line, std::size_t at) {
    std::uint64_t word = 0;
    std::memcpy(&word, line.data() + at, word_bytes);
    if constexpr (std::endian::native == std::endian::big) word = __builtin_bswap64(word);
    return word;
  }
  [[nodiscard]] static std::uint64_t short_word(std::string_view letters) {
    std::uint64_t word = 0;
    for (std::size_t i = letters.size(); i-- > 0;) word = (word << 8U) | static_cast<unsigned char>(letters[i]);
    return word;
  }
  void mix(std::uint64_t word) { sum_ = (sum_ ^ word) * fnv_prime; }

  std::uint64_t sum_ = fnv_start;
};

}  // namespace bmu

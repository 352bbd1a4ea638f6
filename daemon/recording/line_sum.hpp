// A checksum over lines of a recording, so that one that is missing, was changed or added is found. FNV-1a in words of
// 64 bits, each line with its length: each step is a bijection, so that one changed line always changes the result.
// Not against somebody who means to deceive.
//
// Cost: about a nanosecond for eight letters.
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
  /// A line without its line feed, and without a carriage return that another system put before it.
  void add(std::string_view line) {
    if (line.ends_with('\r')) line.remove_suffix(1);
    mix(line.size());
    for (; line.size() >= word_bytes; line.remove_prefix(word_bytes)) mix(word_of(line.substr(0, word_bytes)));
    if (!line.empty()) mix(word_of(line));
  }
  /// Each of them, with their line feeds.
  void add_lines(std::string_view lines) {
    while (!lines.empty()) {
      const std::size_t size = std::min(lines.find('\n'), lines.size());
      add(lines.substr(0, size));
      lines.remove_prefix(std::min(size + 1, lines.size()));
    }
  }
  [[nodiscard]] std::uint64_t value() const { return sum_; }

 private:
  static constexpr std::size_t word_bytes = 8;

  /// The first letter lowest, on every machine.
  [[nodiscard]] static std::uint64_t word_of(std::string_view letters) {
    std::uint64_t word = 0;
    std::memcpy(&word, letters.data(), letters.size());
    if constexpr (std::endian::native == std::endian::big) word = __builtin_bswap64(word);
    return word;
  }
  void mix(std::uint64_t word) { sum_ = (sum_ ^ word) * fnv_prime; }

  std::uint64_t sum_ = fnv_start;
};

}  // namespace bmu

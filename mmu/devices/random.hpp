// Random integers (splitmix64): the same seed gives the same sequence with every compiler and library, which the
// standard distributions do not guarantee.
#pragma once

#include <cstdint>

namespace bmu {

class RandomSource {
 public:
  explicit constexpr RandomSource(std::uint64_t seed) : state_(seed) {}

  constexpr std::uint64_t next() {
    state_ += 0x9E3779B97F4A7C15U;
    std::uint64_t mixed = state_;
    mixed = (mixed ^ (mixed >> 30)) * 0xBF58476D1CE4E5B9U;
    mixed = (mixed ^ (mixed >> 27)) * 0x94D049BB133111EBU;
    return mixed ^ (mixed >> 31);
  }
  /// Uniform over -magnitude to +magnitude; 0 for a magnitude of 0 (and then the sequence does not advance).
  constexpr std::int32_t within(std::int32_t magnitude) {
    if (magnitude <= 0) return 0;
    const auto span = static_cast<std::uint64_t>(magnitude) * 2 + 1;
    return static_cast<std::int32_t>(static_cast<std::int64_t>(next() % span) - magnitude);
  }

 private:
  std::uint64_t state_;
};

}  // namespace bmu

// Faults on the way of a frame, each with its probability: a frame is lost, late, sent twice, or arrives with other
// bits and a correct checksum of the controller nevertheless. Frames that are late by different times overtake each
// other. A random sequence selects the frames: the same seed has the same effect on the same frames.
#pragma once

#include "mmu/devices/random.hpp"
#include "tests/support/wired_pack.hpp"

namespace bmu::test {

struct FaultyWire {
  explicit FaultyWire(std::uint64_t seed) : random(seed) {}

  RandomSource random;
  std::uint32_t lost_permille = 0;  // in either direction
  std::uint32_t late_permille = 0;
  Duration late_max{};    // uniform over one millisecond to this
  Duration late_fixed{};  // every frame of a device
  std::uint32_t twice_permille = 0;
  std::uint32_t damaged_permille = 0;

  /// Fate of a frame that a device sends; may change its bits.
  [[nodiscard]] Fate carry(CanFrame& frame);
  /// Whether no device receives this frame of the master.
  [[nodiscard]] bool loses() { return happens(lost_permille); }

 private:
  [[nodiscard]] bool happens(std::uint32_t permille) { return permille > 0 && random.next() % 1'000 < permille; }
  void flip_bits(CanFrame& frame);
};

}  // namespace bmu::test

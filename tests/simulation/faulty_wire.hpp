// What can be wrong with the way of a frame, each with its share: a frame is lost, late, sent twice, or arrives with
// other bits and a checksum of the controller that is right all the same. Frames that are late by different times
// overtake each other. Which frame it is, a random sequence says: the same seed does the same to the same frames.
#pragma once

#include "mmu/devices/random.hpp"
#include "tests/support/wired_pack.hpp"

namespace bmu::test {

struct FaultyWire {
  explicit FaultyWire(std::uint64_t seed) : random(seed) {}

  RandomSource random;
  std::uint32_t lost_permille = 0;  // in either direction
  std::uint32_t late_permille = 0;
  Duration late_max{};    // even over one millisecond to this
  Duration late_fixed{};  // every frame of a device
  std::uint32_t twice_permille = 0;
  std::uint32_t damaged_permille = 0;

  /// A device sends it.
  [[nodiscard]] Fate carry(CanFrame& frame);
  /// No device takes in this frame of the master.
  [[nodiscard]] bool loses() { return happens(lost_permille); }

 private:
  [[nodiscard]] bool happens(std::uint32_t permille) { return permille > 0 && random.next() % 1'000 < permille; }
  void flip_bits(CanFrame& frame);
};

}  // namespace bmu::test

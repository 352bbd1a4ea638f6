#include "tests/simulation/faulty_wire.hpp"

namespace bmu::test {

Fate FaultyWire::carry(CanFrame& frame) {
  Fate fate{.is_lost = loses(), .delay = late_fixed};
  if (happens(late_permille)) {
    fate.delay += std::chrono::milliseconds{1 + random.next() % static_cast<std::uint64_t>(to_ms(late_max))};
  }
  if (happens(damaged_permille)) flip_bits(frame);
  if (happens(twice_permille)) fate.twin = frame;
  return fate;
}

void FaultyWire::flip_bits(CanFrame& frame) {
  constexpr std::uint64_t bits_most = 3;
  constexpr std::uint64_t bits_of_a_byte = 8;
  if (frame.length == 0) return;
  for (std::uint64_t left = 1 + random.next() % bits_most; left > 0; --left) {
    const std::uint64_t bit = random.next() % (frame.length * bits_of_a_byte);
    frame.data[bit / bits_of_a_byte] ^= static_cast<std::uint8_t>(1U << (bit % bits_of_a_byte));
  }
}

}  // namespace bmu::test

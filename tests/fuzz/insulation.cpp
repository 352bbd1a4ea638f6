// The insulation monitor's signal: each one is decoded to a state, and encoding gives a signal of the same state again.
//
// Input: frequency (4), duty cycle (4), level (1), time since the last edge in ns (8).
#include "protocol/ir155.hpp"
#include "tests/fuzz/fuzz.hpp"

using namespace bmu;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Numbers input(data, size);
  while (!input.is_empty()) {
    ir155::Pwm pwm{.frequency_mHz = input.next<std::int32_t>(), .duty_permille = input.next<std::int32_t>()};
    pwm.is_high = (input.next<std::uint8_t>() & 1U) != 0;
    pwm.since_edge = Duration{input.next<std::int64_t>()};
    const ir155::Reading reading = ir155::decode(pwm);
    FUZZ_CHECK(ir155::to_text(reading.state) != "?");
    const bool is_measured = reading.state == ir155::State::normal || reading.state == ir155::State::undervoltage;
    FUZZ_CHECK(is_measured || !reading.resistance_Ohm.is_valid());
    if (reading.resistance_Ohm.is_valid()) {
      FUZZ_CHECK(reading.resistance_Ohm.value >= 0 && reading.resistance_Ohm.value < ir155::resistance_limit_Ohm);
    }
    FUZZ_CHECK(ir155::decode(ir155::encode(reading)).state == reading.state);
  }
  return 0;
}

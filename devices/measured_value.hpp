// Encoding of a value that may be missing, for emulated third-party devices.
//
// Many third-party fields have no code for "no value", and the number that their devices send instead is unknown. Here
// the highest number is sent that is no code; a field with a documented range does not allow it, so that no receiver
// takes it for a value. A value that is out of range is sent in the same way.
#pragma once

#include "protocol/signal.hpp"

namespace bmu {

constexpr void encode_measured(const SignalSpec& signal, const SignalValue& value, FrameBytes& bytes) {
  const bool has_code = value.validity != Validity::out_of_range && !signal.special.empty();
  if (value.is_valid() || has_code) return encode_signal(signal, value, bytes);
  auto raw = static_cast<std::int64_t>(mask_of(signal.bit_count));
  while (find_special(signal, raw) != nullptr) --raw;
  insert_bits(bytes, signal.first_bit, signal.bit_count, static_cast<std::uint64_t>(raw), signal.order);
}

}  // namespace bmu

// How an emulated device of another maker says a value that it may not have.
//
// Many fields of other makers have no code for "there is none", and what their devices say instead is not known. Here
// they say the highest number that is no code, which a field with a documented range must not hold, so that nobody
// takes it for a value. What is out of range is said so, too.
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

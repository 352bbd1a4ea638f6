// Contracts that every signal of every message row inherits: a new row is tested by being in its table.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "protocol/message.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/worked_frames.hpp"

namespace bmu::test {

/// Raw numbers to test: the ends of the range, zero, their neighbours, and some from in between.
inline std::vector<std::int64_t> interesting_raws(const SignalSpec& signal, Random& random) {
  const RawRange range = raw_range(signal);
  std::vector<std::int64_t> raws{range.min, range.max};
  for (const std::int64_t raw : {range.min + 1, range.max - 1, std::int64_t{-1}, std::int64_t{0}, std::int64_t{1}}) {
    if (raw >= range.min && raw <= range.max) raws.push_back(raw);
  }
  for (int count = 0; count < 100; ++count) raws.push_back(random.between(range.min, range.max));
  return raws;
}

/// Value of a raw number, from the row's own scale and offset.
inline std::int64_t carried(const SignalSpec& signal, std::int64_t raw) {
  return raw * signal.scale + signal.offset;
}

inline SignalValue through_the_wire(const SignalSpec& signal, const SignalValue& value) {
  FrameBytes bytes{};
  encode_signal(signal, value, bytes);
  return decode_signal(signal, bytes);
}
inline std::int64_t raw_sent(const SignalSpec& signal, const SignalValue& value) {
  FrameBytes bytes{};
  encode_signal(signal, value, bytes);
  return raw_of(signal, bytes);
}

inline void contract_round_trip(const SignalSpec& signal, Random& random) {
  for (const std::int64_t raw : interesting_raws(signal, random)) {
    if (find_special(signal, raw) != nullptr) continue;  // a special code within the range of numbers
    const SignalValue value = known(carried(signal, raw));
    REQUIRE(raw_sent(signal, value) == raw);
    REQUIRE(through_the_wire(signal, value) == value);
  }
}

inline void contract_special_codes(const SignalSpec& signal) {
  for (const SpecialCode& code : signal.special) {
    REQUIRE(raw_sent(signal, not_known(code.meaning)) == code.raw);
    REQUIRE(through_the_wire(signal, not_known(code.meaning)) == not_known(code.meaning));
  }
}

/// Whatever the reason, "no number" is never sent as a number, least of all as 0, unless 0 is a special code of the
/// row.
inline void contract_unknown_is_never_a_number(const SignalSpec& signal) {
  if (signal.special.empty()) return;
  for (const Validity why : {Validity::unknown, Validity::not_fitted, Validity::open_circuit, Validity::short_circuit,
                             Validity::sensor_fault, Validity::above_range, Validity::out_of_range}) {
    REQUIRE((raw_sent(signal, not_known(why)) != 0 || find_special(signal, 0) != nullptr));
    REQUIRE_FALSE(through_the_wire(signal, not_known(why)).is_valid());
  }
}

inline void contract_rounding(const SignalSpec& signal, Random& random) {
  const RawRange range = raw_range(signal);
  for (const std::int64_t raw : interesting_raws(signal, random)) {
    if (raw <= range.min || raw >= range.max) continue;
    const std::int64_t sign = raw < 0 ? -1 : 1;
    const bool is_nearest = signal.rounding == Rounding::nearest;
    for (const std::int64_t more :
         {std::int64_t{0}, (signal.scale - 1) / 2, (signal.scale + 1) / 2, signal.scale - 1}) {
      const bool is_up = is_nearest && 2 * more >= signal.scale;
      REQUIRE(raw_sent(signal, known(carried(signal, raw) + sign * more)) == raw + (is_up ? sign : 0));
    }
  }
}

/// Beyond the field's range the nearest number is sent, and it is a number: no special code.
inline void contract_saturation(const SignalSpec& signal) {
  const RawRange range = raw_range(signal);
  const std::int64_t far = std::int64_t{1} << 61;
  for (const std::int64_t value : {carried(signal, range.max + 1), carried(signal, range.max + 1'000), far}) {
    REQUIRE(through_the_wire(signal, known(value)) == known(carried(signal, range.max)));
  }
  for (const std::int64_t value : {carried(signal, range.min - 1), carried(signal, range.min - 1'000), -far}) {
    REQUIRE(through_the_wire(signal, known(value)) == known(carried(signal, range.min)));
  }
}

/// The bits of the field, counted one by one as the protocol numbers them in either order.
inline FrameBytes field_mask(const SignalSpec& signal) {
  FrameBytes mask{};
  for (unsigned bit = signal.first_bit; bit < signal.first_bit + unsigned{signal.bit_count}; ++bit) {
    const unsigned in_byte = signal.order == ByteOrder::big ? 7 - bit % 8 : bit % 8;
    mask[bit / 8] = static_cast<std::uint8_t>(mask[bit / 8] | (1U << in_byte));
  }
  return mask;
}

inline void contract_other_bits_stay(const SignalSpec& signal, Random& random) {
  const FrameBytes mask = field_mask(signal);
  for (const std::int64_t raw : interesting_raws(signal, random)) {
    FrameBytes before{};
    for (std::uint8_t& one : before) one = static_cast<std::uint8_t>(random.next());
    FrameBytes after = before;
    encode_signal(signal, known(carried(signal, raw)), after);
    for (std::size_t index = 0; index < after.size(); ++index) {
      REQUIRE(((before[index] ^ after[index]) & static_cast<std::uint8_t>(~mask[index])) == 0);
    }
  }
}

/// Every bit pattern has a meaning: a number that the range allows, or a reason.
inline void contract_decoding_is_total(const SignalSpec& signal, Random& random) {
  const RawRange range = raw_range(signal);
  for (int count = 0; count < 1'000; ++count) {
    FrameBytes bytes{};
    for (std::uint8_t& one : bytes) one = static_cast<std::uint8_t>(random.next());
    const SignalValue value = decode_signal(signal, bytes);
    if (!value.is_valid()) continue;
    REQUIRE(value.value >= carried(signal, range.min));
    REQUIRE(value.value <= carried(signal, range.max));
  }
}

inline void check_signal_contracts(const SignalSpec& signal, Random& random) {
  contract_special_codes(signal);
  contract_unknown_is_never_a_number(signal);
  if (signal.bit_count == 64) return;  // letters, bytes: every pattern stands for itself
  contract_other_bits_stay(signal, random);
  contract_round_trip(signal, random);
  contract_rounding(signal, random);
  contract_saturation(signal);
  contract_decoding_is_total(signal, random);
}

}  // namespace bmu::test

// Description of a signal: position of a value in a frame, its meaning, and the encoding of "unknown" on the wire.
//
// One SignalSpec row serves decoding, encoding, the DBC and the output of the tools. A decoded value is never a bare
// number: a value that is unknown to the sender, outside the field's range or not measurable by a sensor is given as a
// Validity, and the number beside it must not be used.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "protocol/assert.hpp"
#include "protocol/bits.hpp"
#include "protocol/units.hpp"

namespace bmu {

enum class Validity : std::uint8_t {
  valid,
  unknown,        // the sender reports it as unknown
  not_fitted,     // no such cell or sensor
  open_circuit,   // sensor or wire open
  short_circuit,  // sensor shorted
  sensor_fault,   // open or shorted, the field cannot distinguish
  above_range,    // this much or more than the field can carry
  unchanged,      // a command that leaves the value as it is
  out_of_range,   // a number that is not allowed in the field
  doubtful,       // a received number that is implausible and not confirmed yet; never on the wire
};

[[nodiscard]] std::string_view to_text(Validity validity);

struct SignalValue {
  std::int64_t value = 0;  // in the signal's unit; meaningless unless valid
  Validity validity = Validity::unknown;

  [[nodiscard]] constexpr bool is_valid() const { return validity == Validity::valid; }
  friend constexpr bool operator==(const SignalValue&, const SignalValue&) = default;
};

[[nodiscard]] constexpr SignalValue known(std::int64_t value) {
  return {value, Validity::valid};
}
[[nodiscard]] constexpr SignalValue not_known(Validity why = Validity::unknown) {
  return {0, why};
}

/// A raw value with a special meaning instead of a number.
struct SpecialCode {
  std::int64_t raw = 0;  // as sign-extended for signed signals
  Validity meaning = Validity::unknown;
};

/// A raw value with a name: modes, states, results.
struct RawName {
  std::int64_t raw = 0;
  std::string_view name;
};

enum class Rounding : std::uint8_t {
  nearest,
  towards_zero,  // limits: never report more than is available
};

/// Smallest and largest raw number.
struct RawRange {
  std::int64_t min = 0;
  std::int64_t max = 0;
};

struct SignalSpec {
  std::string_view name;  // ends with its unit's suffix
  std::uint8_t first_bit = 0;
  std::uint8_t bit_count = 0;
  Unit unit = Unit::none;
  std::int64_t scale = 1;   // carried counts per raw count, > 0
  std::int64_t offset = 0;  // carried counts of raw 0
  bool is_signed = false;
  ByteOrder order = ByteOrder::big;
  Rounding rounding = Rounding::nearest;
  std::span<const SpecialCode> special{};
  std::span<const RawName> names{};
  std::int64_t raw_limit = 0;       // largest magnitude allowed, if less than the field could hold; 0: no such limit
  RawRange documented{};            // range of allowed numbers, if it is another; max 0: no such range
  std::int16_t selected_by = -1;    // exists only while the message's selector (its first signal) has this value
  std::uint8_t selected_count = 1;  // or one of this number of values,
  std::uint8_t selected_step = 1;   // at this distance from each other
};

/// Whether the signal exists while its message's selector has this raw value.
[[nodiscard]] constexpr bool is_selected(const SignalSpec& signal, std::int64_t selector) {
  if (signal.selected_by < 0) return true;
  const std::int64_t behind = selector - signal.selected_by;
  return behind >= 0 && behind % signal.selected_step == 0 && behind / signal.selected_step < signal.selected_count;
}

/// The name without its unit's suffix, for output with the unit after the number.
[[nodiscard]] constexpr std::string_view name_without_unit(const SignalSpec& signal) {
  const std::string_view token = spec_of(signal.unit).token;
  return token.empty() ? signal.name : signal.name.substr(0, signal.name.size() - token.size() - 1);
}

/// Whether the signal has one bit per cell, cell 1 lowest: shown as the numbers of the cells.
[[nodiscard]] constexpr bool is_cell_mask(const SignalSpec& signal) {
  return signal.bit_count > 1 && signal.name.ends_with("_cells");
}

[[nodiscard]] constexpr const SpecialCode* find_special(const SignalSpec& signal, std::int64_t raw) {
  for (const SpecialCode& code : signal.special) {
    if (code.raw == raw) return &code;
  }
  return nullptr;
}

/// Range of the field's data; special codes at either end are not data.
[[nodiscard]] constexpr RawRange raw_range(const SignalSpec& signal) {
  if (signal.bit_count == 64) return {INT64_MIN, INT64_MAX};
  const auto top = static_cast<std::int64_t>(mask_of(signal.is_signed ? signal.bit_count - 1U : signal.bit_count));
  RawRange range{signal.is_signed ? -top - 1 : 0, top};
  while (find_special(signal, range.max) != nullptr) --range.max;
  while (find_special(signal, range.min) != nullptr) ++range.min;
  if (signal.raw_limit > 0) {
    range.max = range.max < signal.raw_limit ? range.max : signal.raw_limit;
    range.min = range.min > -signal.raw_limit ? range.min : -signal.raw_limit;
  }
  return signal.documented.max > 0 ? signal.documented : range;
}

/// Whether the field may hold a raw number that is no special code.
[[nodiscard]] constexpr bool is_allowed(const SignalSpec& signal, std::int64_t raw) {
  if (signal.raw_limit > 0) return raw <= signal.raw_limit && raw >= -signal.raw_limit;
  return signal.documented.max == 0 || (raw >= signal.documented.min && raw <= signal.documented.max);
}

/// The field's bits as a number. `word` is load_big_endian of the data bytes; a reader of a whole frame loads it once.
[[nodiscard]] constexpr std::int64_t raw_of(const SignalSpec& signal, std::uint64_t word) {
  const std::uint64_t raw = extract_bits(word, signal.first_bit, signal.bit_count, signal.order);
  return signal.is_signed ? sign_extend(raw, signal.bit_count) : static_cast<std::int64_t>(raw);
}
[[nodiscard]] constexpr std::int64_t raw_of(const SignalSpec& signal, const FrameBytes& bytes) {
  return raw_of(signal, load_big_endian(bytes));
}

/// Meaning of a raw number. Total: every raw value gives a number or a reason why there is none.
[[nodiscard]] constexpr SignalValue value_of_raw(const SignalSpec& signal, std::int64_t raw) {
  if (const SpecialCode* code = find_special(signal, raw)) return not_known(code->meaning);
  if (!is_allowed(signal, raw)) return not_known(Validity::out_of_range);
  return known(raw * signal.scale + signal.offset);
}

/// Meaning of the signal in these bytes.
[[nodiscard]] constexpr SignalValue decode_signal(const SignalSpec& signal, const FrameBytes& bytes) {
  return value_of_raw(signal, raw_of(signal, bytes));
}

/// Raw number for `value`: rounded as the row specifies, and limited to the range of the field.
[[nodiscard]] constexpr std::int64_t raw_for(const SignalSpec& signal, std::int64_t value) {
  const std::int64_t above = value - signal.offset;
  const std::int64_t rounded =
      signal.rounding == Rounding::nearest ? divide_to_nearest(above, signal.scale) : above / signal.scale;
  const RawRange range = raw_range(signal);
  return rounded < range.min ? range.min : rounded > range.max ? range.max : rounded;
}

/// Writes a value, or the code of its validity. A validity without a code of its own is sent as the signal's first
/// special code, so that an unknown value is never sent as a number. Precondition of an invalid value: the signal has a
/// code.
constexpr void encode_signal(const SignalSpec& signal, const SignalValue& value, FrameBytes& bytes) {
  std::int64_t raw = 0;
  if (value.is_valid()) {
    raw = raw_for(signal, value.value);
  } else {
    BMU_ASSERT(!signal.special.empty());
    raw = signal.special.front().raw;
    for (const SpecialCode& code : signal.special) {
      if (code.meaning == value.validity) {
        raw = code.raw;
        break;
      }
    }
  }
  insert_bits(bytes, signal.first_bit, signal.bit_count, static_cast<std::uint64_t>(raw), signal.order);
}

}  // namespace bmu

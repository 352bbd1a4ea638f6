// Serialisation of an object's state to bytes, and back, for a state that another process, another build or another
// machine continues from.
//
//   std::vector<std::uint8_t> bytes(image_size(core_state));
//   write_image(core_state, bytes);
//   ...
//   if (image_layout<CoreState>() != layout_of_file) ...          // written by a build with other members in its state
//   if (const auto problem = read_image(bytes, core_state)) ...
//
// Members follow each other in their order, without gaps (fields.hpp): numbers in two's complement and IEEE 754 in
// little-endian order, each as wide as its type, a size_t as 8 bytes; a bool and an enumeration as their number; times
// as nanoseconds; an optional as a bool and, if it has one, its value; a variant as its alternative's number and that
// alternative; a FixedVector as its size and its items. The length of an image therefore depends on its content.
//
// Input is validated, since a checksum does not prove its origin: a bool must be 0 or 1, an enumeration one of its
// enumerators, a size within its capacity, a variant's number one of its alternatives, and no byte may remain. Signed
// numbers, times and floating-point numbers must be so far from the limits of their type (below) that sums and
// differences of them stay within; infinity is rejected, NaN is accepted. Further constraints are checked by the type
// itself (are_fields_possible, fields.hpp). After an error the object is partly written: read into one that can be
// discarded.
//
// No allocation. Cost: that of copying the object member by member; 2 to 3 ns each (docs/performance.md).
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>

#include "protocol/assert.hpp"
#include "protocol/enumerators.hpp"
#include "protocol/fields.hpp"
#include "protocol/fixed_vector.hpp"

namespace bmu {

namespace image {

template <class T>
inline constexpr bool is_optional = false;
template <class T>
inline constexpr bool is_optional<std::optional<T>> = true;
template <class T>
inline constexpr bool is_array = false;
template <class T, std::size_t Size>
inline constexpr bool is_array<std::array<T, Size>> = true;
template <class T>
inline constexpr bool is_fixed_vector = false;
template <class T, std::size_t Capacity>
inline constexpr bool is_fixed_vector<FixedVector<T, Capacity>> = true;
template <class T>
inline constexpr bool is_variant = false;
template <class... T>
inline constexpr bool is_variant<std::variant<T...>> = true;
template <class T>
inline constexpr bool is_duration = false;
template <class Rep, class Period>
inline constexpr bool is_duration<std::chrono::duration<Rep, Period>> = true;
template <class T>
inline constexpr bool is_time_point = false;
template <class Clock, class Length>
inline constexpr bool is_time_point<std::chrono::time_point<Clock, Length>> = true;

// Largest magnitude of a number that is read.
inline constexpr std::int32_t int32_max = 1 << 30;                     // 1 073 V in uV, 1 MA in mA
inline constexpr std::int64_t int64_max = std::int64_t{1} << 52;       // 1.2 million Ah in uAs
inline constexpr std::int64_t instant_max_ns = std::int64_t{1} << 60;  // 36 years since the machine started
inline constexpr std::int64_t span_max_ns = std::int64_t{1} << 62;     // from 1970 to 2116: difference of two clocks
inline constexpr double double_max = 1e15;

template <class Number>
constexpr bool is_possible(Number number) {
  if constexpr (std::is_floating_point_v<Number>) {
    return !(number > double_max) && !(number < -double_max);
  } else if constexpr (std::is_same_v<Number, std::int64_t>) {
    return number <= int64_max && number >= -int64_max;
  } else if constexpr (std::is_same_v<Number, std::int32_t>) {
    return number <= int32_max && number >= -int32_max;
  } else {
    return true;
  }
}

/// Type of a number in an image, the same on every machine: std::size_t may have 32 bits elsewhere.
template <class Number>
using Wide = std::conditional_t<std::is_same_v<Number, std::size_t>, std::uint64_t, Number>;

template <class Number>
constexpr auto to_bytes(Number number) {
  auto bytes = std::bit_cast<std::array<std::uint8_t, sizeof(Number)>>(number);
  if constexpr (std::endian::native == std::endian::big) std::reverse(bytes.begin(), bytes.end());
  return bytes;
}

template <class Number>
constexpr Number from_bytes(std::array<std::uint8_t, sizeof(Number)> bytes) {
  if constexpr (std::endian::native == std::endian::big) std::reverse(bytes.begin(), bytes.end());
  return std::bit_cast<Number>(bytes);
}

/// Passes each number of an object to `put`, in the order of the image.
template <class T, class Put>
constexpr void each_number(const T& value, Put& put) {
  if constexpr (is_skipped<T>) {
  } else if constexpr (std::is_same_v<T, bool>) {
    put(static_cast<std::uint8_t>(value ? 1 : 0));
  } else if constexpr (std::is_arithmetic_v<T>) {
    put(static_cast<Wide<T>>(value));
  } else if constexpr (std::is_enum_v<T>) {
    put(static_cast<std::underlying_type_t<T>>(value));
  } else if constexpr (is_duration<T>) {
    put(static_cast<std::int64_t>(value.count()));
  } else if constexpr (is_time_point<T>) {
    put(static_cast<std::int64_t>(value.time_since_epoch().count()));
  } else if constexpr (is_optional<T>) {
    put(static_cast<std::uint8_t>(value.has_value() ? 1 : 0));
    if (value.has_value()) each_number(*value, put);
  } else if constexpr (is_variant<T>) {
    put(static_cast<std::uint8_t>(value.index()));
    std::visit([&put](const auto& held) { each_number(held, put); }, value);
  } else if constexpr (is_array<T>) {
    for (const auto& item : value) each_number(item, put);
  } else if constexpr (is_fixed_vector<T>) {
    put(static_cast<std::uint64_t>(value.size()));
    for (const auto& item : value) each_number(item, put);
  } else {
    take_fields(value, [&put](const auto&... fields) { (each_number(fields, put), ...); });
  }
}

}  // namespace image

/// Number of bytes that write_image() needs.
template <class T>
[[nodiscard]] constexpr std::size_t image_size(const T& value) {
  std::size_t size = 0;
  const auto put = [&size](auto number) { size += sizeof(number); };
  image::each_number(value, put);
  return size;
}

/// Writes an image and returns its size. Precondition: `to` has at least image_size() bytes.
template <class T>
std::size_t write_image(const T& value, std::span<std::uint8_t> to) {
  std::size_t written = 0;
  const auto put = [&written, to](auto number) {
    BMU_ASSERT(to.size() - written >= sizeof(number));
    const auto bytes = image::to_bytes(number);
    std::memcpy(to.data() + written, bytes.data(), bytes.size());
    written += bytes.size();
  };
  image::each_number(value, put);
  return written;
}

/// Error in an image.
enum class ImageProblem : std::uint8_t {
  too_short,   // the data ends before all members are read
  too_long,    // bytes remain
  no_bool,     // neither 0 nor 1
  no_word,     // no enumerator of the enumeration
  no_size,     // more items than the capacity
  no_variant,  // no alternative of the variant
  no_number,   // beyond the bound of its type
  no_state,    // member values that their type rejects (are_fields_possible)
};
[[nodiscard]] std::string_view to_text(ImageProblem problem);

class ImageReader {
 public:
  explicit ImageReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  /// Reads one value; does nothing after an error.
  template <class T>
  void read(T& value) {
    if (!is_good_) return;
    if constexpr (is_skipped<T>) {
    } else if constexpr (std::is_same_v<T, bool>) {
      const auto number = next<std::uint8_t>();
      expect(number <= 1, ImageProblem::no_bool);
      value = number == 1;
    } else if constexpr (std::is_arithmetic_v<T>) {
      const auto number = next<image::Wide<T>>();
      expect(image::is_possible(number), ImageProblem::no_number);
      if (is_good_) value = static_cast<T>(number);
    } else if constexpr (std::is_enum_v<T>) {
      const auto number = next<std::underlying_type_t<T>>();
      expect(is_enumerator<T>(number), ImageProblem::no_word);
      if (is_good_) value = static_cast<T>(number);
    } else if constexpr (image::is_duration<T>) {
      value = T{static_cast<typename T::rep>(next_within(image::span_max_ns))};
    } else if constexpr (image::is_time_point<T>) {
      value = T{typename T::duration{static_cast<typename T::rep>(next_within(image::instant_max_ns))}};
    } else if constexpr (image::is_optional<T>) {
      read_optional(value);
    } else if constexpr (image::is_variant<T>) {
      read_variant(value, std::make_index_sequence<std::variant_size_v<T>>{});
    } else if constexpr (image::is_array<T>) {
      for (auto& item : value) read(item);
    } else if constexpr (image::is_fixed_vector<T>) {
      read_items(value);
    } else {
      take_fields(value, [this](auto&&... fields) { (this->read(fields), ...); });
      if (is_good_) expect(FieldAccess::are_possible(value), ImageProblem::no_state);
      if (is_good_) FieldAccess::after_reading(value);
    }
  }
  void end() { expect(bytes_.empty(), ImageProblem::too_long); }
  [[nodiscard]] std::optional<ImageProblem> problem() const {
    return is_good_ ? std::nullopt : std::optional(problem_);
  }

 private:
  void expect(bool holds, ImageProblem problem) {
    if (holds || !is_good_) return;
    is_good_ = false;
    problem_ = problem;
  }

  template <class Number>
  Number next() {
    std::array<std::uint8_t, sizeof(Number)> bytes{};
    expect(bytes_.size() >= bytes.size(), ImageProblem::too_short);
    if (!is_good_) return {};
    std::memcpy(bytes.data(), bytes_.data(), bytes.size());
    bytes_ = bytes_.subspan(bytes.size());
    return image::from_bytes<Number>(bytes);
  }

  /// Number with a magnitude of at most `most`.
  std::int64_t next_within(std::int64_t most) {
    const auto number = next<std::int64_t>();
    expect(number <= most && number >= -most, ImageProblem::no_number);
    return is_good_ ? number : 0;
  }

  template <class T>
  void read_optional(std::optional<T>& value) {
    bool has_value = false;
    read(has_value);
    value.reset();
    if (has_value) read(value.emplace());
  }

  template <class T, std::size_t... Index>
  void read_variant(T& value, std::index_sequence<Index...> /*alternatives*/) {
    const auto index = next<std::uint8_t>();
    expect(index < sizeof...(Index), ImageProblem::no_variant);
    static_cast<void>(((Index == index && is_good_ ? (read(value.template emplace<Index>()), true) : false) || ...));
  }

  template <class T, std::size_t Capacity>
  void read_items(FixedVector<T, Capacity>& items) {
    const auto size = next<std::uint64_t>();
    expect(size <= Capacity, ImageProblem::no_size);
    if (size == items.size()) {  // members excluded from the image keep their values
      for (T& item : items) read(item);
      return;
    }
    items.clear();
    for (std::uint64_t count = 0; count < size && is_good_; ++count) {
      items.push_back({});
      read(items.back());
    }
  }

  std::span<const std::uint8_t> bytes_;
  bool is_good_ = true;
  ImageProblem problem_ = ImageProblem::too_short;  // meaningful only if not is_good_
};

/// Reads an image; returns nothing if all of it was read.
template <class T>
[[nodiscard]] std::optional<ImageProblem> read_image(std::span<const std::uint8_t> bytes, T& value) {
  ImageReader reader(bytes);
  reader.read(value);
  reader.end();
  return reader.problem();
}

// --- the layout -----------------------------------------------------------------------------------------------------

namespace image {

/// FNV-1a over the structure of a type.
class LayoutHash {
 public:
  template <class T>
  consteval void add() {
    if constexpr (is_skipped<T>) {
      mix('-', 0);
    } else if constexpr (std::is_same_v<T, bool>) {
      mix('b', 1);
    } else if constexpr (std::is_floating_point_v<T>) {
      mix('f', sizeof(T));
    } else if constexpr (std::is_arithmetic_v<T>) {
      mix(std::is_signed_v<T> ? 'i' : 'u', sizeof(Wide<T>));
    } else if constexpr (std::is_enum_v<T>) {
      mix('e', sizeof(T));
      for (std::size_t number = 0; number < enumerators_max; ++number) {
        mix(is_enumerator<T>(static_cast<std::underlying_type_t<T>>(number)) ? '1' : '0', 0);
      }
    } else if constexpr (is_duration<T> || is_time_point<T>) {
      mix('t', sizeof(std::int64_t));
    } else if constexpr (is_optional<T>) {
      mix('o', 0);
      add<typename T::value_type>();
    } else if constexpr (is_variant<T>) {
      mix('v', std::variant_size_v<T>);
      add_alternatives<T>(std::make_index_sequence<std::variant_size_v<T>>{});
    } else if constexpr (is_array<T>) {
      mix('a', std::tuple_size_v<T>);
      add<typename T::value_type>();
    } else if constexpr (is_fixed_vector<T>) {
      mix('l', T::capacity());
      add<typename T::value_type>();
    } else {
      mix('{', 0);
      add_fields(static_cast<FieldTypes<T>*>(nullptr));
      mix('}', 0);
    }
  }
  [[nodiscard]] consteval std::uint64_t value() const { return value_; }

 private:
  consteval void mix(char kind, std::uint64_t size) {
    mix_byte(static_cast<std::uint8_t>(kind));
    for (int shift = 0; shift < 64; shift += 8) mix_byte(static_cast<std::uint8_t>(size >> shift));
  }
  consteval void mix_byte(std::uint8_t byte) { value_ = (value_ ^ byte) * 0x100000001b3ULL; }
  template <class T, std::size_t... Index>
  consteval void add_alternatives(std::index_sequence<Index...> /*alternatives*/) {
    (add<std::variant_alternative_t<Index, T>>(), ...);
  }
  template <class... Field>
  consteval void add_fields(FieldList<Field...>* /*types*/) {
    (add<Field>(), ...);
  }

  std::uint64_t value_ = 0xcbf29ce484222325ULL;
};

template <class T>
consteval std::uint64_t layout() {
  LayoutHash hash;
  hash.add<T>();
  return hash.value();
}

}  // namespace image

namespace image {

template <class T>
consteval bool names_all();

template <class... T>
consteval bool names_all_of(FieldList<T...>* /*types*/) {
  return (names_all<T>() && ...);
}
template <class... T>
consteval bool names_all_of(std::variant<T...>* /*type*/) {
  return (names_all<T>() && ...);
}

template <class T>
consteval bool names_all() {
  if constexpr (is_skipped<T> || std::is_arithmetic_v<T> || std::is_enum_v<T> || is_duration<T> || is_time_point<T>) {
    return true;
  } else if constexpr (is_variant<T>) {
    return names_all_of(static_cast<T*>(nullptr));
  } else if constexpr (is_optional<T> || is_array<T> || is_fixed_vector<T>) {
    return names_all<typename T::value_type>();
  } else {
    static_assert(names_all_fields<T>(), "a member is missing in BMU_FIELDS, or does not stand in its place");
    return names_all_of(static_cast<FieldTypes<T>*>(nullptr));
  }
}

}  // namespace image

/// Every class and struct in an image of T names all its members. Does not compile otherwise, and the compiler names
/// the type.
template <class T>
inline constexpr bool image_names_all_fields = image::names_all<T>();

/// Differs for every other order, kind or number of members, and for enumerations with other numbers.
template <class T>
inline constexpr std::uint64_t image_layout = image::layout<T>();

}  // namespace bmu

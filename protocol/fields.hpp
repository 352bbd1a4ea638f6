// All members of a thing in their order, for what has to treat each of them alike: to write down its state, to read it
// again, to compare.
//
//   class Counter {
//     ...
//    private:
//     const Model* model_ = nullptr;
//     std::int64_t charge_uAs_ = 0;
//     bool is_begun_ = false;
//     BMU_FIELDS(skipped(model_), charge_uAs_, is_begun_)
//   };
//   take_fields(counter, [](auto&... fields) { (write(fields), ...); });
//
// A class names them, at its end; a plain struct does not have to (aggregate_fields.hpp). Whether one was forgotten
// that makes the class larger, names_all_fields() can be asked: it works out how large the named ones make it.
// `skipped` is for what is no state: the model somebody looks at, what follows from the configuration.
//
// What is read from outside may be anything. A class or struct that uses a member as an index, a divisor or the like
// says what cannot be, and is asked after its members were read:
//
//   bool are_fields_possible() const { return head_ < ring_.size(); }
#pragma once

#include <algorithm>
#include <cstddef>
#include <type_traits>

#include "protocol/aggregate_fields.hpp"

namespace bmu {

/// Stands where a member stands that is not to be treated.
template <class Field>
struct Skipped {
  using type = Field;
};
template <class Field>
constexpr Skipped<Field> skipped(const Field& /*field*/) {
  return {};
}

template <class Field>
inline constexpr bool is_skipped = false;
template <class Field>
inline constexpr bool is_skipped<Skipped<Field>> = true;

// NOLINTNEXTLINE(cppcoreguidelines-macro-usage): names members, which nothing else can
#define BMU_FIELDS(...)                                           \
  friend struct ::bmu::FieldAccess;                               \
  template <class Take>                                           \
  constexpr decltype(auto) take_named_fields(Take&& take) {       \
    return take(__VA_ARGS__);                                     \
  }                                                               \
  template <class Take>                                           \
  constexpr decltype(auto) take_named_fields(Take&& take) const { \
    return take(__VA_ARGS__);                                     \
  }

/// For are_fields_possible: what is not a number is not within.
[[nodiscard]] constexpr bool is_within(double value, double low, double high) {
  return value >= low && value <= high;
}

struct FieldAccess {
  /// True where nothing is said against any value.
  template <class Thing>
  [[nodiscard]] static constexpr bool are_possible(const Thing& thing) {
    if constexpr (requires { thing.are_fields_possible(); }) {
      return thing.are_fields_possible();
    } else {
      return true;
    }
  }
  /// For who has to set something right once all members have been read.
  template <class Thing>
  static constexpr void after_reading(Thing& thing) {
    if constexpr (requires { thing.after_reading_fields(); }) thing.after_reading_fields();
  }

  template <class Thing, class Take>
  static constexpr decltype(auto) take(Thing& thing, Take&& take) {
    if constexpr (requires { thing.take_named_fields(take); }) {
      return thing.take_named_fields(take);
    } else {
      return take_aggregate_fields(thing, take);
    }
  }
};

template <class... Field>
struct FieldList {};

/// The types of all members, in their order.
template <class Thing>
using FieldTypes = decltype(FieldAccess::take(std::declval<std::remove_cv_t<Thing>&>(), [](auto&&... fields) {
  return FieldList<std::remove_cvref_t<decltype(fields)>...>{};
}));

template <class Thing, class Take>
constexpr decltype(auto) take_fields(Thing& thing, Take&& take) {
  return FieldAccess::take(thing, take);
}

namespace fields {

template <class Field>
struct TypeOf {
  using type = Field;
};
template <class Field>
struct TypeOf<Skipped<Field>> {
  using type = Field;
};

/// What a compiler makes of members in this order.
template <class... Field>
consteval std::size_t size_of(FieldList<Field...>* /*types*/) {
  std::size_t size = 0;
  std::size_t alignment = 1;
  const auto round_up = [](std::size_t value, std::size_t to) { return (value + to - 1) / to * to; };
  const auto add = [&](std::size_t field_size, std::size_t field_alignment) {
    size = round_up(size, field_alignment) + field_size;
    alignment = std::max(alignment, field_alignment);
  };
  (add(sizeof(typename TypeOf<Field>::type), alignof(typename TypeOf<Field>::type)), ...);  // NOLINT: of pointers, too
  return round_up(size, alignment);
}

}  // namespace fields

/// The members that are named, in their order, take all of its room. What hides in padding, as one bool behind another,
/// is not seen.
template <class Thing>
[[nodiscard]] consteval bool names_all_fields() {
  return fields::size_of(static_cast<FieldTypes<Thing>*>(nullptr)) == sizeof(Thing);
}

}  // namespace bmu

// Access to all members of an object in declaration order, for code that treats all alike: to serialise its state, to
// deserialise it, to compare.
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
// A class names its members at its end; a plain struct does not have to (aggregate_fields.hpp). names_all_fields()
// detects a missing member that makes the class larger: it computes the size that the named ones give. `skipped` is for
// members that are not state: a pointer to a model in use, values that follow from the configuration.
//
// Data read from outside may have any value. A class or struct that uses a member as an index, a divisor or the like
// validates it with this function, which is called after its members were read:
//
//   bool are_fields_possible() const { return head_ < ring_.size(); }
#pragma once

#include <algorithm>
#include <cstddef>
#include <type_traits>

#include "protocol/aggregate_fields.hpp"

namespace bmu {

/// Placeholder of a member that is excluded.
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

/// For are_fields_possible: NaN is outside any range.
[[nodiscard]] constexpr bool is_within(double value, double low, double high) {
  return value >= low && value <= high;
}

struct FieldAccess {
  /// Result of are_fields_possible(); true for a type without it.
  template <class Thing>
  [[nodiscard]] static constexpr bool are_possible(const Thing& thing) {
    if constexpr (requires { thing.are_fields_possible(); }) {
      return thing.are_fields_possible();
    } else {
      return true;
    }
  }
  /// Calls after_reading_fields(), if the type has it, once all members have been read.
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

/// Size that a compiler gives a class with members in this order.
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

/// Whether the named members, in their order, account for the whole size of a class. A member that fits into padding,
/// such as one bool after another, is not detected.
template <class Thing>
[[nodiscard]] consteval bool names_all_fields() {
  return fields::size_of(static_cast<FieldTypes<Thing>*>(nullptr)) == sizeof(Thing);
}

}  // namespace bmu

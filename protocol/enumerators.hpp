// Test whether a number is an enumerator of an enumeration, for code that reads enumerations from outside.
//
// Covers the first `enumerators_max` numbers, by the name the compiler gives each; a number without a name is not an
// enumerator. Cost: an index into a table made at compile time.
#pragma once

#include <array>
#include <cstddef>
#include <string_view>
#include <type_traits>
#include <utility>

namespace bmu {

inline constexpr std::size_t enumerators_max = 128;

namespace enumerators {

template <class Enum, Enum value>
consteval bool has_name() {
  // GCC and clang end this text alike: "... value = bmu::Port::vehicle]", and "... value = (bmu::Port)7]" for no
  // enumerator; the name of an anonymous namespace contains parentheses as well.
  constexpr std::string_view text = __PRETTY_FUNCTION__;
  constexpr std::size_t close = text.rfind(')');
  return close == std::string_view::npos || close < text.rfind("= ") || text[close + 1] == ':';
}

template <class Enum, std::size_t... Number>
consteval std::array<bool, sizeof...(Number)> named(std::index_sequence<Number...> /*numbers*/) {
  return {has_name<Enum, static_cast<Enum>(Number)>()...};
}

}  // namespace enumerators

template <class Enum>
requires std::is_enum_v<Enum>
[[nodiscard]] constexpr bool is_enumerator(std::underlying_type_t<Enum> number) {
  constexpr auto named = enumerators::named<Enum>(std::make_index_sequence<enumerators_max>{});
  if constexpr (std::is_signed_v<std::underlying_type_t<Enum>>) {
    if (number < 0) return false;
  }
  return static_cast<std::size_t>(number) < named.size() && named[static_cast<std::size_t>(number)];
}

}  // namespace bmu

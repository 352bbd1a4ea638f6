// Conversion of a text that is a number and nothing else.
#pragma once

#include <charconv>
#include <optional>
#include <string_view>

namespace bmu {

/// None if the text has anything before or after the number, is empty, or the number does not fit into a Number. `how`:
/// the base of an integer, if it is not 10.
template <class Number, class... How>
[[nodiscard]] std::optional<Number> number_of_text(std::string_view text, How... how) {
  Number value{};
  const char* const text_end = text.data() + text.size();
  const auto [end, error] = std::from_chars(text.data(), text_end, value, how...);
  const bool is_all = error == std::errc{} && end == text_end;
  return is_all ? std::optional(value) : std::nullopt;
}

}  // namespace bmu

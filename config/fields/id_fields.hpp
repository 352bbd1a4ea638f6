// Rows of keys that have an identifier on a bus as their value.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "config/fields/pack_fields.hpp"

namespace bmu {

/// Value of hexadecimal digits; none if the text has anything else, or is below 0.
[[nodiscard]] std::optional<int> hex_value(std::string_view text);
[[nodiscard]] bool is_nothing_or_id(std::string_view text);
/// Form that is_nothing_or_id() expects, for messages.
inline constexpr std::string_view id_form = "1 to 3 hexadecimal digits up to \"7FF\", or nothing";

/// An optional identifier, hexadecimal; 0 and an empty text are the same.
template <auto Member>
[[nodiscard]] constexpr auto optional_id(FieldInfo info) {
  using Owner = detail::OwnerOf<Member>;
  info.min = 0;
  info.max = 3;
  info.type = FieldType::text;
  return Field<Owner>{
      info,
      [](const Owner& owner) -> FieldValue { return owner.*Member == 0 ? std::string() : hex_text(owner.*Member); },
      [](Owner& owner, const FieldValue& value) {
        owner.*Member = static_cast<std::uint16_t>(hex_value(std::get<std::string>(value)).value_or(0));
      }};
}

}  // namespace bmu

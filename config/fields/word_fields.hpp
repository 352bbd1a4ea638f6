// Rows of keys with one of a list of words as their value: the names of an enumeration, or of the devices that have a
// driver of one kind. The reader, the documentation page and the editor's schema take the words from the row.
#pragma once

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include "config/fields/fields.hpp"
#include "devices/device_list.hpp"

namespace bmu {

/// The longest word of any list, in bytes; shorter ones may be added without a change of their row.
inline constexpr double word_length_max = 32;

/// A value of an enumeration by its name. `Names`: a constexpr array in the order of the enumeration, from 0 on.
template <auto Member, const auto& Names>
[[nodiscard]] constexpr auto choice(FieldInfo info) {
  using Owner = detail::OwnerOf<Member>;
  using Value = typename detail::MemberOf<decltype(Member)>::Type;
  info.min = 1;
  info.max = word_length_max;
  info.type = FieldType::text;
  info.words = [] { return std::vector<std::string_view>(Names.begin(), Names.end()); };
  return Field<Owner>{
      info,
      [](const Owner& owner) -> FieldValue { return std::string(Names.at(static_cast<std::size_t>(owner.*Member))); },
      [](Owner& owner, const FieldValue& value) {
        const auto found = std::find(Names.begin(), Names.end(), std::get<std::string>(value));
        if (found != Names.end()) owner.*Member = static_cast<Value>(found - Names.begin());
      }};
}

/// The device of that name as a driver of one kind (`Driver`: a member of Device); null if there is none.
template <auto Driver>
[[nodiscard]] auto driver_named(std::string_view name) {
  const Device* const device = find_device(name);
  return device != nullptr ? device->*Driver : nullptr;
}

/// The name of a device that has a driver of that kind, or empty for no driver. A new device needs no row.
template <auto Member, auto Driver>
[[nodiscard]] constexpr auto driver_field(FieldInfo info) {
  using Owner = detail::OwnerOf<Member>;
  info.min = 0;
  info.max = word_length_max;
  info.type = FieldType::text;
  info.words = [] {
    std::vector<std::string_view> names;
    for (const Device* device : all_devices()) {
      if (device->*Driver != nullptr) names.push_back(device->name);
    }
    return names;
  };
  return Field<Owner>{info,
                      [](const Owner& owner) -> FieldValue {
                        return owner.*Member != nullptr ? std::string((owner.*Member)->name) : std::string();
                      },
                      [](Owner& owner, const FieldValue& value) {
                        owner.*Member = driver_named<Driver>(std::get<std::string>(value));
                      }};
}

}  // namespace bmu

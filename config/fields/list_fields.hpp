// A list of numbers as a row, like fields.hpp for one value: its name, the count of numbers, their range, and the
// member it fills. The type of the member gives the count: std::array<double, N>, or an array of these for a list of
// lists.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string_view>

#include "config/fields/fields.hpp"

namespace bmu {

struct ListInfo {
  FieldInfo number;                 // the key, and the range of each of its numbers
  std::string_view one_for_each{};  // element to which a number, or a list, belongs: "one for each pair"
  bool is_rising = false;
  std::size_t list_count = 0;  // count of lists; 0: the key's own list holds the numbers
  std::size_t number_count = 0;
};

template <class Target>
struct ListField {
  ListInfo info;
  double file_units = 1.0;  // per unit of the member
  std::span<const double> (*read)(const Target&, std::size_t list) = nullptr;
  std::span<double> (*write)(Target&, std::size_t list) = nullptr;
};

/// Reads a list in the file's unit; returns false and adds problems if it is invalid.
bool read_numbers(const JsonValue& value, const ListInfo& info, const Place& place, std::span<double> numbers,
                  ProblemList& problems);

/// Checks that there are as many lists as the row requires.
[[nodiscard]] bool has_lists(const JsonValue& value, const ListInfo& info, const Place& place, ProblemList& problems);

/// Fills the target from the object; every list is required.
template <class Target>
void read_lists(const JsonValue& object, const Place& object_place, std::span<const ListField<Target>> fields,
                Target& target, ProblemList& problems) {
  for (const ListField<Target>& field : fields) {
    const auto read_one = [&](const JsonValue& value, const Place& place, std::size_t list) {
      const std::span<double> numbers = field.write(target, list);
      if (!read_numbers(value, field.info, place, numbers, problems)) return;
      for (double& number : numbers) number /= field.file_units;
    };
    const JsonValue* value = find_value(object, object_place, field.info.number.key, true, problems);
    const Place place = object_place.at(field.info.number.key);
    if (value == nullptr) continue;
    if (field.info.list_count == 0) {
      read_one(*value, place, 0);
    } else if (has_lists(*value, field.info, place, problems)) {
      for (std::size_t list = 0; list < field.info.list_count; ++list) read_one((*value)[list], place.at(list), list);
    }
  }
}

[[nodiscard]] constexpr std::string_view key_of(const ListInfo& info) {
  return info.number.key;
}

// --- making rows ----------------------------------------------------------------------------------------------------

namespace detail {

template <class Member>
struct ListShape;
template <std::size_t Numbers>
struct ListShape<std::array<double, Numbers>> {
  static constexpr std::size_t list_count = 0;
  static constexpr std::size_t number_count = Numbers;
  [[nodiscard]] static constexpr auto& list(auto& member, std::size_t /*index*/) { return member; }
};
template <std::size_t Numbers, std::size_t Lists>
struct ListShape<std::array<std::array<double, Numbers>, Lists>> {
  static constexpr std::size_t list_count = Lists;
  static constexpr std::size_t number_count = Numbers;
  [[nodiscard]] static constexpr auto& list(auto& member, std::size_t index) { return member.at(index); }
};

}  // namespace detail

/// The member holds the file's numbers divided by `FileUnits`: 1000 for volts that are given in millivolts.
template <auto Member, std::int64_t FileUnits = 1>
[[nodiscard]] constexpr auto list(ListInfo info) {
  using Owner = detail::OwnerOf<Member>;
  using Shape = detail::ListShape<typename detail::MemberOf<decltype(Member)>::Type>;
  info.number.type = FieldType::real;
  info.number.is_required = true;
  info.list_count = Shape::list_count;
  info.number_count = Shape::number_count;
  return ListField<Owner>{
      info, static_cast<double>(FileUnits),
      [](const Owner& owner, std::size_t index) -> std::span<const double> {
        return Shape::list(owner.*Member, index);
      },
      [](Owner& owner, std::size_t index) -> std::span<double> { return Shape::list(owner.*Member, index); }};
}

}  // namespace bmu

// A list of numbers as a row, as fields.hpp has it for one value: its name, how many numbers, what each may be, and the
// member it fills. The member says how many: std::array<double, N>, or an array of these for lists side by side.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string_view>

#include "config/fields/fields.hpp"

namespace bmu {

struct ListInfo {
  FieldInfo number;                 // the key, and what each of its numbers may be
  std::string_view one_for_each{};  // of what there is one number, or one list: "one for each pair"
  bool is_rising = false;
  std::size_t list_count = 0;  // lists side by side; 0: the numbers stand in the key's own list
  std::size_t number_count = 0;
};

template <class Target>
struct ListField {
  ListInfo info;
  double file_units = 1.0;  // in one unit of the member
  std::span<const double> (*read)(const Target&, std::size_t list) = nullptr;
  std::span<double> (*write)(Target&, std::size_t list) = nullptr;
};

/// Takes a list over, in the file's unit; false, and the problems, if it is not as it should be.
bool read_numbers(const JsonValue& value, const ListInfo& info, const Place& place, std::span<double> numbers,
                  ProblemList& problems);

/// True if there are as many lists side by side as the row wants.
[[nodiscard]] bool has_lists(const JsonValue& value, const ListInfo& info, const Place& place, ProblemList& problems);

/// Fills the target from the object, where each list must be.
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

/// The member holds the file's numbers divided by `FileUnits`: 1000 where volts stand in millivolts.
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

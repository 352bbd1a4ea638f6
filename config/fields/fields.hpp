// One key of the file as a row: its name, the permitted values, its meaning, and the member it fills.
//
// The rows are the only definition: the reader uses them, docs/configuration.md is generated from them, and a test
// checks the editor's schema against them.
#pragma once

#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>
#include <vector>

#include "config/json/json_reader.hpp"
#include "protocol/time.hpp"

namespace bmu {

enum class FieldType : std::uint8_t { integer, real, boolean, text };

struct FieldInfo {
  std::string_view key;
  double min = 0;  // of a number; of a text: its length in bytes
  double max = 0;
  std::string_view meaning{};                          // one line of the documentation
  std::string_view because{};                          // reason for the ends of the range
  bool (*is_well_formed)(std::string_view) = nullptr;  // of a text
  std::string_view form{};                             // and its expected form
  // For a text that is one of a list: its words, as displayed; if `min` is 0, the text may be empty, too.
  std::vector<std::string_view> (*words)() = nullptr;
  bool is_required = false;
  FieldType type = FieldType::integer;
};

/// Numbers are carried as double in between: every range is within its exact integers, which read_value checks.
using FieldValue = std::variant<bool, double, std::string>;

template <class Target>
struct Field {
  FieldInfo info;
  FieldValue (*read)(const Target&) = nullptr;  // in the file's unit; the default if read from a new Target
  void (*write)(Target&, const FieldValue&) = nullptr;
};

/// The value if it meets the row's conditions; otherwise adds a problem.
[[nodiscard]] std::optional<FieldValue> read_value(const JsonValue& value, const FieldInfo& info, const Place& place,
                                                   ProblemList& problems);

/// Expected text, for messages: from its words ("ekf, mixed or coulomb", "iso165c, or nothing"), otherwise its form.
/// Empty if only its length is checked.
[[nodiscard]] std::string form_text(const FieldInfo& info);

/// "0.25", "4200": a number without unnecessary digits.
[[nodiscard]] std::string number_text(double number);

/// Fills the target from the object; a missing or wrong key leaves its member unchanged.
template <class Target>
void read_fields(const JsonValue& object, const Place& place, std::span<const Field<Target>> fields, Target& target,
                 ProblemList& problems) {
  for (const Field<Target>& field : fields) {
    const JsonValue* value = find_value(object, place, field.info.key, field.info.is_required, problems);
    if (value == nullptr) continue;
    const auto read = read_value(*value, field.info, place.at(field.info.key), problems);
    if (read) field.write(target, *read);
  }
}

[[nodiscard]] constexpr std::string_view key_of(const FieldInfo& info) {
  return info.key;
}

/// Keys of rows of any kind; `info` must have a key_of().
template <class Row>
[[nodiscard]] std::vector<std::string_view> keys_of(std::span<const Row> rows) {
  std::vector<std::string_view> keys;
  for (const Row& row : rows) keys.push_back(key_of(row.info));
  return keys;
}

// --- making rows ----------------------------------------------------------------------------------------------------

namespace detail {

template <class Member>
struct MemberOf;
template <class Class, class Value>
struct MemberOf<Value Class::*> {
  using Owner = Class;
  using Type = Value;
};
template <auto Member>
using OwnerOf = typename MemberOf<decltype(Member)>::Owner;

[[nodiscard]] inline double to_number(Duration value) {
  return static_cast<double>(to_ms(value));
}
template <class Value>
[[nodiscard]] double to_number(Value value) {
  return static_cast<double>(value);
}

template <class Value>
[[nodiscard]] Value from_number(double number) {
  if constexpr (std::is_same_v<Value, Duration>) {
    return std::chrono::milliseconds{std::llround(number)};
  } else if constexpr (std::is_integral_v<Value>) {
    return static_cast<Value>(std::llround(number));
  } else {
    return static_cast<Value>(number);
  }
}

template <std::size_t Size>
void assign_text(std::array<char, Size>& member, const std::string& text) {
  for (std::size_t i = 0; i < Size; ++i) member.at(i) = i < text.size() ? text[i] : ' ';
}
inline void assign_text(std::string& member, const std::string& text) {
  member = text;
}
template <std::size_t Size>
[[nodiscard]] std::string text_of(const std::array<char, Size>& member) {
  const std::string text(member.begin(), member.end());
  return text.substr(0, text.find_last_not_of(' ') + 1);
}
[[nodiscard]] inline std::string text_of(const std::string& member) {
  return member;
}

}  // namespace detail

/// A number. The member holds `Multiplier / Divisor` of the file's unit; durations are milliseconds in the file.
template <auto Member, std::int64_t Multiplier = 1, std::int64_t Divisor = 1>
[[nodiscard]] constexpr auto number(FieldInfo info) {
  using Owner = detail::OwnerOf<Member>;
  using Type = typename detail::MemberOf<decltype(Member)>::Type;
  return Field<Owner>{info,
                      [](const Owner& owner) -> FieldValue {
                        return detail::to_number(owner.*Member) * static_cast<double>(Divisor) /
                               static_cast<double>(Multiplier);
                      },
                      [](Owner& owner, const FieldValue& value) {
                        owner.*Member = detail::from_number<Type>(
                            std::get<double>(value) * static_cast<double>(Multiplier) / static_cast<double>(Divisor));
                      }};
}

/// A number that need not be whole.
template <auto Member, std::int64_t Multiplier = 1, std::int64_t Divisor = 1>
[[nodiscard]] constexpr auto real(FieldInfo info) {
  info.type = FieldType::real;
  return number<Member, Multiplier, Divisor>(info);
}

template <auto Member>
[[nodiscard]] constexpr auto boolean(FieldInfo info) {
  using Owner = detail::OwnerOf<Member>;
  info.type = FieldType::boolean;
  return Field<Owner>{info, [](const Owner& owner) -> FieldValue { return owner.*Member; },
                      [](Owner& owner, const FieldValue& value) { owner.*Member = std::get<bool>(value); }};
}

/// A text; in an array of characters it is padded with spaces.
template <auto Member>
[[nodiscard]] constexpr auto text(FieldInfo info) {
  using Owner = detail::OwnerOf<Member>;
  info.type = FieldType::text;
  return Field<Owner>{
      info, [](const Owner& owner) -> FieldValue { return detail::text_of(owner.*Member); },
      [](Owner& owner, const FieldValue& value) { detail::assign_text(owner.*Member, std::get<std::string>(value)); }};
}

template <class Target>
[[nodiscard]] constexpr Field<Target> required(Field<Target> field) {
  field.info.is_required = true;
  return field;
}

}  // namespace bmu

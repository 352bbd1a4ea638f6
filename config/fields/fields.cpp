#include "config/fields/fields.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace bmu {
namespace {

std::string wanted_number(const FieldInfo& info) {
  std::string text = info.type == FieldType::integer ? "a whole number from " : "a number from ";
  text += number_text(info.min) + " to " + number_text(info.max);
  if (!info.because.empty()) text += ", " + std::string(info.because);
  return text;
}

std::string wanted_text(const FieldInfo& info) {
  std::string form = form_text(info);
  if (!form.empty()) return form;
  return "a text of " + number_text(info.min) + " to " + number_text(info.max) + " characters";
}

std::string wanted(const FieldInfo& info) {
  switch (info.type) {
    case FieldType::integer:
    case FieldType::real: return wanted_number(info);
    case FieldType::boolean: return "true or false";
    case FieldType::text: return wanted_text(info);
  }
  return "?";
}

std::optional<FieldValue> number_in(const JsonValue& value, const FieldInfo& info) {
  if (!value.is_number()) return std::nullopt;
  const double number = value.get<double>();
  const bool is_in_range = std::isfinite(number) && number >= info.min && number <= info.max;
  const bool is_whole = std::nearbyint(number) == number;
  if (!is_in_range || (info.type == FieldType::integer && !is_whole)) return std::nullopt;
  return number;
}

bool is_one_of(const std::vector<std::string_view>& words, std::string_view text) {
  return std::find(words.begin(), words.end(), text) != words.end();
}

std::optional<FieldValue> text_in(const JsonValue& value, const FieldInfo& info) {
  if (!value.is_string()) return std::nullopt;
  auto text = value.get<std::string>();
  const auto length = static_cast<double>(text.size());
  const bool has_control_characters = text.find_first_of(std::string("\0\x7f", 2)) != std::string::npos ||
                                      std::any_of(text.begin(), text.end(), [](char c) { return c >= 0 && c < ' '; });
  if (has_control_characters || length < info.min || length > info.max) return std::nullopt;
  if (info.is_well_formed != nullptr && !info.is_well_formed(text)) return std::nullopt;
  if (info.words != nullptr && !text.empty() && !is_one_of(info.words(), text)) return std::nullopt;
  return text;
}

std::optional<FieldValue> value_in(const JsonValue& value, const FieldInfo& info) {
  switch (info.type) {
    case FieldType::integer:
    case FieldType::real: return number_in(value, info);
    case FieldType::boolean: return value.is_boolean() ? std::optional<FieldValue>(value.get<bool>()) : std::nullopt;
    case FieldType::text: return text_in(value, info);
  }
  return std::nullopt;
}

}  // namespace

std::optional<FieldValue> read_value(const JsonValue& value, const FieldInfo& info, const Place& place,
                                     ProblemList& problems) {
  auto read = value_in(value, info);
  if (!read) problems.add(place, shown(value), wanted(info));
  return read;
}

std::string form_text(const FieldInfo& info) {
  if (info.words == nullptr) return std::string(info.form);
  const std::vector<std::string_view> words = info.words();
  std::string form;
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (i > 0) form += i + 1 < words.size() ? ", " : " or ";
    form += words[i];
  }
  return info.min > 0 ? form : form + ", or nothing";
}

std::string number_text(double number) {
  std::array<char, 40> buffer{};
  const int length = std::snprintf(buffer.data(), buffer.size(), "%.15g", number);
  return {buffer.data(), static_cast<std::size_t>(length)};
}

}  // namespace bmu

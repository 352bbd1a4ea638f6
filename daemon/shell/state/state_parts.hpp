// Helpers for those parts of the state file that have parsers of their own: a value at a key, a number within its
// range, and the error text of a wrong one.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include <nlohmann/json.hpp>

#include "protocol/result.hpp"

namespace bmu {

inline constexpr std::int64_t unix_time_max_ms = std::int64_t{1} << 52;

[[nodiscard]] inline std::string wrong_in_state(const std::string& place, const nlohmann::ordered_json& found,
                                                const char* wanted) {
  return place + " is " + found.dump() + ", expected " + wanted;
}

/// From least to most; or no value. Unsigned numbers beyond the signed range have none.
[[nodiscard]] inline std::optional<std::int64_t> number_from(const nlohmann::ordered_json& json, std::int64_t least,
                                                             std::int64_t most) {
  if (!json.is_number_integer()) return std::nullopt;
  const bool is_too_large = json.is_number_unsigned() && json.get<std::uint64_t>() > std::uint64_t{INT64_MAX};
  const std::int64_t value = is_too_large ? INT64_MAX : json.get<std::int64_t>();
  return value >= least && value <= most ? std::optional(value) : std::nullopt;
}

/// The value at a key; null, which no rule accepts, if it is missing.
[[nodiscard]] inline const nlohmann::ordered_json& value_at(const nlohmann::ordered_json& json, const char* key) {
  static const nlohmann::ordered_json none;
  const auto found = json.is_object() ? json.find(key) : json.end();
  return found == json.end() ? none : *found;
}

/// The records of a part; empty ones for null. `parse_all(json, records)` returns the error, or "".
template <class Records, class ParseAll>
[[nodiscard]] Result<Records, std::string> parse_state_part(const nlohmann::ordered_json& json, ParseAll parse_all) {
  Records records;
  if (json.is_null()) return records;
  std::string problem = parse_all(json, records);
  if (!problem.empty()) return failure(std::move(problem));
  return records;
}

}  // namespace bmu

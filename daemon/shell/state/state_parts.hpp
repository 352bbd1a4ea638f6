// How the parts of the state file that have readers of their own look at their JSON: a value at a key, a number within
// its range, and what is said of one that is wrong.
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
  return place + " is " + found.dump() + ", wanted " + wanted;
}

/// From least to most; or none. Unsigned numbers beyond what is signed are none.
[[nodiscard]] inline std::optional<std::int64_t> number_from(const nlohmann::ordered_json& json, std::int64_t least,
                                                             std::int64_t most) {
  if (!json.is_number_integer()) return std::nullopt;
  const bool is_too_large = json.is_number_unsigned() && json.get<std::uint64_t>() > std::uint64_t{INT64_MAX};
  const std::int64_t value = is_too_large ? INT64_MAX : json.get<std::int64_t>();
  return value >= least && value <= most ? std::optional(value) : std::nullopt;
}

/// The value under a key, or null: which no rule accepts.
[[nodiscard]] inline const nlohmann::ordered_json& value_at(const nlohmann::ordered_json& json, const char* key) {
  static const nlohmann::ordered_json none;
  const auto found = json.is_object() ? json.find(key) : json.end();
  return found == json.end() ? none : *found;
}

/// What a part has; of null, nothing. `parse_all(json, records)` says what is wrong, "" if nothing is.
template <class Records, class ParseAll>
[[nodiscard]] Result<Records, std::string> parse_state_part(const nlohmann::ordered_json& json, ParseAll parse_all) {
  Records records;
  if (json.is_null()) return records;
  std::string problem = parse_all(json, records);
  if (!problem.empty()) return failure(std::move(problem));
  return records;
}

}  // namespace bmu

// A reply of the daemon, validated on reading: a missing value, null or a value of another type is unknown.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "protocol/units.hpp"

namespace bmu {

class Reply {
 public:
  /// Larger numbers do not occur: a thousand times a difference of numbers up to here is still a number.
  static constexpr std::int64_t number_max = std::int64_t{1} << 52;

  Reply() = default;
  explicit Reply(const nlohmann::json& json) : json_(&json) {}

  [[nodiscard]] Reply operator[](std::string_view key) const;
  [[nodiscard]] Reply at(std::size_t index) const;
  [[nodiscard]] std::size_t size() const;
  [[nodiscard]] std::vector<std::string> keys() const;
  [[nodiscard]] bool is_known() const { return json_ != nullptr && !json_->is_null(); }
  [[nodiscard]] bool is_true() const { return json_ != nullptr && json_->is_boolean() && json_->get<bool>(); }
  [[nodiscard]] bool is_boolean() const { return json_ != nullptr && json_->is_boolean(); }
  /// An integer, at most number_max either side of 0.
  [[nodiscard]] std::optional<std::int64_t> number() const;
  [[nodiscard]] std::int64_t number_or(std::int64_t otherwise) const { return number().value_or(otherwise); }
  [[nodiscard]] std::string text() const;  // "" if it is not a text

 private:
  const nlohmann::json* json_ = nullptr;
};

/// "3.2941 V"; "--" if it is unknown. The unit is the suffix of the key.
[[nodiscard]] std::string shown(const Reply& value, Unit unit);
/// A quantity with fewer decimals than the unit's usual ones, without its symbol: for narrow columns.
[[nodiscard]] std::string shown_short(std::optional<std::int64_t> value, Unit unit, int decimals);
/// "10.2 Wh", "1.234 kWh".
[[nodiscard]] std::string shown_energy(const Reply& mWh);
[[nodiscard]] std::string shown_energy(std::int64_t mWh);
/// "350 ms", "3.2 s", "2 min 5 s", "1 h 20 min".
[[nodiscard]] std::string shown_span(const Reply& ms);
/// "2026-03-01 17:05:09", of this machine's time zone; a fixed text if it is unknown.
[[nodiscard]] std::string shown_time(const Reply& unix_ms);
/// "wrong crc 30, late 2": the numbers of an object that are not 0, with their names.
[[nodiscard]] std::string shown_counts(const Reply& object);
/// All texts of a list, separated by commas.
[[nodiscard]] std::string shown_list(const Reply& list);

}  // namespace bmu

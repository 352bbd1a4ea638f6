// A reply of the daemon, read without trust: what is missing, null or of another kind is simply not known.
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
  /// Larger ones no daemon tells: of those up to here a thousand times a difference is still a number.
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
  /// Whole, and at most number_max either side of 0.
  [[nodiscard]] std::optional<std::int64_t> number() const;
  [[nodiscard]] std::int64_t number_or(std::int64_t otherwise) const { return number().value_or(otherwise); }
  [[nodiscard]] std::string text() const;  // "" if it is none

 private:
  const nlohmann::json* json_ = nullptr;
};

/// "3.2941 V"; "--" if it is not known. The unit is the one the key ends with.
[[nodiscard]] std::string shown(const Reply& value, Unit unit);
/// A quantity with fewer decimals than the unit's usual ones, without its symbol: for narrow columns.
[[nodiscard]] std::string shown_short(std::optional<std::int64_t> value, Unit unit, int decimals);
/// "10.2 Wh", "1.234 kWh".
[[nodiscard]] std::string shown_energy(const Reply& mWh);
[[nodiscard]] std::string shown_energy(std::int64_t mWh);
/// "350 ms", "3.2 s", "2 min 5 s", "1 h 20 min".
[[nodiscard]] std::string shown_span(const Reply& ms);
/// "2026-03-01 17:05:09", of this machine's time zone; "at a time nobody knew".
[[nodiscard]] std::string shown_time(const Reply& unix_ms);
/// "wrong crc 30, late 2": the numbers of an object that are not 0, with their names.
[[nodiscard]] std::string shown_counts(const Reply& object);
/// All texts of a list with a comma between.
[[nodiscard]] std::string shown_list(const Reply& list);

}  // namespace bmu

#include "tools/bmuctl/reply.hpp"

#include <array>
#include <cstdio>
#include <ctime>

#include "daemon/core/records/event.hpp"
#include "daemon/shell/status/span_text.hpp"

namespace bmu {

Reply Reply::operator[](std::string_view key) const {
  if (json_ == nullptr || !json_->is_object()) return {};
  const auto found = json_->find(std::string(key));
  return found == json_->end() ? Reply() : Reply(*found);
}

Reply Reply::at(std::size_t index) const {
  return index < size() ? Reply((*json_)[index]) : Reply();
}

std::size_t Reply::size() const {
  return json_ != nullptr && json_->is_array() ? json_->size() : 0;
}

std::vector<std::string> Reply::keys() const {
  std::vector<std::string> keys;
  if (json_ == nullptr || !json_->is_object()) return keys;
  for (const auto& [key, value] : json_->items()) keys.push_back(key);
  return keys;
}

std::optional<std::int64_t> Reply::number() const {
  if (json_ == nullptr || !json_->is_number_integer()) return std::nullopt;
  const bool is_beyond = json_->is_number_unsigned() && json_->get<std::uint64_t>() > std::uint64_t{number_max};
  const std::int64_t number = is_beyond ? number_max + 1 : json_->get<std::int64_t>();
  return number >= -number_max && number <= number_max ? std::optional(number) : std::nullopt;
}

std::string Reply::text() const {
  return json_ != nullptr && json_->is_string() ? json_->get<std::string>() : std::string();
}

std::string shown(const Reply& value, Unit unit) {
  const std::optional<std::int64_t> number = value.number();
  return number ? value_text(unit, *number) : "--";
}

std::string shown_counts(const Reply& object) {
  std::string text;
  for (const std::string& key : object.keys()) {
    const std::int64_t count = object[key].number_or(0);
    if (count != 0) text += (text.empty() ? "" : ", ") + key + " " + std::to_string(count);
  }
  return text;
}

std::string shown_short(std::optional<std::int64_t> value, Unit unit, int decimals) {
  if (!value) return "--";
  const UnitSpec& spec = spec_of(unit);
  double scaled = static_cast<double>(*value) / static_cast<double>(spec.divisor);
  for (int i = 0; i < spec.decimals; ++i) scaled /= 10;
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.*f", decimals, scaled);
  return text.data();
}

std::string shown_energy(const Reply& value) {
  const std::optional<std::int64_t> mWh = value.number();
  return mWh ? shown_energy(*mWh) : shown(value, Unit::mWh);
}

std::string shown_energy(std::int64_t mWh) {
  constexpr std::int64_t mWh_per_kWh = 1'000'000;
  if (mWh >= mWh_per_kWh || mWh <= -mWh_per_kWh) return value_text(Unit::mWh, mWh);
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.1f Wh", static_cast<double>(mWh) / 1000);
  return text.data();
}

std::string shown_span(const Reply& value) {
  const std::optional<std::int64_t> ms = value.number();
  return ms ? span_text_of_ms(*ms) : "--";
}

std::string shown_time(const Reply& value) {
  const std::optional<std::int64_t> ms = value.number();
  const std::time_t seconds = ms.value_or(0) / 1'000;
  std::tm parts{};
  std::array<char, 32> text{};
  if (!ms || ::localtime_r(&seconds, &parts) == nullptr ||
      std::strftime(text.data(), text.size(), "%Y-%m-%d %H:%M:%S", &parts) == 0) {
    return "time unknown";
  }
  return text.data();
}

std::string shown_list(const Reply& list) {
  std::string all;
  for (std::size_t i = 0; i < list.size(); ++i) all += (all.empty() ? "" : ", ") + list.at(i).text();
  return all;
}

}  // namespace bmu

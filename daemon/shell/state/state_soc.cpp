#include "daemon/shell/state/state_soc.hpp"

#include <array>
#include <utility>

#include "daemon/shell/state/state_modules.hpp"
#include "daemon/shell/state/state_parts.hpp"

namespace bmu {

namespace {

using Json = nlohmann::ordered_json;

constexpr const char* cells_key = "cells";
constexpr std::int64_t all_ppm = 1'000'000;
constexpr std::int64_t all_permille = 1'000;
constexpr std::int64_t health_most_ppm = 100'000'000;
constexpr std::size_t numbers_at_first = 3;  // of a cell, in files from before its health was kept
constexpr std::size_t numbers = 7;
constexpr std::int64_t capacity_max_uAs = std::int64_t{1} << 60;

std::string parse_cell(const Json& json, const std::string& place, CellSocRecord& cell) {
  const bool is_whole = json.is_array() && (json.size() == numbers_at_first || json.size() == numbers);
  const auto number = [&](std::size_t at, std::int64_t least, std::int64_t most) {
    return is_whole && at < json.size() ? number_from(json[at], least, most) : std::nullopt;
  };
  const auto soc = number(0, 0, all_ppm);
  const auto sigma = number(1, 0, all_ppm);
  const auto hysteresis = number(2, -all_permille, all_permille);
  if (!soc || !sigma || !hysteresis) {
    return wrong_in_state(place, json, "two numbers from 0 to 1000000, one from -1000 to 1000, and the health's");
  }
  cell = {.soc_ppm = static_cast<std::int32_t>(*soc),
          .sigma_ppm = static_cast<std::int32_t>(*sigma),
          .hysteresis_permille = static_cast<std::int32_t>(*hysteresis)};
  if (json.size() == numbers_at_first) return {};
  std::array<std::int32_t*, numbers - numbers_at_first> health{
      &cell.health.capacity_ppm, &cell.health.capacity_sigma_ppm, &cell.health.resistance_ppm,
      &cell.health.resistance_sigma_ppm};
  for (std::size_t at = 0; at < health.size(); ++at) {
    const auto one = number(numbers_at_first + at, 0, health_most_ppm);
    if (!one) return wrong_in_state(place, json, "the health's four numbers from 0 to 100000000");
    *health[at] = static_cast<std::int32_t>(*one);
  }
  return {};
}

std::string parse_all(const Json& json, SocRecords& records) {
  const auto unix_time_ms = number_from(value_at(json, "unix_time_ms"), 0, unix_time_max_ms);
  if (!unix_time_ms) {
    return wrong_in_state("soc/unix_time_ms", value_at(json, "unix_time_ms"), "milliseconds since 1970, or 0");
  }
  const auto capacity_uAs = number_from(value_at(json, "capacity_uAs"), 1, capacity_max_uAs);
  if (!capacity_uAs) return wrong_in_state("soc/capacity_uAs", value_at(json, "capacity_uAs"), "a charge above 0");
  const auto told_ppm = number_from(value_at(json, "told_ppm"), 0, all_ppm);
  if (!told_ppm) return wrong_in_state("soc/told_ppm", value_at(json, "told_ppm"), "0 to 1000000");
  records.unix_time_ms = *unix_time_ms;
  records.capacity_uAs = *capacity_uAs;
  records.told_ppm = static_cast<std::int32_t>(*told_ppm);
  std::string problem = parse_state_modules(value_at(json, "modules"), "soc/modules", cells_key, parse_cell, records);
  if (!problem.empty()) return problem;
  const Json& is_last = value_at(json, "is_last");  // missing in files from before it was kept: unknown, so false
  if (!is_last.is_null() && !is_last.is_boolean()) return wrong_in_state("soc/is_last", is_last, "true or false");
  records.is_last = is_last.is_boolean() && is_last.get<bool>();
  records.is_kept = true;
  return {};
}

}  // namespace

Json soc_json(const SocRecords& records) {
  if (!records.is_kept) return nullptr;
  Json modules = state_modules_json(records, cells_key, [](const CellSocRecord& cell) {
    const CellHealthRecord& health = cell.health;
    return Json::array({cell.soc_ppm, cell.sigma_ppm, cell.hysteresis_permille, health.capacity_ppm,
                        health.capacity_sigma_ppm, health.resistance_ppm, health.resistance_sigma_ppm});
  });
  return {{"unix_time_ms", records.unix_time_ms},
          {"is_last", records.is_last},
          {"capacity_uAs", records.capacity_uAs},
          {"told_ppm", records.told_ppm},
          {"modules", std::move(modules)}};
}

Result<SocRecords, std::string> parse_soc(const Json& json) {
  return parse_state_part<SocRecords>(json, parse_all);
}

}  // namespace bmu

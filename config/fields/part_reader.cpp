#include "config/fields/part_reader.hpp"

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "config/fields/pack_fields.hpp"
#include "daemon/core/limits/current_prediction.hpp"

namespace bmu {
namespace {

/// A current that must not be more than another one, if both are given.
struct BoundRow {
  std::string_view key;
  std::int32_t CurrentBounds::*own;
  std::string_view other_key;
  std::int32_t CurrentBounds::*other;
};
constexpr std::array peak_rows{
    BoundRow{"discharge_continuous_mA", &CurrentBounds::discharge_continuous_mA, "discharge_peak_mA",
             &CurrentBounds::discharge_peak_mA},
    BoundRow{"charge_continuous_mA", &CurrentBounds::charge_continuous_mA, "charge_peak_mA",
             &CurrentBounds::charge_peak_mA},
};

void check_at_most(std::int32_t own_mA, std::int32_t most_mA, const Place& place, const std::string& whose,
                   ProblemList& problems) {
  if (own_mA == 0 || most_mA == 0 || own_mA <= most_mA || !problems.is_good(place)) return;
  problems.add(place, std::to_string(own_mA), "at most " + whose + ", " + std::to_string(most_mA));
}

void check_peaks(const CurrentBounds& bounds, const Place& place, ProblemList& problems) {
  for (const BoundRow& row : peak_rows) {
    if (!problems.is_good(place.at(row.other_key))) continue;
    check_at_most(bounds.*row.own, bounds.*row.other, place.at(row.key), std::string(row.other_key), problems);
  }
}

/// Checks that the user limits are not more than the pack carries: otherwise one of the two is a mistake.
void check_user(const CoreConfig& core, const Place& root_place, ProblemList& problems) {
  struct Row {
    std::string_view key;
    std::int32_t CurrentBounds::*own;
    std::int32_t CurrentLimitConfig::*most;
  };
  constexpr std::array rows{
      Row{"discharge_continuous_mA", &CurrentBounds::discharge_continuous_mA,
          &CurrentLimitConfig::discharge_continuous_mA},
      Row{"discharge_peak_mA", &CurrentBounds::discharge_peak_mA, &CurrentLimitConfig::discharge_peak_mA},
      Row{"charge_continuous_mA", &CurrentBounds::charge_continuous_mA, &CurrentLimitConfig::charge_continuous_mA},
      Row{"charge_peak_mA", &CurrentBounds::charge_peak_mA, &CurrentLimitConfig::charge_peak_mA},
  };
  const Place place = root_place.at("user_limits");
  for (const Row& row : rows) {
    if (!problems.is_good(root_place.at("current").at(row.key))) continue;
    check_at_most(core.user_limits.*row.own, core.current.*row.most, place.at(row.key),
                  std::string(row.key) + " of current", problems);
  }
  check_peaks(core.user_limits, place, problems);
}

bool has_name(const PartConfig& one, const PartConfig& other) {
  return one.name == other.name;
}

void read_part(const JsonValue& value, const Place& place, CoreConfig& core, ProblemList& problems) {
  if (!is_object(value, place, problems)) return;
  std::vector<std::string_view> keys = keys_of(part_fields());
  const auto bound_keys = keys_of(bound_fields());
  keys.insert(keys.end(), bound_keys.begin(), bound_keys.end());
  check_keys(value, place, keys, problems);
  PartConfig part;
  read_fields(value, place, part_fields(), part, problems);
  read_fields(value, place, bound_fields(), part.most, problems);
  const auto& parts = core.component_limits;
  const bool is_taken =
      std::any_of(parts.begin(), parts.end(), [&part](const PartConfig& other) { return has_name(part, other); });
  if (is_taken && problems.is_good(place.at("name"))) {
    problems.add(place.at("name"), shown(value.at("name")), "a name no other part has");
  }
  const CurrentBounds& most = part.most;
  const bool says_nothing = most.discharge_continuous_mA == 0 && most.discharge_peak_mA == 0 &&
                            most.charge_continuous_mA == 0 && most.charge_peak_mA == 0;
  if (says_nothing && problems.is_good_throughout(place)) problems.add(place, shown(value), "a rated current");
  check_peaks(most, place, problems);
  core.component_limits.push_back(part);
}

void complete_peaks(CurrentBounds& bounds) {
  for (const BoundRow& row : peak_rows) {
    if (bounds.*row.other == 0) bounds.*row.other = bounds.*row.own;
  }
}

/// Checks that a limit that follows predicted voltages falls before they occur. A missing peak is the warning threshold
/// of the current's own limit (pack_defaults.cpp).
void check_ramps(const CoreConfig& core, const Place& root_place, ProblemList& problems) {
  struct Row {
    std::string_view key;
    std::int32_t LimitRampConfig::*fall_mA_per_s;
    std::int32_t CurrentLimitConfig::*continuous_mA;
    std::int32_t CurrentLimitConfig::*peak_mA;
    LimitConfig LimitsConfig::*overcurrent;
  };
  constexpr std::array rows{
      Row{"discharge_fall_A_per_s", &LimitRampConfig::discharge_fall_mA_per_s,
          &CurrentLimitConfig::discharge_continuous_mA, &CurrentLimitConfig::discharge_peak_mA,
          &LimitsConfig::discharge_overcurrent},
      Row{"charge_fall_A_per_s", &LimitRampConfig::charge_fall_mA_per_s, &CurrentLimitConfig::charge_continuous_mA,
          &CurrentLimitConfig::charge_peak_mA, &LimitsConfig::charge_overcurrent}};
  constexpr double mA_per_A = 1e3;
  for (const Row& row : rows) {
    const Place place = root_place.at("limit_ramp").at(row.key);
    const double fall_mA_per_s = core.limit_ramp.*row.fall_mA_per_s;
    const std::int32_t peak_mA = core.current.*row.peak_mA;
    const std::int32_t warn_mA = (core.limits.*row.overcurrent).warn;
    const double most_mA = peak_mA != 0 ? peak_mA : std::max(warn_mA, core.current.*row.continuous_mA);
    const bool are_good = problems.is_good(place) && problems.is_good_throughout(root_place.at("current"));
    if (!are_good || fall_mA_per_s == 0.0 || fall_mA_per_s * forecast_peak_s >= most_mA) continue;
    problems.add(place, number_text(fall_mA_per_s / mA_per_A),
                 "at least " + number_text(most_mA / forecast_peak_s / mA_per_A) +
                     ", so that all that may flow is gone in the " + number_text(forecast_peak_s) +
                     " s that voltages are foreseen");
  }
}

/// Checks the voltage with all cells as high as they get before the pack opens.
void check_full_voltage(const CoreConfig& core, const Place& root_place, ProblemList& problems) {
  const Place place = root_place.at("pack_limits").at("voltage_max_V");
  const Place cell_place = root_place.at("limits").at("cell_overvoltage").at("open_mV");
  const std::int64_t most_mV = core.pack_limits.voltage_max_V * std::int64_t{1'000};
  const auto cells = static_cast<std::int64_t>(cell_count(core));
  const std::int64_t full_mV = core.limits.cell_overvoltage.open / 1'000 * cells;
  const bool are_good = problems.is_good(place) && problems.is_good(cell_place);
  if (!are_good || most_mV == 0 || full_mV <= most_mV) return;
  problems.add(place, std::to_string(core.pack_limits.voltage_max_V),
               "at least " + number_text(static_cast<double>(full_mV) / 1e3) + ", which " + std::to_string(cells) +
                   " cells have at open_mV of cell_overvoltage");
}

}  // namespace

void read_parts(const JsonValue& root, const Place& root_place, CoreConfig& core, ProblemList& problems) {
  const JsonValue* list = find_value(root, root_place, "component_limits", false, problems);
  if (list == nullptr) return;
  const Place place = root_place.at("component_limits");
  if (!list->is_array() || list->size() > parts_max) {
    const std::string found = list->is_array() ? std::to_string(list->size()) + " parts" : shown(*list);
    problems.add(place, found, "a list of at most " + std::to_string(parts_max) + " parts, [{ ... }]");
    return;
  }
  for (std::size_t index = 0; index < list->size(); ++index) {
    read_part((*list)[index], place.at(index), core, problems);
  }
}

void check_bounds(const CoreConfig& core, const Place& root_place, ProblemList& problems) {
  check_full_voltage(core, root_place, problems);
  check_user(core, root_place, problems);
  check_ramps(core, root_place, problems);
  check_at_most(core.current.limp_home_discharge_mA, core.current.discharge_continuous_mA,
                root_place.at("current").at("limp_home_discharge_mA"), "discharge_continuous_mA", problems);
}

void complete_bounds(CoreConfig& core) {
  for (std::size_t part = 0; part < core.component_limits.size(); ++part) {
    complete_peaks(core.component_limits[part].most);
  }
  complete_peaks(core.user_limits);
}

}  // namespace bmu

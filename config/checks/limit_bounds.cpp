#include "config/checks/limit_bounds.hpp"

#include <algorithm>
#include <array>
#include <string>

namespace bmu {
namespace {

/// Divisor that gives the largest error of a voltage with which a sensor is still usable. The limit of the pack's
/// mismatch also decides whether a precharge is plausible.
constexpr std::int64_t voltage_share_max = 10;

std::int64_t full_mV(const CoreConfig& core, std::size_t cells) {
  return std::int64_t{core.limits.cell_overvoltage.open} / 1'000 * static_cast<std::int64_t>(cells);
}
std::size_t smallest_module(const CoreConfig& core) {
  const auto smallest = std::min_element(
      core.modules.begin(), core.modules.end(),
      [](const ModuleConfig& one, const ModuleConfig& other) { return one.cell_count < other.cell_count; });
  return smallest == core.modules.end() ? 0 : smallest->cell_count;
}

/// Upper bound of a fault's threshold, given by other values of the file.
struct BoundRow {
  std::string_view path;                 // of its number, below the root
  LimitConfig LimitsConfig::*limit;      // if missing, its default is valid
  std::int64_t scale;                    // carried counts per unit of the file
  std::array<std::string_view, 2> uses;  // values that the bound depends on
  std::int64_t (*bound)(const CoreConfig&);
  std::string_view reason;
};
using Limits = LimitsConfig;
constexpr std::array bound_rows{
    BoundRow{"limits/pack_voltage_mismatch/open_mV",
             &Limits::pack_voltage_mismatch,
             1,
             {"modules", "limits/cell_overvoltage/open_mV"},
             [](const CoreConfig& core) { return full_mV(core, cell_count(core)) / voltage_share_max; },
             "a tenth of the full pack"},
    BoundRow{"limits/module_voltage_mismatch/open_mV",
             &Limits::module_voltage_mismatch,
             1,
             {"modules", "limits/cell_overvoltage/open_mV"},
             [](const CoreConfig& core) { return full_mV(core, smallest_module(core)) / voltage_share_max; },
             "a tenth of the smallest module when it is full"},
    BoundRow{"limits/cell_imbalance/open_mV",
             &Limits::cell_imbalance,
             1'000,
             {"limits/cell_undervoltage/open_mV", "limits/cell_overvoltage/open_mV"},
             [](const CoreConfig& core) {
               return (std::int64_t{core.limits.cell_overvoltage.open} - core.limits.cell_undervoltage.open) / 1'000 -
                      1;
             },
             "less than the distance from cell_undervoltage to cell_overvoltage, which open before"},
    BoundRow{"limits/temperature_spread/open_dC",
             &Limits::temperature_spread,
             1,
             {"limits/cell_undertemperature/open_dC", "limits/cell_overtemperature/open_dC"},
             [](const CoreConfig& core) {
               return std::int64_t{core.limits.cell_overtemperature.open} - core.limits.cell_undertemperature.open - 1;
             },
             "less than the distance from cell_undertemperature to cell_overtemperature, which open before"},
};

Place place_of(const Place& root, std::string_view path) {
  return {root.file, root.path + "/" + std::string(path)};
}

void check_bound(const PackConfig& pack, const Place& root, const BoundRow& row, ProblemList& problems) {
  const Place place = place_of(root, row.path);
  const LimitConfig& limit = pack.core.limits.*row.limit;
  const bool is_judged = problems.is_good(place) && limit != LimitsConfig{}.*row.limit &&
                         std::all_of(row.uses.begin(), row.uses.end(), [&](std::string_view use) {
                           return problems.is_good_throughout(place_of(root, use));
                         });
  const std::int64_t bound = is_judged ? row.bound(pack.core) : 0;
  // Limits in the wrong order are reported at their own location.
  if (!is_judged || bound < 0 || limit.open / row.scale <= bound) return;
  problems.add(place, std::to_string(limit.open / row.scale),
               "at most " + std::to_string(bound) + ", " + std::string(row.reason));
}

/// A mismatch of current sensors requires a second one.
void check_second_sensor(const PackConfig& pack, const Place& root, ProblemList& problems) {
  const Place place = root.at("limits").at("current_sensors_disagree");
  const bool is_given = pack.core.limits.current_sensors_disagree != never_above;
  const Place sensor = root.at("sensor").at("has_second_current");
  if (!is_given || pack.core.sensor.has_second_current || !problems.is_good_throughout(place) ||
      !problems.is_good(sensor)) {
    return;
  }
  problems.add(place, "a limit", "nothing, as sensor/has_second_current is false");
}

}  // namespace

void check_limit_bounds(const PackConfig& pack, const Place& place, ProblemList& problems) {
  for (const BoundRow& row : bound_rows) check_bound(pack, place, row, problems);
  check_second_sensor(pack, place, problems);
}

}  // namespace bmu

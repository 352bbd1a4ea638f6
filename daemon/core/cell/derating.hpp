// How much of its current a cell may carry in the cold, in the heat, empty and full: what its maker's sheet says in
// tables. Each is a line through a few points, a share of the current in permille over a temperature or a state of
// charge; straight between the points, level beyond the ends.
//
// A table is given whole or not at all. Over temperature it rises and then falls, so that of all cells the coldest or
// the hottest has the smallest share; over the state of charge it only falls (charging) or only rises (discharging).
// The reader of the cell file refuses others (config/cell_file/derating_reader.hpp).
#pragma once

#include <cstddef>
#include <cstdint>

#include "protocol/fixed_vector.hpp"

namespace bmu {

struct DeratingPoint {
  std::int32_t at = 0;              // dC, or permille of charge: rising
  std::int32_t share_permille = 0;  // 0 to 1000

  friend constexpr bool operator==(const DeratingPoint&, const DeratingPoint&) = default;
};

struct DeratingTable {
  static constexpr std::size_t points_max = 16;

  FixedVector<DeratingPoint, points_max> points;  // none: nothing is derated; else two or more

  [[nodiscard]] constexpr bool is_given() const { return points.size() >= 2; }
};

/// The share at a place, rounded down; 1000 of a table that is not given.
[[nodiscard]] std::int32_t share_permille(const DeratingTable& table, std::int32_t at);

/// The smallest share the table has anywhere: what holds while nobody knows where on it the cell is.
[[nodiscard]] std::int32_t smallest_share_permille(const DeratingTable& table);

struct DeratingTables {
  DeratingTable charge_over_temperature;     // dC
  DeratingTable discharge_over_temperature;  // dC
  DeratingTable charge_over_soc;             // permille
  DeratingTable discharge_over_soc;          // permille
};

}  // namespace bmu

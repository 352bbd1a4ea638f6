// Derating of the cell current by cold, heat, low and high SOC, from the tables of the manufacturer's data sheet. Each
// is a line through a few points, a share of the current in permille over a temperature or an SOC; linear between the
// points, constant beyond the ends.
//
// A table is given completely or not at all. Over temperature it rises and then falls, so that of all cells the coldest
// or the hottest has the smallest share; over the SOC it only falls (charging) or only rises (discharging). The reader
// of the cell file rejects others (config/cell_file/derating_reader.hpp).
#pragma once

#include <cstddef>
#include <cstdint>

#include "protocol/fixed_vector.hpp"

namespace bmu {

struct DeratingPoint {
  std::int32_t at = 0;              // dC, or permille of SOC; rising
  std::int32_t share_permille = 0;  // 0 to 1000

  friend constexpr bool operator==(const DeratingPoint&, const DeratingPoint&) = default;
};

struct DeratingTable {
  static constexpr std::size_t points_max = 16;

  FixedVector<DeratingPoint, points_max> points;  // empty: no derating; else two or more

  [[nodiscard]] constexpr bool is_given() const { return points.size() >= 2; }
};

/// Share at a temperature or SOC, rounded down; 1000 without a table.
[[nodiscard]] std::int32_t share_permille(const DeratingTable& table, std::int32_t at);

/// Minimum share of the table: applies while the position of the cell on the table is unknown.
[[nodiscard]] std::int32_t smallest_share_permille(const DeratingTable& table);

struct DeratingTables {
  DeratingTable charge_over_temperature;     // dC
  DeratingTable discharge_over_temperature;  // dC
  DeratingTable charge_over_soc;             // permille
  DeratingTable discharge_over_soc;          // permille
};

}  // namespace bmu

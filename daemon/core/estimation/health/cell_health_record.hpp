// Persistent record of a cell's health (cell_health.hpp).
#pragma once

#include <cstdint>

namespace bmu {

/// In millionths of the cell file's values; 0: unknown.
struct CellHealthRecord {
  std::int32_t capacity_ppm = 0;
  std::int32_t capacity_sigma_ppm = 0;  // one standard deviation, of the rated capacity
  std::int32_t resistance_ppm = 0;      // of the expected one, at 25 C
  std::int32_t resistance_sigma_ppm = 0;

  friend bool operator==(const CellHealthRecord&, const CellHealthRecord&) = default;
};

}  // namespace bmu

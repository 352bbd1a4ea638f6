// What of a cell's health (cell_health.hpp) outlives a process.
#pragma once

#include <cstdint>

namespace bmu {

/// In millionths of what the cell file says; 0: not known.
struct CellHealthRecord {
  std::int32_t capacity_ppm = 0;
  std::int32_t capacity_sigma_ppm = 0;  // one standard deviation, of the rated capacity
  std::int32_t resistance_ppm = 0;      // of the expected one, at 25 C
  std::int32_t resistance_sigma_ppm = 0;

  friend bool operator==(const CellHealthRecord&, const CellHealthRecord&) = default;
};

}  // namespace bmu

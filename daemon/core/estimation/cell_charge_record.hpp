// Persistent record of the charge that the cells lack (cell_charge.hpp): complete, or absent.
#pragma once

#include <array>
#include <cstdint>

#include "protocol/tables/internal_bus.hpp"

namespace bmu {

struct CellChargeRecord {
  std::int64_t missing_uAs = 0;      // until it is full, as of the record's time
  std::int64_t uncertainty_uAs = 0;  // of the differences between cells: the charge since then is the same for all

  friend bool operator==(const CellChargeRecord&, const CellChargeRecord&) = default;
};

struct ModuleChargeRecord {
  std::uint8_t cell_count = 0;  // 0: no such module
  std::uint32_t serial_number = 0;
  std::array<CellChargeRecord, internal_bus::cells_per_module_max> cells{};

  friend bool operator==(const ModuleChargeRecord&, const ModuleChargeRecord&) = default;
};

struct CellChargeRecords {
  std::int64_t unix_time_ms = 0;  // time of these values; 0: there is no record
  std::int64_t capacity_uAs = 0;  // of each cell, by the cell file it was learned with
  std::array<ModuleChargeRecord, internal_bus::node_count_max + 1> modules{};  // by node number

  friend bool operator==(const CellChargeRecords&, const CellChargeRecords&) = default;
};

}  // namespace bmu

// Persistent record of the cells' charge and health (pack_estimate.hpp): of all cells, or absent.
#pragma once

#include <array>
#include <cstdint>

#include "daemon/core/estimation/health/cell_health_record.hpp"
#include "protocol/tables/internal_bus.hpp"

namespace bmu {

struct CellSocRecord {
  std::int32_t soc_ppm = 0;              // 0 to 1'000'000
  std::int32_t sigma_ppm = 0;            // one standard deviation, as SocBegin takes it: SocFilter::model_sigma()
  std::int32_t hysteresis_permille = 0;  // -1000: discharged last, 1000: charged last
  CellHealthRecord health;

  friend bool operator==(const CellSocRecord&, const CellSocRecord&) = default;
};

struct ModuleSocRecord {
  std::uint8_t cell_count = 0;  // 0: no such module
  std::uint32_t serial_number = 0;
  std::array<CellSocRecord, internal_bus::cells_per_module_max> cells{};

  friend bool operator==(const ModuleSocRecord&, const ModuleSocRecord&) = default;
};

struct SocRecords {
  bool is_kept = false;           // false: there is no record, and the other members are not valid
  bool is_last = false;           // of a session that ended with everything open: no charge flowed afterwards
  std::int64_t unix_time_ms = 0;  // time of these values; 0: the wall clock was unknown
  std::int64_t capacity_uAs = 0;  // of each cell, by the cell file it was estimated with
  std::int32_t told_ppm = 0;      // of the pack, as published
  std::array<ModuleSocRecord, internal_bus::node_count_max + 1> modules{};  // by node number

  friend bool operator==(const SocRecords&, const SocRecords&) = default;
};

}  // namespace bmu

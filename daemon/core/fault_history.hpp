// What is remembered of each fault for longer than a process lives: how often, when first and last, who cleared it, and
// the whole pack as it was in the moment the fault was believed.
//
// Times are those of the wall clock, in ms since 1970, 0 while nobody has told it. The shell writes this to disk when
// `generation` of the core's persistent state changes, and hands it back at the next start.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "daemon/core/contactor_sequence.hpp"
#include "daemon/core/fault_memory.hpp"
#include "daemon/core/limits.hpp"

namespace bmu {

/// The pack at one instant; what was not known then has no value.
struct FreezeFrame {
  std::int64_t unix_time_ms = 0;
  std::int64_t value = 0;      // what the fault's row read
  std::int64_t threshold = 0;  // and what it was held against
  Element element;
  Phase phase = Phase::open;
  std::optional<std::int32_t> cell_voltage_min_uV;
  std::optional<std::int32_t> cell_voltage_max_uV;
  std::optional<std::int32_t> cell_voltage_average_uV;
  Element cell_voltage_min_at;
  Element cell_voltage_max_at;
  std::optional<std::int32_t> cell_temperature_min_dC;
  std::optional<std::int32_t> cell_temperature_max_dC;
  std::optional<std::int32_t> cell_temperature_average_dC;
  std::optional<std::int32_t> board_temperature_max_dC;
  std::optional<std::int32_t> pack_voltage_mV;
  std::optional<std::int32_t> link_voltage_mV;
  std::optional<std::int32_t> current_mA;
  std::optional<std::int32_t> soc_permille;
  std::optional<std::int32_t> insulation_Ohm;
  std::int32_t discharge_limit_mA = 0;
  std::int32_t charge_limit_mA = 0;

  friend bool operator==(const FreezeFrame&, const FreezeFrame&) = default;
};

/// Who ended a fault that had latched.
struct ClearRecord {
  std::int64_t unix_time_ms = 0;
  std::uint32_t user_id = 0;
  Authority authority = Authority::user;

  friend bool operator==(const ClearRecord&, const ClearRecord&) = default;
};

struct FaultRecord {
  std::uint32_t count = 0;  // confirmations, over all lives
  std::int64_t first_unix_time_ms = 0;
  std::int64_t last_unix_time_ms = 0;
  bool is_locked = false;  // latched, over a restart too, until it is cleared
  std::optional<ClearRecord> cleared;
  std::optional<FreezeFrame> frame;  // of the last confirmation

  friend bool operator==(const FaultRecord&, const FaultRecord&) = default;
};

/// Whether a fault that is confirmed now stays latched over a restart. `is_in_use`: contactors are commanded closed,
/// and nobody has told the daemon to end.
[[nodiscard]] constexpr bool locks(const FaultRow& row, bool is_in_use) {
  return row.latch != Latch::none && (row.outlives == Outlives::always || is_in_use);
}

using FaultRecords = std::array<FaultRecord, fault_count>;

}  // namespace bmu

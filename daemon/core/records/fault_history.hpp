// Persistent record of each fault: how often it was confirmed, when first and last, the user that cleared it, and the
// state of the whole pack at the instant of its confirmation.
//
// Times are those of the wall clock, in ms since 1970, 0 while it is unknown. The shell writes the records to disk when
// `persistent_generation()` of the core changes, and restores them at the next start.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "daemon/core/records/freeze_frame.hpp"

namespace bmu {

/// Clearing of a latched fault.
struct ClearRecord {
  std::int64_t unix_time_ms = 0;
  std::uint32_t user_id = 0;
  Authority authority = Authority::user;

  friend bool operator==(const ClearRecord&, const ClearRecord&) = default;
};

struct FaultRecord {
  std::uint32_t count = 0;  // confirmations in all sessions
  std::int64_t first_unix_time_ms = 0;
  std::int64_t last_unix_time_ms = 0;
  bool is_locked = false;  // latched, also over a restart, until it is cleared
  std::optional<ClearRecord> cleared;
  std::optional<FreezeFrame> frame;  // of the last confirmation

  friend bool operator==(const FaultRecord&, const FaultRecord&) = default;
};

/// Whether a fault that is confirmed now stays latched over a restart. `is_in_use`: contactors are commanded closed,
/// and the daemon is not shutting down.
[[nodiscard]] constexpr bool locks(const FaultRow& row, bool is_in_use) {
  return row.latch != Latch::none && (row.outlives == Outlives::always || is_in_use);
}

using FaultRecords = std::array<FaultRecord, fault_count>;

}  // namespace bmu

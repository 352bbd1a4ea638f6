// What is remembered of each fault for longer than a process lives: how often, when first and last, who cleared it, and
// the whole pack as it was in the moment the fault was believed.
//
// Times are those of the wall clock, in ms since 1970, 0 while nobody has told it. The shell writes this to disk when
// `generation` of the core's persistent state changes, and hands it back at the next start.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "daemon/core/records/freeze_frame.hpp"

namespace bmu {

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

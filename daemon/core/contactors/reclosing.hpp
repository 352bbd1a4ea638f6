// Effect of an opening on the next closing: the delay before it, whether the close request is kept, and how long a
// request waits for a pack that may not close. Also the permission that each phase needs, and the pack voltage that a
// precharge may be measured against.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>

#include "daemon/core/contactors/contactor_sequence.hpp"
#include "daemon/core/contactors/permission.hpp"
#include "daemon/core/types/measured.hpp"
#include "daemon/core/types/opening_cause.hpp"

namespace bmu {

/// Lockout after an opening for a reason or a failed precharge: nothing closes for this long.
inline constexpr Duration reclose_lockout = 10s;
/// Delay after an opening because the request ended: the precharge resistor has to cool, and a key that is cycled
/// repeatedly must not wear the contacts.
inline constexpr Duration reclose_pause = 2s;
/// After two openings by end of the request within this, the next closing waits as long as after a fault: the key is
/// cycled.
inline constexpr Duration oscillation_window = 20s;
/// Timeout of a close request while the pack may not close. With a fault confirmed a request does not wait at all: one
/// from before the fault was cleared must not close a pack that a person may be working on.
inline constexpr Duration close_patience = 5s;

/// The contactors close one after the other.
[[nodiscard]] constexpr bool is_closing(Phase phase) {
  return phase == Phase::main_negative || phase == Phase::precharge || phase == Phase::main_positive;
}

/// The permission that a phase needs: all of it to start, less while the contactors close one after the other, least
/// once they are closed.
[[nodiscard]] constexpr bool is_permitted(const Permission& permission, Phase phase) {
  if (phase == Phase::open) return permission.may_close;
  return is_closing(phase) ? permission.may_go_on : permission.may_stay_closed;
}

/// Whether the close request is kept. After an opening for a reason only a new request closes.
[[nodiscard]] constexpr bool keeps_wish(OpeningCause cause) {
  return cause == OpeningCause::request_over || cause == OpeningCause::precharge_retry;
}

/// Delay before the next closing after an opening at `now`. `request_over_at`: the previous opening by end of the
/// request, zero if there was none. `cool_down`: between two attempts of a precharge.
[[nodiscard]] constexpr Duration reclose_wait(OpeningCause cause, TimePoint now, TimePoint request_over_at,
                                              Duration cool_down) {
  if (cause == OpeningCause::precharge_retry) return cool_down;
  const bool is_played_with = request_over_at != TimePoint{} && now - request_over_at <= oscillation_window;
  return cause == OpeningCause::request_over && !is_played_with ? reclose_pause : reclose_lockout;
}

[[nodiscard]] constexpr bool has_fault(std::span<const Blocker> blockers) {
  return std::find(blockers.begin(), blockers.end(), Blocker::fault) != blockers.end();
}

/// Whether a request that has waited for so long has expired. Between two precharge attempts it waits for the next one.
[[nodiscard]] constexpr bool is_vain(std::span<const Blocker> blockers, Duration waited, bool is_retrying) {
  return has_fault(blockers) || (!is_retrying && waited >= close_patience);
}

/// The sum of the cells and the sensor's pack voltage differ by less than `allowed_mV`. A sensor that has lost its
/// ground measures two voltages that agree with each other, but with no cell.
[[nodiscard]] constexpr bool voltages_agree(const Measured<std::int32_t>& sum_mV, const Measured<std::int32_t>& pack_mV,
                                            std::int32_t allowed_mV) {
  const std::int64_t apart_mV = std::int64_t{sum_mV.value} - pack_mV.value;
  return sum_mV.is_valid() && pack_mV.is_valid() && apart_mV < allowed_mV && apart_mV > -std::int64_t{allowed_mV};
}

}  // namespace bmu

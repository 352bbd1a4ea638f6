// What an opening means for the next closing: how long nothing closes, whether the wish outlives it, and how long a
// wish waits for a pack that may not close. Also which permission each phase needs, and which pack voltage a precharge
// may be measured against.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>

#include "daemon/core/contactors/contactor_sequence.hpp"
#include "daemon/core/contactors/permission.hpp"
#include "daemon/core/types/measured.hpp"
#include "daemon/core/types/opening_cause.hpp"

namespace bmu {

/// After an opening by fault or a failed precharge nothing closes for this long.
inline constexpr Duration reclose_lockout = 10s;
/// And after any other opening: the precharge resistor has to cool, and a key that is played with must not wear
/// contacts.
inline constexpr Duration reclose_pause = 2s;
/// Two openings by request within this, and the next closing waits as long as after a fault: a key that is played with.
inline constexpr Duration oscillation_window = 20s;
/// A wish to close waits this long for the pack to become ready. With a fault present it does not wait at all: what was
/// wished before a fault was cleared must not close a pack that somebody may have his hands in.
inline constexpr Duration close_patience = 5s;

/// The contactors close one by one.
[[nodiscard]] constexpr bool is_closing(Phase phase) {
  return phase == Phase::main_negative || phase == Phase::precharge || phase == Phase::main_positive;
}

/// The permission that a phase needs: all of it to begin, less while the contactors close one by one, least once they
/// are closed.
[[nodiscard]] constexpr bool is_permitted(const Permission& permission, Phase phase) {
  if (phase == Phase::open) return permission.may_close;
  return is_closing(phase) ? permission.may_go_on : permission.may_stay_closed;
}

/// What opened for a reason closes for a new wish only.
[[nodiscard]] constexpr bool keeps_wish(OpeningCause cause) {
  return cause == OpeningCause::request_over || cause == OpeningCause::precharge_retry;
}

/// How long nothing closes after an opening at `now`. `request_over_at`: the last opening before because nobody asked
/// any more, zero if there was none. `cool_down`: between two tries of a precharge.
[[nodiscard]] constexpr Duration reclose_wait(OpeningCause cause, TimePoint now, TimePoint request_over_at,
                                              Duration cool_down) {
  if (cause == OpeningCause::precharge_retry) return cool_down;
  const bool is_played_with = request_over_at != TimePoint{} && now - request_over_at <= oscillation_window;
  return cause == OpeningCause::request_over && !is_played_with ? reclose_pause : reclose_lockout;
}

[[nodiscard]] constexpr bool has_fault(std::span<const Blocker> blockers) {
  return std::find(blockers.begin(), blockers.end(), Blocker::fault) != blockers.end();
}

/// Whether a wish that has waited for so long is given up. Between two tries of a precharge it waits for the next.
[[nodiscard]] constexpr bool is_vain(std::span<const Blocker> blockers, Duration waited, bool is_retrying) {
  return has_fault(blockers) || (!is_retrying && waited >= close_patience);
}

/// The sum of the cells and the sensor's pack voltage are less than so far apart. A sensor that has lost its ground
/// shows two voltages that agree with each other, and with no cell.
[[nodiscard]] constexpr bool voltages_agree(const Measured<std::int32_t>& sum_mV, const Measured<std::int32_t>& pack_mV,
                                            std::int32_t allowed_mV) {
  const std::int64_t apart_mV = std::int64_t{sum_mV.value} - pack_mV.value;
  return sum_mV.is_valid() && pack_mV.is_valid() && apart_mV < allowed_mV && apart_mV > -std::int64_t{allowed_mV};
}

}  // namespace bmu

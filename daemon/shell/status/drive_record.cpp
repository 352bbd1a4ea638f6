#include "daemon/shell/status/drive_record.hpp"

namespace bmu {

void DriveRecorder::update(const Core& core) {
  const Phase phase = core.sequence().phase;
  const bool is_closed = phase == Phase::closed || phase == Phase::ramp_down || phase == Phase::breaking;
  const ChargeState& charge = core.charge();
  if (is_closed && !record_.is_running) {
    record_ = {.has_run = true, .closed_at = core.sequence().entered_at};
    at_closing_ = charge;
  }
  // The decision that opens still counts: its sums are those of the last instant with closed contactors.
  if (is_closed || record_.is_running) {
    record_.lasted = core.decided_at() - record_.closed_at;
    record_.charge_used_uAs = charge.flowed_uAs - at_closing_.flowed_uAs;
    record_.energy_out_mWh = charge.energy_out_mWh - at_closing_.energy_out_mWh;
    record_.energy_in_mWh = charge.energy_in_mWh - at_closing_.energy_in_mWh;
  }
  record_.is_running = is_closed;
}

}  // namespace bmu

// The one state the pack is in for those outside, and what each dialect of the traction-pack messages calls it.
//
// Everything is derived here, from what was decided; nobody else translates states.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "daemon/core/contactors/contactor_sequence.hpp"
#include "daemon/core/contactors/permission.hpp"
#include "daemon/core/contactors/rest_mode.hpp"
#include "daemon/core/faults/fault_memory.hpp"

namespace bmu {

enum class PackMode : std::uint8_t {
  fault,        // open, or opening, because something is wrong
  resting,      // asleep after an undervoltage
  open,         // and well
  closing,      // on the way to closed
  driving,      // closed for the vehicle
  charging,     // closed for a charger
  charge_only,  // closed for a charger although discharging is forbidden
  opening,      // the current is asked to zero
  closed,       // neither vehicle nor charger asks any more, not yet opening
};
inline constexpr std::size_t pack_mode_count = 9;

[[nodiscard]] std::string_view to_text(PackMode mode);

/// All that the states of every dialect are made of.
struct ModeInputs {
  Phase phase = Phase::open;
  RestPhase rest = RestPhase::awake;
  bool has_fault = false;    // one that opens, whoever asks, is present
  bool fault_opens = false;  // one that opens for who asks now (opens_for)
  bool may_discharge = false;
  bool vehicle_on = false;
  bool charger_connected = false;
  std::int32_t current_mA = 0;  // 0 if not known
  ContactorOutputs outputs;
  bool has_relay_fault = false;  // the tests of the last closing, or of the last opening, failed
};

[[nodiscard]] PackMode pack_mode(const ModeInputs& in);

/// 622h b0 of the dialect `iha`: 0 fault; 1 charger connected, closed; 2 vehicle on, closed; 3 vehicle off, closed; 4
/// vehicle off, open.
[[nodiscard]] std::uint8_t iha_state(PackMode mode);
/// Of the dialect `original`: 0 to 4 and 8 to 13, 8 and above while plugged in.
[[nodiscard]] std::uint8_t original_state(PackMode mode, const ModeInputs& in);
/// Of the dialect `elithion`: bits. .0 fault, .1 to .3 contactors K1 (main positive), K2 (precharge), K3 (main
/// negative) on, .4 relay fault. It tells contactors and no modes, so its bits follow from what modes are made of.
[[nodiscard]] std::uint8_t elithion_state(const ModeInputs& in);
/// A fault of the contactors is present: what `has_relay_fault` means.
[[nodiscard]] bool has_relay_fault(const FaultMemory& faults);

/// What 622h carries beside the state in the dialect `elithion`. Level faults and warnings end with their cause; the
/// stored code stays with a fault that latches until it is cleared.
struct ElithionFaults {
  std::uint8_t stored_code = 0;   // 0 none, 1 to 19: of the latest fault that has one
  std::uint8_t level_faults = 0;  // those whose cause is there, codes 1 to 8 as bits 0 to 7
  std::uint8_t warnings =
      0;  // .0 low voltage .1 high voltage .2 charge .3 discharge current .4 cold .5 hot .6 SOH .7 isolation
};
[[nodiscard]] ElithionFaults elithion_faults(const FaultMemory& faults);

/// Up to two trouble codes of the dialect `iha`, the lowest first. 622h has room for two of three: with all of them 2
/// is left out, as a pack that is too cold has more resistance than it should and says so with 3.
struct TroubleCodes {
  std::uint8_t first = 0;
  std::uint8_t second = 0;
};
[[nodiscard]] TroubleCodes trouble_codes(const FaultMemory& faults);

}  // namespace bmu

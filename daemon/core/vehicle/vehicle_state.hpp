// Mode of the pack as reported to other systems, and its state in each dialect of the traction-pack messages.
//
// All reported states are derived here from the decisions; no other part translates states.
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
  fault,        // open, or opening, because of a fault
  resting,      // asleep after an undervoltage
  open,         // without a fault that opens
  closing,      // on the way to closed
  driving,      // closed for the vehicle
  charging,     // closed for a charger
  charge_only,  // closed for a charger although discharging is inhibited
  opening,      // zero current is requested, or the current is being broken
  closed,       // vehicle off and no charger connected, not yet opening
};
inline constexpr std::size_t pack_mode_count = 9;

[[nodiscard]] std::string_view to_text(PackMode mode);

/// Inputs of the states of every dialect.
struct ModeInputs {
  Phase phase = Phase::open;
  RestPhase rest = RestPhase::awake;
  bool has_fault = false;    // a fault that opens, for whichever request, is confirmed
  bool fault_opens = false;  // a fault that opens for the present request is confirmed (opens_for)
  bool may_discharge = false;
  bool vehicle_on = false;
  bool charger_connected = false;
  std::int32_t current_mA = 0;  // 0 if unknown
  ContactorOutputs outputs;
  bool has_relay_fault = false;  // a test of the last closing, or of the last opening, failed
};

[[nodiscard]] PackMode pack_mode(const ModeInputs& in);

/// 622h b0 of the dialect `iha`: 0 fault; 1 charger connected, closed; 2 vehicle on, closed; 3 vehicle off, closed; 4
/// vehicle off, open.
[[nodiscard]] std::uint8_t iha_state(PackMode mode);
/// Of the dialect `original`: 0 to 4 and 8 to 13, 8 and above while plugged in.
[[nodiscard]] std::uint8_t original_state(PackMode mode, const ModeInputs& in);
/// Of the dialect `elithion`: bits. .0 fault, .1 to .3 contactors K1 (main positive), K2 (precharge), K3 (main
/// negative) on, .4 relay fault. It reports contactors and no modes, so its bits follow from the inputs of the modes.
[[nodiscard]] std::uint8_t elithion_state(const ModeInputs& in);
/// A fault of the contactors is confirmed: the value of `has_relay_fault`.
[[nodiscard]] bool has_relay_fault(const FaultMemory& faults);

/// Content of 622h beside the state in the dialect `elithion`. Level faults and warnings end with their cause; the
/// stored code of a fault that latches stays until it is cleared.
struct ElithionFaults {
  std::uint8_t stored_code = 0;   // 0 none, 1 to 19: of the latest fault that has one
  std::uint8_t level_faults = 0;  // faults with a cause that is present, codes 1 to 8 as bits 0 to 7
  std::uint8_t warnings =
      0;  // .0 low voltage .1 high voltage .2 charge .3 discharge current .4 cold .5 hot .6 SOH .7 isolation
};
[[nodiscard]] ElithionFaults elithion_faults(const FaultMemory& faults);

/// Up to two trouble codes of the dialect `iha`, the lowest first. 622h has room for two of three: with all of them 2
/// is omitted, as a pack that is too cold has a higher resistance and reports 3 for it.
struct TroubleCodes {
  std::uint8_t first = 0;
  std::uint8_t second = 0;
};
[[nodiscard]] TroubleCodes trouble_codes(const FaultMemory& faults);

}  // namespace bmu

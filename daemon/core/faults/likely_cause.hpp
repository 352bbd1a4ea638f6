// A key of the pack file that is wrong explains some faults better than a part that has failed: which, by what else is
// seen. It decides nothing; it is for the texts of faults (event.hpp).
#pragma once

#include <cstdint>
#include <optional>

#include "daemon/core/faults/fault_table.hpp"
#include "daemon/core/plausibility/link_rise.hpp"
#include "daemon/core/types/core_config.hpp"

namespace bmu {

enum class WrongKey : std::uint8_t {
  none,
  invert_current,             // charged too much, and no charger is plugged in
  invert_current_by_cells,    // the same key: the cells move against the current
  invert_current_by_step,     // the same: they moved against the latest step of it
  invert_current_by_charger,  // the same: what the charger gives is said to leave the pack
  second_is_reversed,         // the two sensors see the same current with opposite signs
  both_signs,                 // invert_current and second_is_reversed: and the cells move against the first
  little_endian,              // the sensor's results are out of range
  buses,                      // frames of the internal bus on the vehicle's
  link_decay,                 // the link falls, and more slowly than the pack file says
  precharge_min,              // the link is seen to charge, and faster than the pack file says
  precharge_energy,           // it charges, until the resistor has had what the pack file says that it bears
  precharge_timeout,          // it charges, and more slowly than the pack file says
};

/// Of the keys of the link and of the precharge, how the link moves, the key as it is, and a value for it, perhaps one
/// that the pack file does not take.
struct LikelyCause {
  WrongKey key = WrongKey::none;
  Duration measured{};  // its time constant; with precharge_min, after how long it followed the pack
  Duration found{};     // with precharge_energy: of precharge_timeout, as would_do
  Duration would_do{};
  std::int32_t found_J = 0;  // precharge_energy
  std::int32_t would_do_J = 0;
};

/// What else is seen: what is no longer seen of a fault that stays, as it was in the moment of the fault.
struct SeenBeside {
  bool is_without_charger = false;  // by a fresh word
  bool do_cells_move_against_current = false;
  bool do_cells_oppose_steps = false;  // StepAnswer: a later one counts more than an earlier one
  bool do_cells_follow_steps = false;
  bool is_charger_mirrored = false;       // it gives as much as the sensor sees leave the pack
  bool are_sensors_mirrored = false;      // both see the same current, with opposite signs
  bool are_results_out_of_range = false;  // the last that the sensor sent was, a moment ago
  bool are_buses_swapped = false;         // BusWatch::has_misplaced_frames
  std::optional<Duration> link_time_constant{};
  std::optional<Duration> link_followed_after{};  // in the last precharge
  std::optional<SlowRise> slow_rise{};            // likewise
};

[[nodiscard]] LikelyCause likely_cause(FaultId fault, const SeenBeside& seen, const ContactorConfig& contactors);

}  // namespace bmu

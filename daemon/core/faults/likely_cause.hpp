// Likely cause of a fault. A wrong key of the pack file explains some faults better than a failed component; other
// observations indicate which key. Informative only: for the texts of faults (event.hpp).
#pragma once

#include <cstdint>
#include <optional>

#include "daemon/core/faults/fault_table.hpp"
#include "daemon/core/plausibility/link_rise.hpp"
#include "daemon/core/types/core_config.hpp"

namespace bmu {

enum class WrongKey : std::uint8_t {
  none,
  invert_current,             // charge current too high or not allowed, and no charger is plugged in
  invert_current_by_cells,    // same key: the cell voltages move against the current
  invert_current_by_step,     // same key: the cell voltages moved against the latest current step
  invert_current_by_charger,  // same key: the sensor measures the charger's current as leaving the pack
  second_is_reversed,         // both sensors measure the same current with opposite signs
  both_signs,                 // invert_current and second_is_reversed: the cells also move against the first
  little_endian,              // the sensor's results are out of range
  buses,                      // frames of the internal bus are received on the vehicle's
  link_decay,                 // the DC link discharges, but more slowly than the pack file states
  precharge_min,              // the DC link charges measurably, but faster than the pack file states
  precharge_energy,           // the DC link charges until the resistor has absorbed its rated energy in the pack file
  precharge_timeout,          // the DC link charges, but more slowly than the pack file states
};

/// For the keys of the DC link and of the precharge: the measured behaviour of the DC link, the configured value, and a
/// value that would be sufficient, which the pack file may not accept.
struct LikelyCause {
  WrongKey key = WrongKey::none;
  Duration measured{};  // time constant of the DC link; with precharge_min, time until it followed the pack
  Duration found{};     // configured value; with precharge_energy, of precharge_timeout, as is would_do
  Duration would_do{};
  std::int32_t found_J = 0;  // precharge_energy
  std::int32_t would_do_J = 0;
};

/// Other observations. While a fault persists, those that can no longer be made are as of the instant of the fault.
struct SeenBeside {
  bool is_without_charger = false;  // by a fresh status of the inputs
  bool do_cells_move_against_current = false;
  bool do_cells_oppose_steps = false;  // StepAnswer of the latest step
  bool do_cells_follow_steps = false;
  bool is_charger_mirrored = false;       // the sensor measures the charger's current as leaving the pack
  bool are_sensors_mirrored = false;      // both measure the same current, with opposite signs
  bool are_results_out_of_range = false;  // the last result that was rejected, at most 1 s ago, was out of range
  bool are_buses_swapped = false;         // BusWatch::has_misplaced_frames
  std::optional<Duration> link_time_constant{};
  std::optional<Duration> link_followed_after{};  // in the last precharge
  std::optional<SlowRise> slow_rise{};            // in the last precharge
};

[[nodiscard]] LikelyCause likely_cause(FaultId fault, const SeenBeside& seen, const ContactorConfig& contactors);

}  // namespace bmu

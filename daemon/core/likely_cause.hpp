// A key of the pack file that is wrong explains some faults better than a part that has failed: which, by what else is
// seen. It decides nothing; it is for the texts of faults (event.hpp).
#pragma once

#include <cstdint>
#include <optional>

#include "daemon/core/core_config.hpp"
#include "daemon/core/fault_table.hpp"

namespace bmu {

enum class WrongKey : std::uint8_t {
  none,
  invert_current,           // charged too much, and no charger is plugged in
  invert_current_by_cells,  // the same key: the cells move against the current
  little_endian,            // the sensor's results are out of range
  buses,                    // frames of the internal bus on the vehicle's
  link_decay,               // the link falls, and more slowly than the pack file says
};

struct LikelyCause {
  WrongKey key = WrongKey::none;
  Duration time_constant{};  // of the link; with link_decay
  Duration found{};          // likewise: the key as it is
  Duration would_do{};       // likewise: a value for it, perhaps more than it takes
};

/// What else is seen.
struct SeenBeside {
  bool is_without_charger = false;  // by a fresh word
  bool do_cells_move_against_current = false;
  bool are_results_out_of_range = false;  // the last that the sensor sent was, a moment ago
  bool are_buses_swapped = false;         // BusWatch::has_misplaced_frames
  std::optional<Duration> link_time_constant{};
};

[[nodiscard]] LikelyCause likely_cause(FaultId fault, const SeenBeside& seen, const ContactorConfig& contactors);

}  // namespace bmu

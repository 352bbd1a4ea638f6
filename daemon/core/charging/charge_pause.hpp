// Short pause of the charger, always at the same state of charge: the current step down and the one up again show each
// cell's resistance under the same conditions, charge by charge, also for a pack that is charged with a constant
// current and driven too little to learn from. Only if the pack file has it (soc/resistance_pause_permille).
//
// The pause starts when the published state of charge passes the configured one upwards, if a charging current of C/20
// has flowed for `pause_after` before. One pause has two steps, and a resistance requires three or more, many more
// where a step is small compared with the noise of the voltages: while that of any cell is unknown the pause repeats,
// each time after `pause_repeat_after` of charging, at most `pauses_max` times and not further than
// `pause_span_permille` above the configured charge. Then there is none until the charge has been `pause_span_permille`
// below. A pause ends after its time; any interruption of a steady charge restarts the wait for the next.
//
// Cost: some comparisons a tick.
#pragma once

#include <cstdint>
#include <optional>

#include "daemon/core/types/core_config.hpp"
#include "daemon/core/types/measured.hpp"
#include "protocol/fields.hpp"

namespace bmu {

/// Minimum time of charging before a pause: the polarisation of the previous step has decayed.
inline constexpr Duration pause_after = 60s;
/// Minimum time between two pauses: a step is compared with the seconds before it, not with rest, and 2 % of the
/// previous step remain (resistance_pass_time_s). The limit of the charge has risen to four fifths by then (LimitRamp).
/// All pauses end within 67 permille at 1C, 34 at half of it.
inline constexpr Duration pause_repeat_after = 8s;
inline constexpr std::int32_t pause_span_permille = 50;
/// Steps of 11 mV require some 20 pauses (tests/scenario/accept/res1_resistance_soft_cells.scn): each gives the
/// resistance to a fifth, and their mean has to be within 4 % (ResistanceTracker). A cell with steps below the noise
/// does not delay a charge for longer: thirty pauses of 5 s are 150 s.
inline constexpr std::uint8_t pauses_max = 30;

struct ChargePauseInputs {
  TimePoint now{};
  bool is_closed = false;
  std::optional<std::int32_t> soc_permille{};  // published
  Measured<std::int32_t> current_mA;           // usable now, or not valid
  bool is_resistance_known = false;            // of each cell
};

class ChargePause {
 public:
  void init(const CoreConfig& config);
  /// Once a tick.
  void update(const ChargePauseInputs& in);
  [[nodiscard]] bool is_pausing() const { return is_pausing_; }

 private:
  [[nodiscard]] bool is_charging(const ChargePauseInputs& in) const;
  [[nodiscard]] bool is_due(const ChargePauseInputs& in) const;

  std::int32_t at_permille_ = 0;  // 0: never
  Duration lasts_{};
  std::int32_t charging_mA_ = 0;
  std::uint8_t pauses_left_ = 0;  // remaining, until the charge has been below again
  bool is_first_ = false;         // of these: due also if the resistance is known
  bool is_pausing_ = false;
  TimePoint charging_since_{};  // zero: it is not charging
  TimePoint paused_at_{};
  BMU_FIELDS(skipped(at_permille_), skipped(lasts_), skipped(charging_mA_), pauses_left_, is_first_, is_pausing_,
             charging_since_, paused_at_)
};

}  // namespace bmu

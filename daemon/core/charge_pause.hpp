// A brief pause of the charger, always at the same state of charge: the step down and the one up again show each cell's
// resistance under the same conditions, charge by charge, also of a pack that is charged with a current that never
// moves and driven too little to learn from. Only where the pack file asks for it (soc/resistance_pause_permille).
//
// The pause comes when what is told of the charge passes the configured one upwards, if a charging current of a
// twentieth of an hour's rate has flowed for `pause_after` before; once, until the charge has been
// `pause_again_permille` below. It ends after its time, whatever happens; anything that is not a steady charge ends the
// wait for it.
//
// Cost: some comparisons a tick.
#pragma once

#include <cstdint>
#include <optional>

#include "daemon/core/core_config.hpp"
#include "daemon/core/measured.hpp"
#include "protocol/fields.hpp"

namespace bmu {

/// So long it has charged, for what the step before left in the cells to fade.
inline constexpr Duration pause_after = 60s;
inline constexpr std::int32_t pause_again_permille = 50;

struct ChargePauseInputs {
  TimePoint now{};
  bool is_closed = false;
  std::optional<std::int32_t> soc_permille{};  // as it is told
  Measured<std::int32_t> current_mA;           // usable now, or not valid
};

class ChargePause {
 public:
  void init(const CoreConfig& config);
  /// Once a tick.
  void update(const ChargePauseInputs& in);
  [[nodiscard]] bool is_pausing() const { return is_pausing_; }

 private:
  [[nodiscard]] bool is_charging(const ChargePauseInputs& in) const;

  std::int32_t at_permille_ = 0;  // 0: never
  Duration lasts_{};
  std::int32_t charging_mA_ = 0;
  bool is_armed_ = false;
  bool is_pausing_ = false;
  TimePoint charging_since_{};  // zero: it does not charge
  TimePoint paused_at_{};
  BMU_FIELDS(skipped(at_permille_), skipped(lasts_), skipped(charging_mA_), is_armed_, is_pausing_, charging_since_,
             paused_at_)
};

}  // namespace bmu

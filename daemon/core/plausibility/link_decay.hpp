// Time constant of the discharge of the DC link after an opening, from the first of its voltages after the contactors
// had their time to open and the last within ten minutes that was at least half of it. For a DC link that a resistor
// discharges, U = U0 exp(-t / tau). At lower voltages the offset of the sensor would dominate: the residual reading of
// a discharged DC link resembles one that hardly falls.
#pragma once

#include <optional>

#include "daemon/core/types/core_config.hpp"
#include "daemon/core/types/measured.hpp"
#include "protocol/fields.hpp"

namespace bmu {

class LinkDecay {
 public:
  /// Once a tick. `open_since`: since when all contactors are commanded open; zero: they are not, and the voltages are
  /// discarded.
  void update(TimePoint open_since, const Measured<std::int32_t>& link_mV, Duration settle);

  /// No value before a second has elapsed, or if the DC link has fallen by no more than 0.2 %, the possible error of a
  /// sensor. Once its voltage has halved, and after ten minutes, the value is kept.
  [[nodiscard]] std::optional<Duration> time_constant() const;

 private:
  Measured<std::int32_t> first_mV_;
  Measured<std::int32_t> last_mV_;
  BMU_FIELDS(first_mV_, last_mV_)
};

/// Value of link_decay at which a DC link with this time constant is no longer at pack voltage: the time until it
/// leaves the pack voltage, and half as much again, in whole seconds. It may exceed the maximum of the pack file
/// (link_decay_max).
[[nodiscard]] Duration link_decay_that_would_do(Duration time_constant, const ContactorConfig& config);

}  // namespace bmu

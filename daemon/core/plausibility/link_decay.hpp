// How fast the DC link discharges after an opening: its time constant, from the first of its voltages after the
// contactors had their time to open and the last within ten minutes that was at least half of it. Of a link that a
// resistor discharges, U = U0 exp(-t / tau). Further down the sensor's offset would count for more and more: what is
// left of an empty link looks like one that hardly falls.
#pragma once

#include <optional>

#include "daemon/core/types/core_config.hpp"
#include "daemon/core/types/measured.hpp"
#include "protocol/fields.hpp"

namespace bmu {

class LinkDecay {
 public:
  /// Once a tick. `open_since`: since when everything is commanded open; zero: it is not, and what was seen is
  /// forgotten.
  void update(TimePoint open_since, const Measured<std::int32_t>& link_mV, Duration settle);

  /// Nothing before a second has passed, and of a link that has not fallen by more than a sensor may be off: 0.2 %.
  /// Once the link has halved, and after ten minutes, it stays what it was.
  [[nodiscard]] std::optional<Duration> time_constant() const;

 private:
  Measured<std::int32_t> first_mV_;
  Measured<std::int32_t> last_mV_;
  BMU_FIELDS(first_mV_, last_mV_)
};

/// A link_decay after which a link with this time constant no longer follows the pack: the time it takes to leave the
/// pack's voltage, and half as much again, in whole seconds. It may be more than the pack file takes (link_decay_max).
[[nodiscard]] Duration link_decay_that_would_do(Duration time_constant, const ContactorConfig& config);

}  // namespace bmu

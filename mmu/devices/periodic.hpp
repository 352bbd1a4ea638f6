// Something that happens every so often. The deadline advances by the period, never from "now": nothing drifts, and a
// caller who comes late finds one deadline due, not a burst of all he missed.
#pragma once

#include "protocol/time.hpp"

namespace bmu {

class Periodic {
 public:
  constexpr Periodic(TimePoint first, Duration period) : next_(first), period_(period) {}

  [[nodiscard]] constexpr bool is_due(TimePoint now) const { return now >= next_; }
  /// True when due; the deadline then is the next one after `now` on the same grid.
  constexpr bool take(TimePoint now) {
    if (!is_due(now)) return false;
    next_ += period_ * ((now - next_) / period_ + 1);
    return true;
  }

 private:
  TimePoint next_;
  Duration period_;
};

}  // namespace bmu

// Periodic deadline. It advances by the period, never from "now": it does not drift, and a late caller finds one
// deadline due, not a burst of all that were missed.
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

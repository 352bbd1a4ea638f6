// From the edges of the insulation monitor's output to the signal that ir155.hpp reads: for whoever captures it.
//
//        rise      fall            rise      fall            rise
//          +---------+               +---------+               +--
//   -------+         +---------------+         +---------------+
//          |<- high->|               |
//          |<------- a period ------>|        frequency and duty cycle, once a period
//
// A period is believed only between two rises with one fall between them. An edge that was lost, whether the kernel
// says so or two alike follow each other, spoils its period and no other. How old a signal is counts from the end of
// its last whole period, so that edges without rhythm do not keep an old one alive: one lost edge is borne, chatter is
// silence. A period longer than `edge_silence_max` is none. Pure, no allocation; some additions an edge.
#pragma once

#include <optional>

#include "protocol/ir155.hpp"
#include "protocol/time.hpp"

namespace bmu::ir155 {

struct Edge {
  TimePoint at;  // of the same clock as all others, and as `now`
  bool is_rising = false;
  bool is_after_loss = false;  // between this and the one before there were others, which nobody has
};

class Capture {
 public:
  /// Nothing has been seen but a level.
  void begin(bool is_high);
  /// In the order they happened.
  void observe(const Edge& edge);
  /// `since_edge` is rounded up to whole microseconds, and not below 0.
  [[nodiscard]] Pwm pwm(TimePoint now) const;

 private:
  void take_period(TimePoint rose_at, TimePoint fell_at, TimePoint ended_at);

  Pwm last_;  // without since_edge
  TimePoint ended_at_{};
  // Of the period that is not over.
  std::optional<TimePoint> rose_at_;
  std::optional<TimePoint> fell_at_;
};

}  // namespace bmu::ir155

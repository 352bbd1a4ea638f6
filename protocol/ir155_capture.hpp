// Capture of the insulation monitor's output: from its edges to the signal that ir155.hpp decodes.
//
//        rise      fall            rise      fall            rise
//          +---------+               +---------+               +--
//   -------+         +---------------+         +---------------+
//          |<- high->|               |
//          |<------- a period ------>|        frequency and duty cycle, once a period
//
// A period is accepted only between two rises with one fall between them. A lost edge, reported by the kernel or
// detected by two equal edges in sequence, invalidates its period and no other. The age of a signal counts from the end
// of its last complete period, so that irregular edges do not keep an old one valid: one lost edge is tolerated,
// chatter counts as no signal. A period longer than `edge_silence_max` is rejected. Pure, no allocation; some additions
// per edge.
#pragma once

#include <optional>

#include "protocol/ir155.hpp"
#include "protocol/time.hpp"

namespace bmu::ir155 {

struct Edge {
  TimePoint at;  // of the same clock for all edges and for `now`
  bool is_rising = false;
  bool is_after_loss = false;  // edges between the previous one and this one were lost
};

class Capture {
 public:
  /// Resets the capture; only the present level is known.
  void begin(bool is_high);
  /// Precondition: edges in the order of their times.
  void observe(const Edge& edge);
  /// `since_edge` is rounded up to whole microseconds, and is at least 0.
  [[nodiscard]] Pwm pwm(TimePoint now) const;

 private:
  void take_period(TimePoint rose_at, TimePoint fell_at, TimePoint ended_at);

  Pwm last_;  // without since_edge
  TimePoint ended_at_{};
  // Edges of the period in progress.
  std::optional<TimePoint> rose_at_;
  std::optional<TimePoint> fell_at_;
};

}  // namespace bmu::ir155

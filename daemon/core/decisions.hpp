// Output of the core after a tick: frames, one contactor command, events to log, and the time of the next tick.
#pragma once

#include "daemon/core/records/event_queue.hpp"
#include "daemon/core/types/contactors.hpp"
#include "daemon/core/types/observation.hpp"
#include "protocol/fixed_vector.hpp"
#include "protocol/frame.hpp"

namespace bmu {

struct OutgoingFrame {
  Port port = Port::internal;
  CanFrame frame;
};

struct Decisions {
  FixedVector<OutgoingFrame, 24> frames;  // in the order of sending: the safety command first
  ContactorOutputs outputs;
  TickEvents events;    // the oldest not yet returned; others wait for the next tick
  TimePoint wake_at{};  // next tick; an observation may request an earlier one
  /// After the shut_down command: the feedback confirms open contactors and no module is left commanded to bleed, or
  /// the timeout for that has elapsed.
  bool is_shut_down = false;
};

}  // namespace bmu

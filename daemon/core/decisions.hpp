// What the core says after a tick: frames, one contactor command, what to log, when to wake it next.
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
  TickEvents events;    // the oldest not yet told; more wait for the next tick
  TimePoint wake_at{};  // next tick; an observation may ask for an earlier one
  /// After the shut_down command: every auxiliary contact is open, or there is no fresh word of it any more.
  bool is_shut_down = false;
};

}  // namespace bmu

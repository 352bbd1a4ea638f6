#include "tests/support/sim_run.hpp"

#include <stdexcept>
#include <string>
#include <utility>

namespace bmu::test {

SimRun::SimRun(const CoreConfig& config, Scenario scenario)
    : core_(config, start), simulator_(simulator_config(config), std::move(scenario), start) {
  observe(PortChanged{Port::internal, true});
  observe(PortChanged{Port::vehicle, true});
}

void SimRun::observe(const ObservedThing& what) {
  if (core_.observe({now_, what}) == Urgency::decide_now) decide();
}

void SimRun::decide() {
  const Decisions decisions = core_.decide(now_);
  wake_at_ = decisions.wake_at;
  for (const Event& event : decisions.events) events_.push_back(event);
  for (const OutgoingFrame& out : decisions.frames) {
    if (out.port == Port::internal) simulator_.observe(out.frame, now_);
    if (out.port == Port::internal) echoes_.push_back(out.frame);
  }
}

void SimRun::run_to(double seconds) {
  const TimePoint end = start + std::chrono::duration_cast<Duration>(std::chrono::duration<double>(seconds));
  while (now_ < end) {
    now_ += 1ms;
    for (const CanFrame& frame : std::exchange(echoes_, {})) observe(FrameEchoed{Port::internal, frame});
    for (const SentFrame& sent : simulator_.advance(now_)) observe(FrameReceived{Port::internal, sent.frame});
    if (now_ >= wake_at_) decide();
  }
}

void SimRun::apply(std::string_view event) {
  const auto result = simulator_.apply(event);
  if (!result) throw std::runtime_error("scenario event '" + std::string(event) + "' is not understood");
}

void SimRun::give(Command command) {
  observe(CommandGiven{command});
}

double SimRun::first(EventId id) const {
  for (const Event& event : events_) {
    if (event.id == id) return to_s(event.at - start);
  }
  return -1.0;
}

}  // namespace bmu::test

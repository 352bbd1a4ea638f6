// Which call of the control loop misbehaves in a daemon under test: what a test sets, and failing_calls.cpp reads.
#pragma once

#include <cstdint>

namespace bmu::test {

enum class FailingCall : std::int64_t {
  none,
  wait,                  // epoll_wait fails
  wait_returns_at_once,  // epoll_wait returns without an event, again and again
  timer,                 // timerfd_settime fails
};

}  // namespace bmu::test

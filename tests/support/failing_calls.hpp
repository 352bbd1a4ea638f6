// Selection of the control loop's call that misbehaves in a daemon under test: set by a test, read by
// failing_calls.cpp.
#pragma once

#include <cstdint>

namespace bmu::test {

enum class FailingCall : std::int64_t {
  none,
  wait,                  // epoll_wait fails
  wait_returns_at_once,  // epoll_wait always returns at once, without an event
  timer,                 // timerfd_settime fails
  wait_hangs,            // the next epoll_wait does not return; the library then chooses `wait_is_held`
  wait_is_held,          // it returns once another number is selected
};

/// The n-th request for memory from now on, counted from 1, fails; then the library selects `none` again.
constexpr std::int64_t memory_request(std::int64_t n) {
  return 1'000'000 + n;
}
/// The n-th request for memory from now on and all after it fail.
constexpr std::int64_t memory_requests_from(std::int64_t n) {
  return 2'000'000 + n;
}

/// The n-th thread that the control loop starts from now on, counted from 1, is refused; then the library chooses
/// `none` again.
constexpr std::int64_t thread_start(std::int64_t n) {
  return 3'000'000 + n;
}

}  // namespace bmu::test

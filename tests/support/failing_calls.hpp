// Which call of the control loop misbehaves in a daemon under test: what a test sets, and failing_calls.cpp reads.
#pragma once

#include <cstdint>

namespace bmu::test {

enum class FailingCall : std::int64_t {
  none,
  wait,                  // epoll_wait fails
  wait_returns_at_once,  // epoll_wait returns without an event, again and again
  timer,                 // timerfd_settime fails
  wait_hangs,            // the next epoll_wait does not return; the library then chooses `wait_is_held`
  wait_is_held,          // it returns once another word is chosen
};

/// The n-th request for memory from now on, counted from 1, gets none; then the library chooses `none` again.
constexpr std::int64_t memory_request(std::int64_t n) {
  return 1'000'000 + n;
}
/// Neither the n-th request for memory from now on nor any after it gets one.
constexpr std::int64_t memory_requests_from(std::int64_t n) {
  return 2'000'000 + n;
}

/// The n-th thread that the control loop starts from now on, counted from 1, is refused; then the library chooses
/// `none` again.
constexpr std::int64_t thread_start(std::int64_t n) {
  return 3'000'000 + n;
}

}  // namespace bmu::test

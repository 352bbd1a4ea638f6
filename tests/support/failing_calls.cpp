// Loaded before the C library into a daemon under test: the word in the file named by BMUD_TEST_FAILING_CALLS chooses
// which call of the control loop misbehaves (FailingCall). Only the main thread's calls, since only the control loop is
// meant.
#include "tests/support/failing_calls.hpp"

#include <cerrno>

#include <sys/epoll.h>
#include <sys/syscall.h>
#include <sys/timerfd.h>
#include <unistd.h>

#include "tests/support/preload_word.hpp"

namespace {

using bmu::test::FailingCall;

bool misbehaves(FailingCall call) {
  static const volatile std::int64_t* const chosen = bmu::test::preload_word("BMUD_TEST_FAILING_CALLS");
  return *chosen == static_cast<std::int64_t>(call) && ::syscall(SYS_gettid) == ::getpid();
}

int fail() {
  errno = EIO;
  return -1;
}

}  // namespace

// Both return -1 for an error, as the system call does, and set errno.
extern "C" int epoll_wait(int epoll, epoll_event* events, int events_max, int timeout_ms) {
  if (misbehaves(FailingCall::wait)) return fail();
  if (misbehaves(FailingCall::wait_returns_at_once)) timeout_ms = 0;
  return static_cast<int>(::syscall(SYS_epoll_pwait, epoll, events, events_max, timeout_ms, nullptr, 0));
}

extern "C" int timerfd_settime(int fd, int flags, const itimerspec* wanted, itimerspec* before) noexcept {
  if (misbehaves(FailingCall::timer)) return fail();
  return static_cast<int>(::syscall(SYS_timerfd_settime, fd, flags, wanted, before));
}

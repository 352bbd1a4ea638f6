// Loaded before the C library into a daemon under test: the number in the file named by BMUD_TEST_FAILING_CALLS selects
// the call of the control loop that misbehaves (FailingCall), its request for memory that fails, or its thread start
// that is refused. Only calls of the main thread are affected, since only the control loop is under test.
#include "tests/support/failing_calls.hpp"

#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <ctime>

#include <dlfcn.h>
#include <pthread.h>
#include <sys/epoll.h>
#include <sys/syscall.h>
#include <sys/timerfd.h>
#include <unistd.h>

#include "tests/support/preload_word.hpp"

namespace {

using bmu::test::FailingCall;

// Requests for memory before it has been found are never those of the control loop.
volatile std::int64_t* chosen = nullptr;

[[gnu::constructor]] void find_chosen() {
  chosen = bmu::test::preload_word("BMUD_TEST_FAILING_CALLS");
}

bool is_main_thread() {
  return ::syscall(SYS_gettid) == ::getpid();
}

bool misbehaves(FailingCall call) {
  return chosen != nullptr && *chosen == static_cast<std::int64_t>(call) && is_main_thread();
}

/// Called once by each request for memory.
bool lacks_memory() {
  using bmu::test::memory_request;
  using bmu::test::memory_requests_from;
  static std::int64_t counted_for = 0;
  static std::int64_t requests = 0;
  const std::int64_t word = chosen != nullptr ? *chosen : 0;
  if (word < memory_request(0) || word >= bmu::test::thread_start(0) || !is_main_thread()) return false;
  if (counted_for != word) requests = 0;
  counted_for = word;
  ++requests;
  if (word >= memory_requests_from(0)) return requests >= word - memory_requests_from(0);
  if (requests < word - memory_request(0)) return false;
  *chosen = static_cast<std::int64_t>(FailingCall::none);
  counted_for = 0;
  return true;
}

/// Called once for each thread that is started.
bool is_thread_refused() {
  using bmu::test::thread_start;
  static std::int64_t counted_for = 0;
  static std::int64_t starts = 0;
  const std::int64_t word = chosen != nullptr ? *chosen : 0;
  if (word < thread_start(0) || !is_main_thread()) return false;
  if (counted_for != word) starts = 0;
  counted_for = word;
  if (++starts < word - thread_start(0)) return false;
  *chosen = static_cast<std::int64_t>(FailingCall::none);
  counted_for = 0;
  return true;
}

void* no_memory() {
  errno = ENOMEM;
  return nullptr;
}

int fail() {
  errno = EIO;
  return -1;
}

/// Holds only the main thread, until the test selects another number.
void hold_if_chosen() {
  if (misbehaves(FailingCall::wait_hangs)) *chosen = static_cast<std::int64_t>(FailingCall::wait_is_held);
  constexpr timespec pause{.tv_sec = 0, .tv_nsec = 1'000'000};
  while (misbehaves(FailingCall::wait_is_held)) static_cast<void>(::nanosleep(&pause, nullptr));
}

}  // namespace

// The C library's own functions, by the names under which it has them beside those replaced here.
// NOLINTBEGIN(bugprone-reserved-identifier,readability-identifier-naming)
extern "C" void* __libc_malloc(std::size_t size);
extern "C" void* __libc_calloc(std::size_t count, std::size_t size);
extern "C" void* __libc_realloc(void* before, std::size_t size);
// NOLINTEND(bugprone-reserved-identifier,readability-identifier-naming)

extern "C" void* malloc(std::size_t size) noexcept {
  return lacks_memory() ? no_memory() : __libc_malloc(size);
}

extern "C" void* calloc(std::size_t count, std::size_t size) noexcept {
  return lacks_memory() ? no_memory() : __libc_calloc(count, size);
}

extern "C" void* realloc(void* before, std::size_t size) noexcept {
  return lacks_memory() ? no_memory() : __libc_realloc(before, size);
}

extern "C" int pthread_create(pthread_t* thread, const pthread_attr_t* attributes, void* (*run)(void*),
                              void* argument) noexcept {
  if (is_thread_refused()) return EAGAIN;
  using Create = int (*)(pthread_t*, const pthread_attr_t*, void* (*)(void*), void*);
  static const auto create = reinterpret_cast<Create>(::dlsym(RTLD_NEXT, "pthread_create"));
  return create(thread, attributes, run, argument);
}

// Both return -1 for an error, as the system call does, and set errno.
extern "C" int epoll_wait(int epoll, epoll_event* events, int events_max, int timeout_ms) {
  if (misbehaves(FailingCall::wait)) return fail();
  hold_if_chosen();
  if (misbehaves(FailingCall::wait_returns_at_once)) timeout_ms = 0;
  return static_cast<int>(::syscall(SYS_epoll_pwait, epoll, events, events_max, timeout_ms, nullptr, 0));
}

extern "C" int timerfd_settime(int fd, int flags, const itimerspec* wanted, itimerspec* before) noexcept {
  if (misbehaves(FailingCall::timer)) return fail();
  return static_cast<int>(::syscall(SYS_timerfd_settime, fd, flags, wanted, before));
}

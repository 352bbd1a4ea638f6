// Loaded before the C library into a daemon under test: CLOCK_BOOTTIME is ahead by as many milliseconds as the number
// in the file named by BMUD_TEST_SLEPT, and so are timers of that clock; all other clocks and timers are unchanged.
// This is the state after a machine has slept.
#include <array>
#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <ctime>

#include <sys/syscall.h>
#include <sys/timerfd.h>
#include <unistd.h>

#include "tests/support/preload_word.hpp"

namespace {

const volatile std::int64_t* slept_ms() {
  static const volatile std::int64_t* const place = bmu::test::preload_word("BMUD_TEST_SLEPT");
  return place;
}

void add_ms(timespec& time, std::int64_t ms) {
  const std::int64_t ns = time.tv_nsec + ms % 1000 * 1'000'000;
  const std::int64_t carry = ns < 0 ? -1 : ns / 1'000'000'000;
  time.tv_sec += ms / 1000 + carry;
  time.tv_nsec = ns - carry * 1'000'000'000;
}

// By descriptor. A closed one leaves its mark to the next with its number, which timerfd_create then sets again.
std::array<std::atomic<bool>, 256> is_of_boottime;

}  // namespace

extern "C" int timerfd_create(clockid_t clock, int flags) noexcept {
  const long fd = ::syscall(SYS_timerfd_create, clock, flags);
  if (fd >= static_cast<long>(is_of_boottime.size())) std::abort();
  if (fd >= 0) is_of_boottime[static_cast<std::size_t>(fd)] = clock == CLOCK_BOOTTIME;
  return static_cast<int>(fd);
}

extern "C" int timerfd_settime(int fd, int flags, const itimerspec* wanted, itimerspec* before) noexcept {
  itimerspec when = *wanted;
  if ((flags & TFD_TIMER_ABSTIME) != 0 && is_of_boottime.at(static_cast<std::size_t>(fd))) {
    add_ms(when.it_value, -*slept_ms());
    // A time in the past fires at once; 0 would switch the timer off.
    if (when.it_value.tv_sec < 0) when.it_value = {.tv_sec = 0, .tv_nsec = 1};
  }
  return static_cast<int>(::syscall(SYS_timerfd_settime, fd, flags, &when, before));
}

// Declared noexcept by the C library.
extern "C" int clock_gettime(clockid_t clock, timespec* now) noexcept {
  const long result = ::syscall(SYS_clock_gettime, clock, now);
  if (result == 0 && clock == CLOCK_BOOTTIME) add_ms(*now, *slept_ms());
  return static_cast<int>(result);
}

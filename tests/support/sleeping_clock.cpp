// Loaded before the C library into a daemon under test: CLOCK_BOOTTIME is ahead by as many milliseconds as the file
// named in BMUD_TEST_SLEPT says (eight bytes, as this machine writes them), all other clocks are as they are. So it is
// after a machine has slept.
#include <cstdint>
#include <cstdlib>
#include <ctime>

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace {

const volatile std::int64_t* slept_ms() {
  static const volatile std::int64_t* const place = []() -> const volatile std::int64_t* {
    const char* file = std::getenv("BMUD_TEST_SLEPT");
    const int fd = file != nullptr ? ::open(file, O_RDONLY | O_CLOEXEC) : -1;
    if (fd < 0) std::abort();
    void* mapped = ::mmap(nullptr, sizeof(std::int64_t), PROT_READ, MAP_SHARED, fd, 0);
    ::close(fd);
    if (mapped == MAP_FAILED) std::abort();
    return static_cast<const volatile std::int64_t*>(mapped);
  }
  ();
  return place;
}

}  // namespace

// The C library declares it so.
extern "C" int clock_gettime(clockid_t clock, timespec* now) noexcept {
  const long result = ::syscall(SYS_clock_gettime, clock, now);
  if (result == 0 && clock == CLOCK_BOOTTIME) {
    const std::int64_t ms = *slept_ms();
    now->tv_sec += ms / 1000;
    now->tv_nsec += ms % 1000 * 1'000'000;
    if (now->tv_nsec >= 1'000'000'000) {
      ++now->tv_sec;
      now->tv_nsec -= 1'000'000'000;
    }
  }
  return static_cast<int>(result);
}

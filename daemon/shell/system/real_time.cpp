#include "daemon/shell/system/real_time.hpp"

#include <cerrno>
#include <string>

#include <malloc.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>

namespace bmu {

namespace {

// Stack of each thread. Locked memory is occupied in full: with the usual 8 MiB each, the stacks of a few threads would
// take more than everything else together.
constexpr std::size_t thread_stack_bytes = std::size_t{512} * 1024;
// Reserve of the heap, and the step by which it grows.
constexpr int heap_reserve_bytes = 2 * 1024 * 1024;

/// Keeps memory of the heap that was allocated once, and reserves some in advance. A request to the kernel for memory
/// waits while any thread of the process is busy with one of its own; on a busy machine that may take an ordinary
/// thread a tenth of a second.
void keep_memory() {
  ::mallopt(M_MMAP_MAX, 0);
  ::mallopt(M_TRIM_THRESHOLD, -1);
  ::mallopt(M_TOP_PAD, heap_reserve_bytes);
}

}  // namespace

void prepare_real_time(const RealTimeWishes& wishes) {
  if (!wishes.lock_memory) return;
  keep_memory();
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  pthread_attr_setstacksize(&attributes, thread_stack_bytes);
  pthread_setattr_default_np(&attributes);
  pthread_attr_destroy(&attributes);
}

Result<void, OsError> enter_real_time(const RealTimeWishes& wishes) {
  if (wishes.lock_memory && ::mlockall(MCL_CURRENT | MCL_FUTURE) != 0) {
    return failure(OsError{.code = errno, .what = "lock memory (--lock-memory needs LimitMEMLOCK=infinity)"});
  }
  if (wishes.priority == 0) return {};
  sched_param parameters{};
  parameters.sched_priority = wishes.priority;
  // Threads that this one starts later are ordinary ones again.
  if (::sched_setscheduler(0, SCHED_FIFO | SCHED_RESET_ON_FORK, &parameters) != 0) {
    const std::string wanted = std::to_string(wishes.priority);
    return failure(OsError{.code = errno,
                           .what = "take real-time priority " + wanted + " (--realtime-priority needs LimitRTPRIO=" +
                                   wanted + " or more, and a service manager that does not forbid it)"});
  }
  return {};
}

}  // namespace bmu

#include "daemon/shell/system/real_time.hpp"

#include <cerrno>
#include <string>

#include <malloc.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>

namespace bmu {

namespace {

// Locked memory is memory: with the usual 8 MiB each, the stacks of a few threads would take more than all else
// together.
constexpr std::size_t thread_stack_bytes = std::size_t{512} * 1024;
// What the heap has in reserve, and takes at a time.
constexpr int heap_reserve_bytes = 2 * 1024 * 1024;

/// Memory once had is kept, and had in advance. Whoever asks the system for some waits while any thread of the process
/// is busy with its own; on a machine that is busy an ordinary thread may be so for a tenth of a second.
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

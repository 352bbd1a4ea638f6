// The control loop ahead of what else the machine does: its thread scheduled before all ordinary ones, and the
// process's memory never on a disk. Both are wishes of who runs the daemon. Nothing's safety depends on them: a loop
// that is late opens.
//
//   prepare_real_time(wishes)   before any thread is started: their stacks will be locked, too, and are made small
//   enter_real_time(wishes)     in the loop's thread, when everything has been made: what is there is locked, and all
//   that comes
//
// Threads that write to disks stay ordinary ones, whether they were started before or will be.
#pragma once

#include "daemon/shell/system/os_error.hpp"
#include "protocol/result.hpp"

namespace bmu {

struct RealTimeWishes {
  /// SCHED_FIFO, 1 to 99; 0: as everybody. Those of the kernel's interrupt threads are at 50.
  int priority = 0;
  bool lock_memory = false;
};

/// Needs no right.
void prepare_real_time(const RealTimeWishes& wishes);

/// Needs RLIMIT_RTPRIO and RLIMIT_MEMLOCK, or the capabilities CAP_SYS_NICE and CAP_IPC_LOCK. The error says which of
/// them was missing; then the other wish may have been fulfilled.
[[nodiscard]] Result<void, OsError> enter_real_time(const RealTimeWishes& wishes);

}  // namespace bmu

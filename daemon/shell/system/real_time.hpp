// Scheduling of the control loop ahead of everything else on the machine: its thread before all ordinary ones, and the
// memory of the process never on a disk. Both are options of the operator. Safety does not depend on them: a loop that
// is late opens.
//
//   prepare_real_time(...)   before any thread is started: their stacks will be locked, too, and are made small
//   enter_real_time(...)     in the thread of the loop, when everything has been made: locks all memory that exists and
//                            all that follows
//
// Threads that write to disks stay ordinary ones, whether they were started before or will be.
#pragma once

#include "daemon/shell/system/os_error.hpp"
#include "protocol/result.hpp"

namespace bmu {

struct RealTimeWishes {
  /// SCHED_FIFO, 1 to 99; 0: ordinary scheduling. The interrupt threads of the kernel have 50.
  int priority = 0;
  bool lock_memory = false;
};

/// Needs no privilege.
void prepare_real_time(const RealTimeWishes& wishes);

/// Needs RLIMIT_RTPRIO and RLIMIT_MEMLOCK, or the capabilities CAP_SYS_NICE and CAP_IPC_LOCK. The error names the
/// missing one; the other option may then be in effect.
[[nodiscard]] Result<void, OsError> enter_real_time(const RealTimeWishes& wishes);

}  // namespace bmu

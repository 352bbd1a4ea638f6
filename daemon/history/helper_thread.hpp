// Helper threads beside the control loop, which write to disks, monitor devices and read pack files: their names, and
// their end, since a disk that does not respond must not keep the daemon from ending.
#pragma once

#include <cstddef>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>

#include <pthread.h>

#include "protocol/result.hpp"
#include "protocol/time.hpp"

namespace bmu {

/// Maximum size of a thread name in the kernel, with the terminating zero.
inline constexpr std::size_t thread_name_size_max = 16;

/// A thread that executes `run` under `name`, which `top -H`, `ps -L` and debuggers show: "bmud-" and its task. The
/// error: the errno value with which the system refuses the thread; nothing is executed then.
template <std::size_t Size, class Run>
[[nodiscard]] Result<std::thread, int> named_thread(const char (&name)[Size], Run run) {
  static_assert(Size <= thread_name_size_max);
  try {
    return std::thread([&name, run = std::move(run)] {
      static_cast<void>(::pthread_setname_np(::pthread_self(), name));  // cannot fail: a short name for its own thread
      run();
    });
  } catch (const std::system_error& refused) {
    return failure(refused.code().value());
  }
}

/// Joins a thread that has ended or is about to return (`has_ended`). Otherwise it hangs in a disk access and is
/// detached: all that it needs has to be its own or shared with it.
inline void join_or_leave(std::thread& thread, bool has_ended) {
  if (has_ended) {
    thread.join();
  } else {
    thread.detach();
  }
}

/// Requests a thread to end, and detaches it if it has not ended after `at_most`. `shared` is the state of both
/// threads, under `mutex`: `has_to_end` requests the end, and the thread clears `is_running` at last; `changed` signals
/// both.
template <class Shared>
void end_or_leave(std::thread& thread, Shared& shared, Duration at_most) {
  if (!thread.joinable()) return;
  std::unique_lock lock(shared.mutex);
  shared.has_to_end = true;
  shared.changed.notify_all();
  const bool has_ended = shared.changed.wait_for(lock, at_most, [&shared] { return !shared.is_running; });
  lock.unlock();
  join_or_leave(thread, has_ended);
}

}  // namespace bmu

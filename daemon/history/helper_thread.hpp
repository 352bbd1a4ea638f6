// Threads beside the control loop, which write to disks, look after devices and read pack files: their names, and their
// end, since a disk that does not answer must not keep a daemon from ending.
#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>

#include <pthread.h>

#include "protocol/result.hpp"
#include "protocol/time.hpp"

namespace bmu {

/// So many characters, and the zero at their end, has the kernel room for.
inline constexpr std::size_t thread_name_size_max = 16;

/// A thread that runs `run` under `name`, which `top -H`, `ps -L` and debuggers show: "bmud-" and what it does. The
/// error: the errno value with which the system refuses a thread; nothing runs then.
template <std::size_t Size, class Run>
[[nodiscard]] Result<std::thread, int> named_thread(const char (&name)[Size], Run run) {
  static_assert(Size <= thread_name_size_max);
  try {
    return std::thread([&name, run = std::move(run)] {
      static_cast<void>(::pthread_setname_np(::pthread_self(), name));  // cannot fail: it is short enough, and its own
      run();
    });
  } catch (const std::system_error& refused) {
    return failure(refused.code().value());
  }
}

/// Starts a thread that executes `shared->run()`, for end_or_leave(): `is_running` is true from before its first
/// statement. The error: the errno value with which the system refuses a thread; nothing runs then, and `is_running` is
/// false.
template <std::size_t Size, class Shared>
[[nodiscard]] Result<void, int> start_helper(std::thread& thread, const char (&name)[Size],
                                             const std::shared_ptr<Shared>& shared) {
  shared->is_running = true;
  auto started = named_thread(name, [shared] { shared->run(); });
  if (!started) {
    shared->is_running = false;
    return failure(started.error());
  }
  thread = std::move(*started);
  return {};
}

/// `has_ended`: it is done, or about to return. If not, it hangs in a disk: it is left behind, and what it needs has to
/// be its own or shared with it.
inline void join_or_leave(std::thread& thread, bool has_ended) {
  if (has_ended) {
    thread.join();
  } else {
    thread.detach();
  }
}

/// Tells a thread to end, and leaves it behind if it has not after so long. `shared` is what both have: under `mutex`
/// it is told by `has_to_end`, and says at last that it no longer `is_running`; both of them by `changed`.
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

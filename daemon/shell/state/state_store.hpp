// Saves the persistent state of the core in a file, and monitors disk space and memory: on a thread of its own, since a
// disk may take seconds and the control loop must not wait.
//
// Only the latest state waits to be written; one that is offered during a write replaces the waiting one. A write that
// fails is retried. Errors are reported as OwnHealth, which the loop passes to the core when it changes.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "daemon/core/records/persistent_state.hpp"
#include "daemon/core/types/observation.hpp"
#include "daemon/shell/state/state_file.hpp"
#include "daemon/shell/system/resource_watch.hpp"
#include "protocol/time.hpp"

namespace bmu {

struct StateStoreOptions {
  std::string path;  // empty: nothing is saved, and only the memory is monitored
  Duration retry = 5s;
  Duration look_every = 10s;  // check period of disk and memory
  ResourceLimits limits;
};

/// Result of reading at the start.
struct StateFound {
  FileFound found = FileFound::nothing;
  std::optional<PersistentState> state;  // for Core::restore
  std::size_t unknown_names = 0;
  std::string charges_problem;
  std::string soc_problem;
  std::string problems;  // errors of rejected files
};

class StateStore {
 public:
  /// Reads the file; starts no thread. The error: the folder does not exist.
  [[nodiscard]] static Result<std::unique_ptr<StateStore>, OsError> open(const StateStoreOptions& options);
  StateStore(const StateStore&) = delete;
  StateStore& operator=(const StateStore&) = delete;
  /// Ends the thread; one that hangs in a disk access is detached after half a second.
  ~StateStore();

  [[nodiscard]] const StateFound& found() const { return found_; }
  /// Prepares the next session in this process with this state: found() is the result of a restart after it had been
  /// written, whether the disk has accepted it yet, or there is a file at all, or not. It is offered to be written.
  void carry_over(const PersistentState& state);
  /// Starts the thread. Precondition: prepare_signals(), because the thread inherits its mask.
  /// The error: the system refuses the thread; nothing is written then.
  [[nodiscard]] Result<void, OsError> start();

  /// Takes a copy to be written. Never waits: false if the thread holds its mutex (momentarily only); offer it again at
  /// the next tick. Without a file the copy is dropped.
  [[nodiscard]] bool offer(const PersistentState& state);
  /// Without `store_unreadable`, which concerns the start only.
  [[nodiscard]] OwnHealth health() const;
  /// Waits until everything that was offered is written, at most `at_most`. False: it is not.
  [[nodiscard]] bool flush(Duration at_most);

  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] std::uint64_t writes() const;
  /// Of the last write; "" if it succeeded. Never waits: returns the previous one while the thread holds its mutex.
  [[nodiscard]] std::string last_error() const;

 private:
  struct Shared;

  explicit StateStore(const StateStoreOptions& options);
  void read();
  [[nodiscard]] Result<void, std::string> take(std::string_view text);

  std::string path_;
  StateFound found_;
  std::shared_ptr<Shared> shared_;  // shared with the thread, which may outlive this object
  std::thread thread_;
  mutable std::string last_error_;
};

}  // namespace bmu

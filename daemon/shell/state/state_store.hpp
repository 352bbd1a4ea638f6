// Keeps the core's persistent state in a file, and an eye on the room that is left: on a thread of its own, since a
// disk may take seconds and the control loop has none.
//
// Only the latest state waits to be written; one that comes while a write is under way replaces the one that waits. A
// write that fails is tried again. What is wrong is told as OwnHealth, which the loop passes to the core when it
// changes.
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
  std::string path;  // empty: nothing is kept, and only the memory is watched
  Duration retry = 5s;
  Duration look_every = 10s;  // at disk and memory
  ResourceLimits limits;
};

/// What was found at start.
struct StateFound {
  FileFound found = FileFound::nothing;
  std::optional<PersistentState> state;  // for Core::restore
  std::size_t unknown_names = 0;
  std::string charges_problem;
  std::string soc_problem;
  std::string problems;  // of files that were refused
};

class StateStore {
 public:
  /// Reads the file; no thread yet. The error: the folder is not there.
  [[nodiscard]] static Result<std::unique_ptr<StateStore>, OsError> open(const StateStoreOptions& options);
  StateStore(const StateStore&) = delete;
  StateStore& operator=(const StateStore&) = delete;
  /// Ends the thread; one that hangs in a disk is given up after half a second.
  ~StateStore();

  [[nodiscard]] const StateFound& found() const { return found_; }
  /// The next life begins in this process, with this state: found() is what a restart would have found after it had
  /// been written, whether the disk has taken it yet, or there is a file at all, or not. It is offered to be written.
  void carry_over(const PersistentState& state);
  /// Starts the thread. After prepare_signals(), whose mask it inherits.
  void start();

  /// Takes a copy to be written. Never waits: false if the thread holds its lock just now (it does so for moments
  /// only); offer it again at the next tick. Without a file it is taken and forgotten.
  [[nodiscard]] bool offer(const PersistentState& state);
  /// Without `store_unreadable`, which is a matter of the start.
  [[nodiscard]] OwnHealth health() const;
  /// Waits until everything that was offered is written, at most so long. False: it is not.
  [[nodiscard]] bool flush(Duration at_most);

  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] std::uint64_t writes() const;
  /// Of the last write; "" if it went well. Never waits: the one before while the thread holds its lock.
  [[nodiscard]] std::string last_error() const;

 private:
  struct Shared;

  explicit StateStore(const StateStoreOptions& options);
  void read();
  [[nodiscard]] Result<void, std::string> take(std::string_view text);

  std::string path_;
  StateFound found_;
  std::shared_ptr<Shared> shared_;  // the thread's, too: it may outlive us
  std::thread thread_;
  mutable std::string last_error_;
};

}  // namespace bmu

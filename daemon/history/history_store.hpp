// Writes the history on a thread of its own: a disk may take seconds, or hang, and the control loop has none.
//
// Minutes and events are handed over through queues that never make anybody wait. While the disk does not take them
// they stay there; when a queue is full what comes is lost, counted and told. A thread that hangs in the disk is given
// up at the end. What a database's trouble leads to is history_file.hpp's business; here it is tried again.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <thread>

#include "daemon/history/history_file.hpp"
#include "daemon/history/history_row.hpp"
#include "protocol/result.hpp"
#include "protocol/time.hpp"

namespace bmu {

struct HistoryStoreOptions {
  HistoryFileOptions file;    // without a path nothing is kept, and what is offered is forgotten
  Duration write_every = 1s;  // what came meanwhile goes in one transaction
  Duration retry = 5s;
  std::size_t minutes_waiting_max = 16;
  std::size_t events_waiting_max = 1'024;
};

enum class HistoryState : std::uint8_t { off, starting, writing, failing };
[[nodiscard]] std::string_view to_text(HistoryState state);

struct HistoryHealth {
  HistoryState state = HistoryState::off;
  std::uint64_t rows_written = 0;  // in this life
  std::uint64_t rows_lost = 0;
  std::uint64_t rows_waiting = 0;
  std::uint64_t events_written = 0;
  std::uint64_t events_lost = 0;
  std::int64_t size_bytes = 0;  // as of the last row
  std::string last_error;       // "" while all is well
  std::string put_aside;        // the name that a damaged database has now; "": none was
};

class HistoryStore {
 public:
  HistoryStore(const HistoryStoreOptions& options, const HistoryLife& life);
  HistoryStore(const HistoryStore&) = delete;
  HistoryStore& operator=(const HistoryStore&) = delete;
  /// Ends the thread; one that hangs in a disk is given up after 200 ms.
  ~HistoryStore();

  /// Starts the thread, which opens the file. After prepare_signals(), whose mask it inherits. The error: the errno
  /// value with which the system refuses a thread; nothing is written then.
  [[nodiscard]] Result<void, int> start();

  // Take a copy and never wait. Of one thread, as is `health`.
  void offer(const Minute& minute);
  void offer(const TimedEvent& event);

  [[nodiscard]] const std::string& path() const { return path_; }
  /// Never waits: the texts are those of before while the thread changes them.
  [[nodiscard]] HistoryHealth health() const;
  /// The last try failed: without the texts.
  [[nodiscard]] bool is_failing() const;
  /// Waits until everything that was offered is written, or a try has failed, at most so long. False: it is not.
  [[nodiscard]] bool flush(Duration at_most);

 private:
  struct Shared;

  std::string path_;
  std::shared_ptr<Shared> shared_;  // the thread's, too: it may outlive us
  std::thread thread_;
  mutable std::string last_error_;
  mutable std::string put_aside_;
};

}  // namespace bmu

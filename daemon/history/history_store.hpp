// Writer of the history in a thread of its own: a disk may take seconds, or hang, and the control loop must not wait.
//
// Minutes and events are passed on through queues that never make a thread wait. While the disk does not accept them
// they stay there; when a queue is full further ones are lost, counted and reported. A thread that hangs in a disk
// access is detached at the end. history_file.hpp handles the errors of a database; here the writing is retried.
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
  HistoryFileOptions file;    // without a path nothing is stored, and offered items are discarded
  Duration write_every = 1s;  // items offered meanwhile are written in one transaction
  Duration retry = 5s;
  std::size_t minutes_waiting_max = 16;
  std::size_t events_waiting_max = 1'024;
};

enum class HistoryState : std::uint8_t { off, starting, writing, failing };
[[nodiscard]] std::string_view to_text(HistoryState state);

struct HistoryHealth {
  HistoryState state = HistoryState::off;
  std::uint64_t rows_written = 0;  // in this session
  std::uint64_t rows_lost = 0;
  std::uint64_t rows_waiting = 0;
  std::uint64_t events_written = 0;
  std::uint64_t events_lost = 0;
  std::int64_t size_bytes = 0;  // as of the last row
  std::string last_error;       // "" while writing succeeds
  std::string put_aside;        // present name of a quarantined database; "": none
};

class HistoryStore {
 public:
  HistoryStore(const HistoryStoreOptions& options, const HistoryLife& life);
  HistoryStore(const HistoryStore&) = delete;
  HistoryStore& operator=(const HistoryStore&) = delete;
  /// Ends the thread; one that hangs in a disk access is detached after 200 ms.
  ~HistoryStore();

  /// Starts the thread, which opens the file. Call after prepare_signals(): the thread inherits its signal mask.
  /// The error: the errno value with which the system refuses the thread; nothing is written then.
  [[nodiscard]] Result<void, int> start();

  // Store a copy and never wait. To be called by one thread, as is `health`.
  void offer(const Minute& minute);
  void offer(const TimedEvent& event);

  [[nodiscard]] const std::string& path() const { return path_; }
  /// Never waits: while the thread changes the texts, the previous ones are returned.
  [[nodiscard]] HistoryHealth health() const;
  /// The last attempt failed. Does not read the texts.
  [[nodiscard]] bool is_failing() const;
  /// Waits until all offered items are written, or an attempt has failed, at most for `at_most`. False: not all are
  /// written.
  [[nodiscard]] bool flush(Duration at_most);

 private:
  struct Shared;

  std::string path_;
  std::shared_ptr<Shared> shared_;  // also held by the thread, which may outlive this object
  std::thread thread_;
  mutable std::string last_error_;
  mutable std::string put_aside_;
};

}  // namespace bmu

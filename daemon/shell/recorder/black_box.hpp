// The last minutes in memory, and files of the time around an opening or a fault that latches.
//
//   add(frame) ...    the oldest parts are dropped when the younger ones reach back far enough
//   trigger(cause)    starts a file: the head of the cause, then all that is in memory
//   add(frame) ...    appended to it too, until `after` is over; then the file is complete
//   write()           brings all of it to the disk
//
// Data that a full or broken disk did not accept is kept and retried, for the last few files. Between two pieces the
// file is readable up to its end, so a loss of power costs only the pieces that were not yet written.
//
// Called by the thread of the recorder; waits for the disk.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "daemon/shell/recorder/append_file.hpp"
#include "daemon/shell/recorder/kept_files.hpp"
#include "daemon/shell/recorder/record_frame.hpp"

namespace bmu {

struct BlackBoxOptions {
  std::string folder;
  Duration before = 120s;  // minimum length in memory, once the daemon has run for that long
  Duration after = 10s;
  Duration longest = 60s;  // a trigger later than this after the first one starts a new file
  std::size_t memory_max_bytes = std::size_t{64} << 20;  // overrides `before`: a flooded bus must not exhaust the RAM
  KeptFilesLimits limits{.count_max = 50, .total_bytes = std::uint64_t{200} << 20};
};

/// Reason to start a file.
struct BlackBoxCause {
  TimePoint at{};
  std::int64_t unix_time_us = 0;
  std::string word;                         // in the file's name: "fault-cell-undervoltage", "opened-request-over"
  bool is_routine = false;                  // e.g. the end of a drive: its file is among the first to be removed
  std::shared_ptr<const std::string> head;  // a zstd frame of the lines with the reason
};

class BlackBox {
 public:
  static constexpr std::size_t waiting_max = 4;

  explicit BlackBox(BlackBoxOptions options) : options_(std::move(options)), files_(options_.folder, "blackbox") {}

  void add(const RecordFrame& frame);
  /// While a file is open for an earlier cause, extends that file instead, up to `longest`; a routine file is extended
  /// by routine causes only.
  void trigger(BlackBoxCause cause);
  /// Writes all pending data, also that of failed attempts. To be called as often as the disk should be tried, at most.
  void write();
  /// No more frames follow: the open file is complete as it is, and is written if possible.
  void end();
  /// Ends all attempts: pending files are lost, and counted.
  void give_up();

  [[nodiscard]] bool is_waiting() const;
  [[nodiscard]] std::uint64_t files_written() const { return files_written_; }
  [[nodiscard]] std::uint64_t files_lost() const { return files_lost_; }
  /// Number of failed attempts to write.
  [[nodiscard]] std::uint64_t tries_failed() const { return tries_failed_; }
  /// "" before the first file.
  [[nodiscard]] const std::string& last_path() const { return last_path_; }
  /// Of the last attempt; "" if it succeeded.
  [[nodiscard]] const std::string& last_error() const { return last_error_; }
  [[nodiscard]] std::size_t memory_bytes() const { return memory_bytes_; }
  /// Time span of the memory.
  [[nodiscard]] Duration memory_length() const;

 private:
  struct File {
    BlackBoxCause cause;
    TimePoint until{};
    std::vector<std::shared_ptr<const std::string>> pieces{};
    std::size_t written = 0;  // number of pieces
    std::optional<AppendFile> file{};
    bool is_synced = true;
    bool is_whole = false;
  };

  void forget_old();
  [[nodiscard]] Result<void, OsError> write(File& file);

  BlackBoxOptions options_;
  KeptFiles files_;
  std::deque<RecordFrame> memory_;
  std::size_t memory_bytes_ = 0;
  std::deque<File> open_;  // the last one may still grow; the others wait for a disk
  std::uint64_t files_written_ = 0;
  std::uint64_t files_lost_ = 0;
  std::uint64_t tries_failed_ = 0;
  std::string last_path_;
  std::string last_error_;
};

}  // namespace bmu

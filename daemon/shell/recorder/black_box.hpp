// The last minutes in memory, and files of what was around an opening or a fault that latches.
//
//   add(frame) ...            the oldest parts go when the younger ones reach back far enough
//   trigger(why, words)       a file is begun: the words, then all that is in memory, on the disk when this returns
//   add(frame) ...            appended to it too, until `after` is over; then it is whole
//
// What a full or broken disk did not take is kept and tried again, for the last few files. Between two pieces the file
// is readable up to where it was, so a loss of power costs what was not yet written.
//
// The recorder's thread calls it; it waits for the disk.
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
  Duration before = 120s;  // at least so much is in memory, once we run for so long
  Duration after = 10s;
  Duration longest = 60s;  // what comes later than this after the first cause begins a file of its own
  std::size_t memory_max_bytes = std::size_t{64} << 20;  // goes before `before`: a flooded bus must not eat the machine
  KeptFilesLimits limits{.count_max = 50, .total_bytes = std::uint64_t{200} << 20};
};

/// What a file is begun for.
struct BlackBoxCause {
  TimePoint at{};
  std::int64_t unix_time_us = 0;
  std::string word;                         // in the file's name: "fault-cell-undervoltage", "opened-request-over"
  bool is_routine = false;                  // as the end of a drive: its file is the first to go
  std::shared_ptr<const std::string> head;  // a zstd frame of the lines that say why
};

class BlackBox {
 public:
  static constexpr std::size_t waiting_max = 4;

  explicit BlackBox(BlackBoxOptions options) : options_(std::move(options)), files_(options_.folder, "blackbox") {}

  void add(const RecordFrame& frame);
  /// While a file is open for an earlier cause, that file goes on for longer instead.
  void trigger(BlackBoxCause cause);
  /// Writes what can be written, and again what could not be. Not more often than the disk should be tried.
  void write();
  /// No more comes: what is open is whole as it is, and written if it can be.
  void end();
  /// Nothing is tried any more: what still waits is lost, and counted.
  void give_up();

  [[nodiscard]] bool is_waiting() const;
  [[nodiscard]] std::uint64_t files_written() const { return files_written_; }
  [[nodiscard]] std::uint64_t files_lost() const { return files_lost_; }
  /// How often a disk did not take what it was to.
  [[nodiscard]] std::uint64_t tries_failed() const { return tries_failed_; }
  /// "" before the first.
  [[nodiscard]] const std::string& last_path() const { return last_path_; }
  /// Of the last try; "" if all is well.
  [[nodiscard]] const std::string& last_error() const { return last_error_; }
  [[nodiscard]] std::size_t memory_bytes() const { return memory_bytes_; }
  /// How far the memory reaches back.
  [[nodiscard]] Duration memory_length() const;

 private:
  struct File {
    BlackBoxCause cause;
    TimePoint until{};
    std::vector<std::shared_ptr<const std::string>> pieces{};
    std::size_t written = 0;  // of the pieces
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

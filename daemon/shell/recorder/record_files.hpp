// A recording at full length on the disk: files of a manageable size, the oldest of which are removed.
//
// A file begins with a part, so each can be replayed without the others. Data that a disk does not accept waits and is
// retried; after a minute of that the oldest parts are lost, and counted, and the following ones go to another file, so
// that no file has a gap.
//
// Called by the thread of the recorder; waits for the disk.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "daemon/shell/recorder/append_file.hpp"
#include "daemon/shell/recorder/kept_files.hpp"
#include "daemon/shell/recorder/record_frame.hpp"

namespace bmu {

struct RecordFilesOptions {
  std::string folder;
  std::uint64_t file_bytes = std::uint64_t{16} << 20;  // the next part after this starts a new file
  std::uint64_t total_bytes = std::uint64_t{1} << 30;  // of all files; the oldest are removed
  Duration sync_every = 8s;  // with the second of the frame before and of one on its way, a loss of power costs 10 s
  Duration retry = 5s;
  Duration wait_max = 60s;                             // maximum time span that waits for a disk
  std::size_t wait_max_bytes = std::size_t{64} << 20;  // and its maximum size
};

class RecordFiles {
 public:
  explicit RecordFiles(RecordFilesOptions options) : options_(std::move(options)), files_(options_.folder, "drive") {}

  void add(const RecordFrame& frame);
  /// Writes the waiting frames, as far as the disk accepts them.
  void write();
  /// Frames that still wait after a last attempt are lost, and counted.
  void end();
  [[nodiscard]] bool is_waiting() const { return !waiting_.empty(); }

  /// "" without an open file.
  [[nodiscard]] std::string path() const { return file_ ? file_->path() : ""; }
  [[nodiscard]] std::uint64_t bytes_written() const { return bytes_written_; }
  /// Frames that are in no file, because of the disk.
  [[nodiscard]] std::uint64_t frames_lost() const { return frames_lost_; }
  [[nodiscard]] const std::string& last_error() const { return last_error_; }

 private:
  [[nodiscard]] Result<void, OsError> begin_file(const RecordFrame& frame);
  [[nodiscard]] Result<void, OsError> append(const RecordFrame& frame);
  [[nodiscard]] Result<void, OsError> sync(const RecordFrame& frame);
  void forget_old();
  void lose_first();
  void close_file();

  RecordFilesOptions options_;
  KeptFiles files_;
  std::optional<AppendFile> file_;
  std::deque<RecordFrame> waiting_;
  std::uint64_t waiting_bytes_ = 0;
  TimePoint tried_at_{};
  TimePoint synced_at_{};
  std::uint64_t bytes_written_ = 0;
  std::uint64_t frames_lost_ = 0;
  std::string last_error_;
};

}  // namespace bmu

// A recording at full length on the disk: files of a size that can be carried about, the oldest of which go.
//
// A file begins with a part, so each can be run again without the others. What a disk does not take waits and is tried
// again; after a minute of that the oldest parts are lost, and counted, and what comes behind them begins another file,
// so that no file has a hole.
//
// The recorder's thread calls it; it waits for the disk.
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
  std::uint64_t file_bytes = std::uint64_t{16} << 20;  // the next part after this begins a new file
  std::uint64_t total_bytes = std::uint64_t{1} << 30;  // of all files; the oldest go
  Duration sync_every = 8s;  // with a second's frame before and one on its way, what a loss of power may cost: 10 s
  Duration retry = 5s;
  Duration wait_max = 60s;                             // so much waits for a disk
  std::size_t wait_max_bytes = std::size_t{64} << 20;  // and no more than that
};

class RecordFiles {
 public:
  explicit RecordFiles(RecordFilesOptions options) : options_(std::move(options)), files_(options_.folder, "drive") {}

  void add(const RecordFrame& frame);
  /// Writes what waits, as far as the disk takes it.
  void write();
  /// What still waits is lost, and counted.
  void end();
  [[nodiscard]] bool is_waiting() const { return !waiting_.empty(); }

  /// "" while there is none.
  [[nodiscard]] std::string path() const { return file_ ? file_->path() : ""; }
  [[nodiscard]] std::uint64_t bytes_written() const { return bytes_written_; }
  /// Frames that no file has, for the disk's sake.
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

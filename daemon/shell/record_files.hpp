// A recording at full length on the disk: files of a size that can be carried about, the oldest of which go.
//
// A file begins with a part, so each can be run again without the others. A disk that takes nothing costs what is
// recorded meanwhile: the next part begins the next file.
//
// The recorder's thread calls it; it waits for the disk.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "daemon/shell/append_file.hpp"
#include "daemon/shell/kept_files.hpp"
#include "daemon/shell/record_frame.hpp"

namespace bmu {

struct RecordFilesOptions {
  std::string folder;
  std::uint64_t file_bytes = std::uint64_t{16} << 20;  // the next part after this begins a new file
  std::uint64_t total_bytes = std::uint64_t{1} << 30;  // of all files; the oldest go
  Duration sync_every = 8s;  // with a second's frame before and one on its way, what a loss of power may cost: 10 s
};

class RecordFiles {
 public:
  explicit RecordFiles(RecordFilesOptions options) : options_(std::move(options)), files_(options_.folder, "drive") {}

  void add(const RecordFrame& frame);
  void end();

  /// "" while there is none.
  [[nodiscard]] std::string path() const { return file_ ? file_->path() : ""; }
  [[nodiscard]] std::uint64_t bytes_written() const { return bytes_written_; }
  /// Frames that no file has, for the disk's sake.
  [[nodiscard]] std::uint64_t frames_lost() const { return frames_lost_; }
  [[nodiscard]] const std::string& last_error() const { return last_error_; }

 private:
  [[nodiscard]] Result<void, OsError> begin_file(const RecordFrame& frame);
  [[nodiscard]] Result<void, OsError> take(const RecordFrame& frame);

  RecordFilesOptions options_;
  KeptFiles files_;
  std::optional<AppendFile> file_;
  TimePoint synced_at_{};
  std::uint64_t bytes_written_ = 0;
  std::uint64_t frames_lost_ = 0;
  std::string last_error_;
};

}  // namespace bmu

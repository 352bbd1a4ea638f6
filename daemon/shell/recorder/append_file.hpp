// A file that only grows: the pieces written so far stay readable if the power fails during the next piece.
//
//   auto file = AppendFile::create("/var/lib/bmud/recordings/20260101T000000Z.log.zst");
//   file->append(bytes);  file->sync();
//
// All functions wait for the disk. Not for the thread of the control loop.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

#include "daemon/shell/system/os_error.hpp"
#include "daemon/shell/system/owned_fd.hpp"
#include "protocol/result.hpp"

namespace bmu {

class AppendFile {
 public:
  /// Creates a file, and syncs its entry in the folder; an existing one is an error, never overwritten.
  [[nodiscard]] static Result<AppendFile, OsError> create(std::string path);

  /// Appends all bytes, or returns the error; then the file ends as before, if the system permits.
  [[nodiscard]] Result<void, OsError> append(std::string_view bytes);
  /// The data is on the disk when this returns.
  [[nodiscard]] Result<void, OsError> sync();

  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] std::uint64_t size_bytes() const { return size_bytes_; }

 private:
  AppendFile(std::string path, OwnedFd fd) : path_(std::move(path)), fd_(std::move(fd)) {}

  std::string path_;
  OwnedFd fd_;
  std::uint64_t size_bytes_ = 0;
};

}  // namespace bmu

// A file that only grows: what has been written stays readable if the power goes in the middle of the next piece.
//
//   auto file = AppendFile::create("/var/lib/bmud/recordings/20260101T000000Z.log.zst");
//   file->append(bytes);  file->sync();
//
// Everything here waits for the disk. Not for the control loop's thread.
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
  /// A new file, with its name in its folder for good; one of that name is an error, never overwritten.
  [[nodiscard]] static Result<AppendFile, OsError> create(std::string path);

  /// All of it, or the error; then the file ends as it did before, if the system lets it.
  [[nodiscard]] Result<void, OsError> append(std::string_view bytes);
  /// On the disk when this returns.
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

#include "daemon/shell/recorder/append_file.hpp"

#include <cerrno>

#include <fcntl.h>
#include <unistd.h>

namespace bmu {

namespace {

/// The folder decides which users may see the data of the pack; no other process writes the file.
constexpr int file_mode = 0640;

OsError os_error(std::string_view step, const std::string& path) {
  return {.code = errno, .what = std::string(step) + " " + path};
}

Result<void, OsError> sync_folder_of(const std::string& path) {
  const std::size_t slash = path.rfind('/');
  const std::string folder = slash == std::string::npos ? "." : path.substr(0, slash + 1);
  const OwnedFd fd(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!fd.is_open() || ::fsync(fd.get()) != 0) return failure(os_error("sync the directory of", path));
  return {};
}

}  // namespace

Result<AppendFile, OsError> AppendFile::create(std::string path) {
  OwnedFd fd(::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_APPEND | O_CLOEXEC, file_mode));
  if (!fd.is_open()) return failure(os_error("make", path));
  if (auto synced = sync_folder_of(path); !synced) {
    ::unlink(path.c_str());  // an empty file would be taken for a recording
    return failure(synced.error());
  }
  return AppendFile(std::move(path), std::move(fd));
}

Result<void, OsError> AppendFile::append(std::string_view bytes) {
  std::string_view rest = bytes;
  while (!rest.empty()) {
    const ssize_t count = ::write(fd_.get(), rest.data(), rest.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) {
      const OsError error = os_error("write", path_);
      // An incomplete piece is of no use. If it cannot be cut off, readers find a torn end, as after a loss of power.
      static_cast<void>(::ftruncate(fd_.get(), static_cast<off_t>(size_bytes_)) == 0);
      return failure(error);
    }
    rest.remove_prefix(static_cast<std::size_t>(count));
  }
  size_bytes_ += bytes.size();
  return {};
}

Result<void, OsError> AppendFile::sync() {
  if (::fdatasync(fd_.get()) != 0) return failure(os_error("sync", path_));
  return {};
}

}  // namespace bmu

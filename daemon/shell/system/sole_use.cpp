#include "daemon/shell/system/sole_use.hpp"

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>

namespace bmu {

namespace {

// For the owner only: a user who may read the file could lock it as well, and keep the daemon from starting.
constexpr mode_t lock_file_mode = 0600;

bool is_same_inode(int one, int other) {
  struct stat a {};
  struct stat b {};
  return ::fstat(one, &a) == 0 && ::fstat(other, &b) == 0 && a.st_dev == b.st_dev && a.st_ino == b.st_ino;
}

/// One file has one lock, whatever link leads to it.
std::string real_path(const std::string& path) {
  std::error_code error;
  const std::filesystem::path real = std::filesystem::weakly_canonical(path, error);
  return error ? path : real.string();
}

}  // namespace

bool SoleUse::has(int fd) const {
  return std::any_of(held_.begin(), held_.end(), [fd](const OwnedFd& held) { return is_same_inode(held.get(), fd); });
}

Result<void, OsError> SoleUse::lock(OwnedFd fd, const std::string& path, const std::string& option) {
  if (!fd.is_open() || has(fd.get())) return {};
  if (::flock(fd.get(), LOCK_EX | LOCK_NB) != 0) {
    // Any other error is that of a file system without locks.
    if (errno != EWOULDBLOCK) return {};
    return failure(OsError{0, path + " is in use by another bmud; choose another path with " + option +
                                  " (systemd gives each bmud@PACK its own)"});
  }
  held_.push_back(std::move(fd));
  return {};
}

Result<void, OsError> SoleUse::add_file(const std::string& path, const std::string& option) {
  if (path.empty()) return {};
  const std::string beside = real_path(path) + ".lock";
  // Read only, since nothing is written into it: on a disk that an error has made read-only it still locks. O_NONBLOCK,
  // since opening a pipe would wait.
  OwnedFd fd(::open(beside.c_str(), O_RDONLY | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK, lock_file_mode));
  const int reason = errno;
  struct stat there {};
  if (!fd.is_open() && ::lstat(beside.c_str(), &there) == 0) {
    return failure(OsError{reason, beside + " exists and cannot be opened, expected the lock file of " + path +
                                       "; remove it once no other bmud runs, or choose another path with " + option});
  }
  return lock(std::move(fd), path, option);
}

Result<void, OsError> SoleUse::add_folder(const std::string& path, const std::string& option) {
  if (path.empty()) return {};
  return lock(OwnedFd(::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)), path, option);
}

}  // namespace bmu

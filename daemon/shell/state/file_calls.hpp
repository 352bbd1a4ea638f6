// The system calls that bring a file of the daemon to the disk and back, errno included, behind one interface, so that
// a test can cut the power at any of them, or let any of them fail.
#pragma once

#include <cstddef>

#include <sys/stat.h>
#include <sys/types.h>

namespace bmu {

class FileCalls {
 public:
  FileCalls() = default;
  FileCalls(const FileCalls&) = delete;
  FileCalls& operator=(const FileCalls&) = delete;
  virtual ~FileCalls() = default;

  virtual int open(const char* path, int flags, mode_t mode);
  virtual int status(int fd, struct stat& status);
  virtual ssize_t read(int fd, void* to, std::size_t size);
  virtual ssize_t write(int fd, const void* from, std::size_t size);
  virtual int sync(int fd);
  virtual int close(int fd);
  virtual int rename(const char* from, const char* to);
  virtual int unlink(const char* path);
};

/// Those of the system; one object for all users.
[[nodiscard]] FileCalls& system_file_calls();

/// A file that was opened by these calls, and is closed by them.
class OpenFile {
 public:
  OpenFile(FileCalls& calls, int fd) : calls_(calls), fd_(fd) {}
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;
  ~OpenFile() {
    if (fd_ >= 0) calls_.close(fd_);
  }

  [[nodiscard]] int get() const { return fd_; }
  [[nodiscard]] bool is_open() const { return fd_ >= 0; }

 private:
  FileCalls& calls_;
  int fd_;
};

}  // namespace bmu

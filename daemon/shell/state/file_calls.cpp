#include "daemon/shell/state/file_calls.hpp"

#include <cstdio>

#include <fcntl.h>
#include <unistd.h>

namespace bmu {

int FileCalls::open(const char* path, int flags, mode_t mode) {
  return ::open(path, flags, mode);
}
int FileCalls::status(int fd, struct stat& status) {
  return ::fstat(fd, &status);
}
ssize_t FileCalls::read(int fd, void* to, std::size_t size) {
  return ::read(fd, to, size);
}
ssize_t FileCalls::write(int fd, const void* from, std::size_t size) {
  return ::write(fd, from, size);
}
int FileCalls::sync(int fd) {
  return ::fsync(fd);
}
int FileCalls::close(int fd) {
  return ::close(fd);
}
int FileCalls::rename(const char* from, const char* to) {
  return ::rename(from, to);
}
int FileCalls::unlink(const char* path) {
  return ::unlink(path);
}

FileCalls& system_file_calls() {
  static FileCalls calls;
  return calls;
}

}  // namespace bmu

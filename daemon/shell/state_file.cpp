#include "daemon/shell/state_file.hpp"

#include <array>
#include <cerrno>
#include <cstdio>
#include <optional>
#include <utility>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "daemon/shell/owned_fd.hpp"

namespace bmu {

namespace {

constexpr int file_mode = 0600;

OsError os_error(std::string_view step, const std::string& path) {
  return {.code = errno, .what = std::string(step) + " " + path};
}

/// The text; nothing if there is no such file; or why there is none to be had.
Result<std::optional<std::string>, std::string> read_text(const std::string& path) {
  const auto refused = [&] { return failure(std::string(std::strerror(errno))); };
  // Not to wait for the other end of a pipe that somebody put there.
  const OwnedFd file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (!file.is_open() && errno == ENOENT) return std::optional<std::string>{};
  struct stat status {};
  if (!file.is_open() || ::fstat(file.get(), &status) != 0) return refused();
  if (!S_ISREG(status.st_mode)) return failure(std::string("no regular file"));
  std::string text;
  std::array<char, 16384> buffer{};
  while (true) {
    const ssize_t count = ::read(file.get(), buffer.data(), buffer.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return refused();
    if (count == 0) return text;
    text.append(buffer.data(), static_cast<std::size_t>(count));
    if (text.size() > StateFile::size_max) return failure(std::string("more than 1 MiB"));
  }
}

bool write_all(int file, std::string_view text) {
  while (!text.empty()) {
    const ssize_t count = ::write(file, text.data(), text.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return false;
    text.remove_prefix(static_cast<std::size_t>(count));
  }
  return true;
}

Result<void, OsError> write_new(const std::string& path, std::string_view text) {
  const OwnedFd file(::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_NOFOLLOW | O_CLOEXEC, file_mode));
  if (!file.is_open()) return failure(os_error("make", path));
  if (!write_all(file.get(), text)) return failure(os_error("write", path));
  if (::fsync(file.get()) != 0) return failure(os_error("sync", path));
  return {};
}

}  // namespace

std::string_view to_text(FileFound found) {
  switch (found) {
    case FileFound::nothing: return "nothing";
    case FileFound::newest: return "newest";
    case FileFound::previous: return "previous";
    case FileFound::unreadable: return "unreadable";
  }
  return "?";
}

std::string StateFile::folder() const {
  const std::size_t slash = path_.rfind('/');
  if (slash == std::string::npos) return ".";
  return slash == 0 ? "/" : path_.substr(0, slash);
}

FileFound StateFile::read(const Take& take, std::string& problems) {
  constexpr std::array<std::pair<std::string_view, FileFound>, 2> generations{
      {{"", FileFound::newest}, {".previous", FileFound::previous}}};
  bool is_there = false;
  for (const auto& [suffix, found] : generations) {
    const std::string path = path_ + std::string(suffix);
    const auto text = read_text(path);
    if (text && !text->has_value()) continue;
    is_there = true;
    const Result<void, std::string> taken = text ? take(**text) : failure(text.error());
    if (taken) {
      is_good_ = found == FileFound::newest;
      return found;
    }
    problems += (problems.empty() ? "" : "; ") + path + ": " + taken.error();
  }
  return is_there ? FileFound::unreadable : FileFound::nothing;
}

Result<void, OsError> StateFile::write(std::string_view text) {
  const std::string fresh = path_ + ".new";
  if (auto written = write_new(fresh, text); !written) {
    // Half a file is of no use, and on a full disk it is in the way.
    ::unlink(fresh.c_str());
    return written;
  }
  const std::string aside = path_ + (is_good_ ? ".previous" : ".damaged");
  if (::rename(path_.c_str(), aside.c_str()) != 0 && errno != ENOENT) return failure(os_error("rename", path_));
  is_good_ = false;
  if (::rename(fresh.c_str(), path_.c_str()) != 0) return failure(os_error("rename", fresh));
  is_good_ = true;
  const OwnedFd folder_fd(::open(folder().c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!folder_fd.is_open() || ::fsync(folder_fd.get()) != 0) return failure(os_error("sync the folder of", path_));
  return {};
}

}  // namespace bmu

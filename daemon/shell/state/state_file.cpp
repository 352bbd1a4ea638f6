#include "daemon/shell/state/state_file.hpp"

#include <array>
#include <cerrno>
#include <cstdio>
#include <optional>
#include <utility>

#include <fcntl.h>
#include <sys/stat.h>

namespace bmu {

namespace {

constexpr int file_mode = 0600;

OsError os_error(const std::string& step, const std::string& path) {
  return {.code = errno, .what = step + " " + path};
}

/// Result of the call, which is repeated while signals interrupt it.
template <class Call>
auto finish(Call call) {
  auto answer = call();
  while (answer < 0 && errno == EINTR) answer = call();
  return answer;
}

int open_file(FileCalls& calls, const std::string& path, int flags) {
  return finish([&] { return calls.open(path.c_str(), flags | O_CLOEXEC, file_mode); });
}

/// The text; no value if there is no such file; or the error.
Result<std::optional<std::string>, std::string> read_text(FileCalls& calls, const std::string& path) {
  const auto refused = [&] { return failure(std::string(std::strerror(errno))); };
  // O_NONBLOCK, so as not to wait for the other end if the path is a pipe.
  const OpenFile file(calls, open_file(calls, path, O_RDONLY | O_NONBLOCK));
  if (!file.is_open() && errno == ENOENT) return std::optional<std::string>{};
  struct stat status {};
  if (!file.is_open() || calls.status(file.get(), status) != 0) return refused();
  if (!S_ISREG(status.st_mode)) return failure(std::string("not a regular file"));
  std::string text;
  std::array<char, 16384> buffer{};
  while (true) {
    const ssize_t count = finish([&] { return calls.read(file.get(), buffer.data(), buffer.size()); });
    if (count < 0) return refused();
    if (count == 0) return text;
    text.append(buffer.data(), static_cast<std::size_t>(count));
    if (text.size() > StateFile::size_max) return failure(std::string("more than 1 MiB"));
  }
}

bool write_all(FileCalls& calls, int file, std::string_view text) {
  while (!text.empty()) {
    const ssize_t count = finish([&] { return calls.write(file, text.data(), text.size()); });
    if (count == 0) errno = EIO;  // nothing written, and no error reported
    if (count <= 0) return false;
    text.remove_prefix(static_cast<std::size_t>(count));
  }
  return true;
}

/// Writes a new file: an existing one, left by an interrupted session or put there by a user, is not written through.
Result<void, OsError> write_new(FileCalls& calls, const std::string& path, std::string_view text) {
  finish([&] { return calls.unlink(path.c_str()); });  // if it cannot be removed, the next call fails
  const OpenFile file(calls, open_file(calls, path, O_WRONLY | O_CREAT | O_EXCL));
  if (!file.is_open()) return failure(os_error("create", path));
  if (!write_all(calls, file.get(), text)) return failure(os_error("write", path));
  if (finish([&] { return calls.sync(file.get()); }) != 0) return failure(os_error("sync", path));
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
    const auto text = read_text(calls_, path);
    if (text && !text->has_value()) continue;
    is_there = true;
    const Result<void, std::string> taken = text ? take(**text) : failure(text.error());
    if (taken) {
      is_good_ = found == FileFound::newest;
      return found;
    }
    problems += (problems.empty() ? "" : "; ") + path + ": " + taken.error();
    is_previous_damaged_ = found == FileFound::previous;
  }
  return is_there ? FileFound::unreadable : FileFound::nothing;
}

bool StateFile::rename(const std::string& from, const std::string& to) const {
  return finish([&] { return calls_.rename(from.c_str(), to.c_str()); }) == 0;
}

Result<void, OsError> StateFile::write(std::string_view text) {
  const std::string fresh = path_ + ".new";
  // An incomplete file is of no use, and takes space on a full disk.
  const auto refused = [&](const OsError& error) {
    finish([&] { return calls_.unlink(fresh.c_str()); });
    return failure(error);
  };
  if (text.size() > size_max) return failure(OsError{.code = EFBIG, .what = "write " + path_});
  if (auto written = write_new(calls_, fresh, text); !written) return refused(written.error());
  if (auto renamed = put_in_place(fresh); !renamed) return refused(renamed.error());
  const OpenFile folder_file(calls_, open_file(calls_, folder(), O_RDONLY | O_DIRECTORY));
  if (!folder_file.is_open() || finish([&] { return calls_.sync(folder_file.get()); }) != 0) {
    return failure(os_error("sync the directory of", path_));
  }
  return {};
}

Result<void, OsError> StateFile::put_in_place(const std::string& fresh) {
  const std::string aside = path_ + (is_good_ ? ".previous" : ".damaged");
  const bool is_aside = rename(path_, aside);
  if (!is_aside && errno != ENOENT) return failure(os_error("rename " + path_ + " to", aside));
  if (!rename(fresh, path_)) {
    const OsError error = os_error("rename " + fresh + " to", path_);
    // If that fails as well there is no FILE, and FILE.previous counts.
    if (!is_aside || !rename(aside, path_)) is_good_ = false;
    return failure(error);
  }
  is_good_ = true;
  // Until there is a valid FILE it shows that this is not a first start; if it cannot be kept, only people miss it.
  const std::string previous = path_ + ".previous";
  if (std::exchange(is_previous_damaged_, false)) static_cast<void>(rename(previous, previous + ".damaged"));
  return {};
}

}  // namespace bmu

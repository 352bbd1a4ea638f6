#include "tests/support/model_disk.hpp"

#include <algorithm>
#include <cerrno>
#include <set>

#include <fcntl.h>

namespace bmu::test {

namespace {

constexpr std::size_t sector = 512;

/// Possible contents of a file that was to become `now` and is `before` on the disk: cut off at every length, halves
/// and sectors of zeros, sectors of the content before.
std::set<std::string> torn(const std::string& before, const std::string& now) {
  std::set<std::string> all{before, now, std::string(now.size(), '\0')};
  for (std::size_t length = 0; length < now.size(); ++length) all.insert(now.substr(0, length));
  const auto with = [&](std::size_t from, std::size_t size, const std::string& instead) {
    std::string text = now;
    for (std::size_t at = from; at < std::min(from + size, now.size()); ++at) {
      text[at] = at < instead.size() ? instead[at] : '\0';
    }
    all.insert(std::move(text));
  };
  const std::size_t half = now.size() / 2;
  for (const std::string& instead : {std::string(), before}) {
    with(0, half, instead);
    with(half, now.size(), instead);
    for (std::size_t from = 0; from < now.size(); from += sector) {
      with(from, sector, instead);
      with(0, from, instead);
      with(from, now.size(), instead);
    }
  }
  return all;
}

}  // namespace

ModelDisk::ModelDisk(const DiskImage& image, int cut_at) : cut_at_(cut_at) {
  for (const auto& [path, content] : image) {
    names_[path] = files_.size();
    files_.push_back({.now = content, .synced = content});
  }
  synced_names_ = names_;
}

void ModelDisk::count_call() {
  if (calls_++ == cut_at_) throw PowerIsGone{};
}

void ModelDisk::apply(const Change& change, Names& names) const {
  const auto from = names.find(change.from);
  if (from != names.end() && from->second == change.file) names.erase(from);
  if (!change.to.empty()) names[change.to] = change.file;
}

void ModelDisk::change(const Change& change) {
  apply(change, names_);
  changes_.push_back(change);
}

int ModelDisk::open(const char* path, int flags, mode_t /*mode*/) {
  if ((flags & O_DIRECTORY) != 0) {
    handles_[next_fd_] = {.is_folder = true};
    return next_fd_++;
  }
  const bool makes = (flags & O_CREAT) != 0;
  if (makes) count_call();
  const auto found = names_.find(path);
  if (found == names_.end() && !makes) {
    errno = ENOENT;
    return -1;
  }
  if (found != names_.end() && (flags & O_EXCL) != 0) {
    errno = EEXIST;
    return -1;
  }
  std::size_t file = files_.size();
  if (found != names_.end()) {
    file = found->second;
  } else {
    files_.push_back({});
    change({.to = path, .file = file});
  }
  if ((flags & O_TRUNC) != 0 && !files_[file].now.empty()) {
    files_[file].now.clear();
    files_[file].is_synced = false;
  }
  handles_[next_fd_] = {.file = file};
  return next_fd_++;
}

int ModelDisk::status(int /*fd*/, struct stat& status) {
  status.st_mode = S_IFREG;
  return 0;
}

ssize_t ModelDisk::read(int fd, void* to, std::size_t size) {
  Handle& handle = handles_.at(fd);
  const std::string& text = files_[handle.file].now;
  const std::size_t count = text.copy(static_cast<char*>(to), size, handle.at);
  handle.at += count;
  return static_cast<ssize_t>(count);
}

/// Writes at most 300 bytes per call, so that there are several calls at which the power can fail.
ssize_t ModelDisk::write(int fd, const void* from, std::size_t size) {
  count_call();
  const std::size_t count = std::min<std::size_t>(size, 300);
  File& file = files_[handles_.at(fd).file];
  file.now.append(static_cast<const char*>(from), count);
  file.is_synced = false;
  return static_cast<ssize_t>(count);
}

int ModelDisk::sync(int fd) {
  count_call();
  const Handle& handle = handles_.at(fd);
  if (handle.is_folder) {
    if (lies_about_folders) return 0;
    synced_names_ = names_;
    changes_.clear();
    return 0;
  }
  if (lies_about_files) return 0;
  File& file = files_[handle.file];
  file.synced = file.now;
  file.is_synced = true;
  return 0;
}

/// Not counted: destructors call it, which must not throw, and a cut here equals one at the next call.
int ModelDisk::close(int fd) {
  handles_.erase(fd);
  return 0;
}

int ModelDisk::rename(const char* from, const char* to) {
  count_call();
  const auto found = names_.find(from);
  if (found == names_.end()) {
    errno = ENOENT;
    return -1;
  }
  change({.from = from, .to = to, .file = found->second});
  return 0;
}

int ModelDisk::unlink(const char* path) {
  count_call();
  const auto found = names_.find(path);
  if (found == names_.end()) {
    errno = ENOENT;
    return -1;
  }
  change({.from = path, .file = found->second});
  return 0;
}

std::vector<std::string> ModelDisk::contents_of(const File& file) const {
  if (file.is_synced) return {file.now};
  const std::set<std::string> all = torn(file.synced, file.now);
  return {all.begin(), all.end()};
}

void ModelDisk::for_each_disk(const std::function<void(const DiskImage&)>& look) const {
  std::set<Names> seen;
  for (std::size_t happened = 0; happened < (std::size_t{1} << changes_.size()); ++happened) {
    Names names = synced_names_;
    for (std::size_t i = 0; i < changes_.size(); ++i) {
      if ((happened >> i & 1U) != 0) apply(changes_[i], names);
    }
    if (!seen.insert(names).second) continue;
    // Only one file at a time is torn: a writer has at most one that is not synced.
    DiskImage image;
    for (const auto& [path, file] : names) image[path] = files_[file].now;
    look(image);
    for (const auto& [path, file] : names) {
      if (files_[file].is_synced) continue;
      for (std::string& content : contents_of(files_[file])) {
        DiskImage other = image;
        other[path] = std::move(content);
        look(other);
      }
    }
  }
}

}  // namespace bmu::test

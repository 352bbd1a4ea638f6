// Worst-case disk in memory: until a file is synced any part of it may be missing, and until its folder is synced any
// of the changed names may still be the old one. The power fails at a chosen call; then a test can inspect every disk
// that may result.
//
// Changes of names take effect one by one or not at all (a rename is atomic), in any order: more than journals of file
// systems allow, so a writer that survives here survives there.
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "daemon/shell/state/file_calls.hpp"

namespace bmu::test {

/// Files by their paths.
using DiskImage = std::map<std::string, std::string>;

/// Power failure: thrown through a writer it ends it where it stands, as a real one does.
struct PowerIsGone {};

class ModelDisk : public FileCalls {
 public:
  /// `image`: content from long before. The power fails at call number `cut_at`, counted from 0; never if that is
  /// negative.
  explicit ModelDisk(const DiskImage& image, int cut_at = -1);

  int open(const char* path, int flags, mode_t mode) override;
  int status(int fd, struct stat& status) override;
  ssize_t read(int fd, void* to, std::size_t size) override;
  ssize_t write(int fd, const void* from, std::size_t size) override;
  int sync(int fd) override;
  int close(int fd) override;
  int rename(const char* from, const char* to) override;
  int unlink(const char* path) override;

  /// Calls so far at which the power can fail: those that change something.
  [[nodiscard]] int calls() const { return calls_; }
  /// Calls `look` with every disk that may remain if the power fails now, each once.
  void for_each_disk(const std::function<void(const DiskImage&)>& look) const;

  // For disks worse than any real one: they report "synced" without having done it.
  bool lies_about_files = false;
  bool lies_about_folders = false;

 private:
  struct File {
    std::string now;
    std::string synced;
    bool is_synced = true;
  };
  /// A change of names after the last sync of the folder.
  struct Change {
    std::string from;  // empty: a new file
    std::string to;    // empty: removed
    std::size_t file = 0;
  };
  struct Handle {
    bool is_folder = false;
    std::size_t file = 0;
    std::size_t at = 0;
  };
  using Names = std::map<std::string, std::size_t>;

  void count_call();
  void apply(const Change& change, Names& names) const;
  void change(const Change& change);
  [[nodiscard]] std::vector<std::string> contents_of(const File& file) const;

  std::vector<File> files_;
  Names names_;
  Names synced_names_;
  std::vector<Change> changes_;
  std::map<int, Handle> handles_;
  int next_fd_ = 100;
  int calls_ = 0;
  int cut_at_ = -1;
};

}  // namespace bmu::test

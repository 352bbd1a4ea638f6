// A small text in a file that survives a loss of power at any instant: either the old text or the new one is there.
//
//   write       FILE.new is written and synced; FILE becomes FILE.previous; FILE.new becomes FILE; the folder is synced
//   read        FILE if it is valid, else FILE.previous if that is
//
// Between the two renames there is no FILE, and FILE.previous counts. A FILE that was found damaged never takes the
// place of a valid FILE.previous: it is quarantined as FILE.damaged, for people, and a damaged FILE.previous, once
// there is a valid FILE, as FILE.previous.damaged.
//
// All functions wait for the disk. Not for the thread of the control loop.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <utility>

#include "daemon/shell/state/file_calls.hpp"
#include "daemon/shell/system/os_error.hpp"
#include "protocol/result.hpp"

namespace bmu {

enum class FileFound : std::uint8_t {
  nothing,     // neither file exists: a first start
  newest,      // FILE
  previous,    // FILE.previous, since FILE is missing or damaged
  unreadable,  // there are files, but none is valid
};

[[nodiscard]] std::string_view to_text(FileFound found);

class StateFile {
 public:
  /// Parses a text; the error is the reason why it is invalid.
  using Take = std::function<Result<void, std::string>(std::string_view text)>;

  static constexpr std::size_t size_max = std::size_t{1} << 20;

  explicit StateFile(std::string path, FileCalls& calls = system_file_calls())
      : path_(std::move(path)), calls_(calls) {}

  /// `problems`: the error of each file that was rejected, for a log line; empty if none was.
  [[nodiscard]] FileFound read(const Take& take, std::string& problems);
  /// Precondition: read(), which finds whether FILE is worth keeping. The whole text is on the disk, or the error names
  /// file and step; then read() has the same result as before. Only the second rename, if it fails, costs
  /// FILE.previous; and if the folder cannot be synced the new text is in its place, but may be lost with the power.
  [[nodiscard]] Result<void, OsError> write(std::string_view text);

  [[nodiscard]] const std::string& path() const { return path_; }
  /// Folder of the file, "." for a plain name.
  [[nodiscard]] std::string folder() const;

 private:
  [[nodiscard]] bool rename(const std::string& from, const std::string& to) const;
  [[nodiscard]] Result<void, OsError> put_in_place(const std::string& fresh);

  std::string path_;
  FileCalls& calls_;
  bool is_good_ = false;              // FILE is worth keeping as the previous one
  bool is_previous_damaged_ = false;  // of FILE.previous, which people may need
};

}  // namespace bmu

// A small text in a file that survives a loss of power at any instant: the old text or the new one is there, never
// neither.
//
//   write       FILE.new is written and synced; FILE becomes FILE.previous; FILE.new becomes FILE; the folder is synced
//   read        FILE if it is good, else FILE.previous if that is
//
// Between the two renames there is no FILE, and FILE.previous is what counts. A FILE that was found damaged never takes
// the place of a good FILE.previous: it is put aside as FILE.damaged, for people, and a damaged FILE.previous, once
// there is a good FILE, as FILE.previous.damaged.
//
// Everything here waits for the disk. Not for the control loop's thread.
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
  unreadable,  // there is something, and it is no good
};

[[nodiscard]] std::string_view to_text(FileFound found);

class StateFile {
 public:
  /// Takes a text over; the error says what is wrong with it.
  using Take = std::function<Result<void, std::string>(std::string_view text)>;

  static constexpr std::size_t size_max = std::size_t{1} << 20;

  explicit StateFile(std::string path, FileCalls& calls = system_file_calls())
      : path_(std::move(path)), calls_(calls) {}

  /// `problems`: what was wrong with each file that was refused, for a log line; empty if nothing was.
  [[nodiscard]] FileFound read(const Take& take, std::string& problems);
  /// After read(), which says whether FILE is worth keeping. All of it on the disk, or the error that names file and
  /// step; then read() finds what it found before. Only the second rename, if it fails, costs FILE.previous; and if
  /// the folder cannot be synced the new text is in its place, but may be lost with the power.
  [[nodiscard]] Result<void, OsError> write(std::string_view text);

  [[nodiscard]] const std::string& path() const { return path_; }
  /// Where the file is, "." for a plain name.
  [[nodiscard]] std::string folder() const;

 private:
  [[nodiscard]] bool rename(const std::string& from, const std::string& to) const;
  [[nodiscard]] Result<void, OsError> put_in_place(const std::string& fresh);

  std::string path_;
  FileCalls& calls_;
  bool is_good_ = false;              // FILE holds something worth keeping as the previous one
  bool is_previous_damaged_ = false;  // FILE.previous, which people may want to see
};

}  // namespace bmu

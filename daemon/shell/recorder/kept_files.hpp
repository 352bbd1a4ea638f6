// The files of one kind in a folder: the oldest are removed when there are too many or they are too large.
//
// The name alone identifies a file: PREFIX, the time of its start (UTC, so that names sort by it), its subject,
// ".log.zst". Nothing else in the folder is ever touched.
//
// The oldest is the file that was started first, whatever the clock showed: a machine without a clock of its own starts
// in 1970 each time, or at the time of its switch-off, and a clock may be set back. A file with a time before that of
// the newest in the folder has that one's time in its name as well, and a number that counts such files:
//
//   drive-20261122T231500.123Z.log.zst
//   drive-19700101T000012.345Z-after-20261122T231500.123Z-1.log.zst      started later
//   drive-19700101T000004.100Z-after-20261122T231500.123Z-2.log.zst      and this one by the next start
//
// So a recording that starts before the clock is set stays for as long as its neighbours. The modification time is less
// reliable: without a clock that is 1970, too, and a copy has another one. A name of 1970 alone, which was the first in
// its folder or is of an earlier version, counts as the oldest.
//
// All functions wait for the disk. Not for the thread of the control loop.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/shell/recorder/append_file.hpp"
#include "daemon/shell/system/os_error.hpp"
#include "protocol/result.hpp"

namespace bmu {

struct KeptFilesLimits {
  std::size_t count_max = 0;      // 0: any number
  std::uint64_t total_bytes = 0;  // 0: any size
};

struct KeptFile {
  std::string name;  // without the folder
  std::uint64_t size_bytes = 0;
};

class KeptFiles {
 public:
  KeptFiles(std::string folder, std::string prefix) : folder_(std::move(folder)), prefix_(std::move(prefix)) {}

  /// Creates "FOLDER/PREFIX-20261122T231500.123Z-WORD.log.zst", with the file that it follows if its time does not show
  /// the order. An empty word has no dash before it; letters of the word become lower case, and other characters than a
  /// to z, 0 to 9 and - become -. If the name exists, "-2" and so on follows. An error if the folder cannot be read.
  [[nodiscard]] Result<AppendFile, OsError> create(std::int64_t unix_time_us, std::string_view word = {}) const;
  /// In the order of their start. An error if the folder cannot be read.
  [[nodiscard]] Result<std::vector<KeptFile>, OsError> list() const;
  /// Removes the oldest files until `room_bytes` and one more file fit into the limits; those with `first` in their
  /// names before all others. The newest stays.
  [[nodiscard]] Result<void, OsError> make_room(const KeptFilesLimits& limits, std::uint64_t room_bytes,
                                                std::string_view first = {}) const;
  [[nodiscard]] const std::string& folder() const { return folder_; }

 private:
  [[nodiscard]] std::string path_of(const std::string& times, std::string_view word) const;

  std::string folder_;
  std::string prefix_;
};

}  // namespace bmu

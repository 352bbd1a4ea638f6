// The files of one kind in a folder, of which the oldest go when there are too many or they are too large.
//
// Files are told apart by their names alone: PREFIX, the time they began (UTC, so that names sort by it), what they
// are of, ".log.zst". Nothing else in the folder is ever touched.
//
// The oldest is the file that was begun first, whatever the clock showed: a machine without a clock of its own begins
// each start in 1970, or where it was switched off, and a clock may be set back. A file whose time is before that of
// the newest in the folder has that one's time in its name as well, and a number that counts such files:
//
//   drive-20261122T231500.123Z.log.zst
//   drive-19700101T000012.345Z-after-20261122T231500.123Z-1.log.zst      begun later, as is
//   drive-19700101T000004.100Z-after-20261122T231500.123Z-2.log.zst      that of the next start
//
// So a recording that begins before the clock is set stays for as long as its neighbours. The time at which a file was
// changed last says less: without a clock that is 1970, too, and of a copy it is another one. A name of 1970 alone,
// which was the first in its folder or is of an earlier version, counts as the oldest.
//
// Everything here waits for the disk. Not for the control loop's thread.
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

  /// A new file, "FOLDER/PREFIX-20261122T231500.123Z-WORD.log.zst", with what it comes after if its time does not show
  /// that. No word, no dash before it; of the word other letters than a to z, 0 to 9 and - become -. Where there is one
  /// of that name, "-2" and so on follows. An error if the folder cannot be read.
  [[nodiscard]] Result<AppendFile, OsError> create(std::int64_t unix_time_us, std::string_view word = {}) const;
  /// In the order in which they were begun. An error if the folder cannot be read.
  [[nodiscard]] Result<std::vector<KeptFile>, OsError> list() const;
  /// Removes the oldest until `room_bytes` and one more file fit into the limits; those whose names contain `first`
  /// before all others. The newest stays.
  [[nodiscard]] Result<void, OsError> make_room(const KeptFilesLimits& limits, std::uint64_t room_bytes,
                                                std::string_view first = {}) const;
  [[nodiscard]] const std::string& folder() const { return folder_; }

 private:
  [[nodiscard]] std::string path_of(const std::string& times, std::string_view word) const;

  std::string folder_;
  std::string prefix_;
};

}  // namespace bmu

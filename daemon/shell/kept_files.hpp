// The files of one kind in a folder, of which the oldest go when there are too many or they are too large.
//
// Files are told apart by their names alone: PREFIX, the time they began (UTC, so that names sort by it), what they
// are of, ".log.zst". Nothing else in the folder is ever touched. A machine that does not know the time at its start
// gives names of 1970; those count as the oldest.
//
// Everything here waits for the disk. Not for the control loop's thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/shell/append_file.hpp"
#include "daemon/shell/os_error.hpp"
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

  /// "FOLDER/PREFIX-20261122T231500.123Z-WORD.log.zst"; no word, no dash before it. Letters other than a to z, 0 to 9
  /// and - become -.
  [[nodiscard]] std::string path_for(std::int64_t unix_time_us, std::string_view word = {}) const;
  /// A new file of that name, or where there is one, with "-2" and so on behind it.
  [[nodiscard]] Result<AppendFile, OsError> create(std::int64_t unix_time_us, std::string_view word = {}) const;
  /// The oldest first. An error if the folder cannot be read.
  [[nodiscard]] Result<std::vector<KeptFile>, OsError> list() const;
  /// Removes the oldest until `room_bytes` and one more file fit into the limits; those whose names contain `first`
  /// before all others. The newest stays.
  [[nodiscard]] Result<void, OsError> make_room(const KeptFilesLimits& limits, std::uint64_t room_bytes,
                                                std::string_view first = {}) const;
  [[nodiscard]] const std::string& folder() const { return folder_; }

 private:
  std::string folder_;
  std::string prefix_;
};

}  // namespace bmu

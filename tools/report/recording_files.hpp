// The files of a report: recordings and black boxes in the order of their times, each read as far as it is valid, and
// resumed with the next part after damage.
//
//   const auto files = in_order_of_time({"drive-2.log.zst", "drive-1.log.zst"});
//   if (!files) return complain(files.error());
//   for (const RecordingFile& file : files->recordings) read_recording(file, reading, progress);
//
// The missing data of each file is in the report's gaps (data.hpp), with line, offset and time.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "protocol/result.hpp"
#include "tools/report/from_recording.hpp"

namespace bmu::report {

struct RecordingFile {
  std::string path;  // "-": standard input
  std::int64_t first_us = 0;
};

struct RecordingFiles {
  std::vector<RecordingFile> recordings;  // at least one
  std::vector<std::string> left_out;      // a sentence each: not a recording
};

/// Reads the time of the first line of each file; if its clock had not been set then (it shows 1970), also the change
/// of the clock later in the same session of the daemon. A single file is accepted unchecked. The error names a file
/// that cannot be read, or states that none of them is a recording.
[[nodiscard]] Result<RecordingFiles, std::string> in_order_of_time(const std::vector<std::string>& paths);

/// Reads all that can be read. The error: the system cannot read the file. `progress` receives the bytes of text.
[[nodiscard]] Result<void, std::string> read_recording(const RecordingFile& file, RecordingReport& reading,
                                                       const std::function<void(std::size_t bytes)>& progress);

}  // namespace bmu::report

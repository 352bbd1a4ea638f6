// The files of a report: recordings and black boxes in the order of their times, each read as far as it is good, and on
// behind what is damaged with the next part.
//
//   const auto files = in_order_of_time({"drive-2.log.zst", "drive-1.log.zst"});
//   if (!files) return complain(files.error());
//   for (const RecordingFile& file : files->recordings) read_recording(file, reading, progress);
//
// What each of them lacks is in the report's holes (data.hpp), with line, offset and time.
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
  std::vector<std::string> left_out;      // a sentence each: no recording
};

/// Looks into each of them for the time of its first line, of one whose clock had not been set then (it shows 1970)
/// also for how far it was set later in the same life of the daemon. A single one is taken whatever it is. The error
/// names a file that cannot be read, or says that none of them is a recording.
[[nodiscard]] Result<RecordingFiles, std::string> in_order_of_time(const std::vector<std::string>& paths);

/// All that can be read of it. The error: the system would not read it. `progress` is told bytes of text.
[[nodiscard]] Result<void, std::string> read_recording(const RecordingFile& file, RecordingReport& reading,
                                                       const std::function<void(std::size_t bytes)>& progress);

}  // namespace bmu::report

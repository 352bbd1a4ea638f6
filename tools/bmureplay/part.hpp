// A recording cut into its parts, each of which can be run on its own (record_writer.hpp).
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "daemon/shell/system/owned_fd.hpp"
#include "tools/common/line_reader.hpp"

namespace bmu::replay {

/// A range that could not be read or run.
struct Damage {
  std::string file;
  std::uint64_t line = 0;  // 0: the file as a whole, or an offset that `text` names
  std::string text;
  std::uint64_t goes_on_line = 0;  // line of the next part that was read; 0: none, or nothing was omitted
  std::int64_t not_run_us = 0;     // of the recording's time, up to goes_on_line or the end of the file; 0: unknown
};

struct Part {
  std::string file;
  std::uint64_t first_line = 1;  // of the file
  std::string text;              // whole lines with their line feeds
  bool ends_torn = false;        // the lines after it are missing
};

/// Maximum size of a part: of a longer one only the beginning is used, and the lines up to the next part are omitted
/// and reported. Parts from the daemon stay below 100 MB: a head of 4 MB; lines of 30 s, and of the minute that its
/// thread may lag, at no more than 1 MB per second (RecordFeedOptions).
inline constexpr std::size_t part_bytes_max = std::size_t{256} << 20;
/// Maximum number of reported damages; a longer list is useless to a reader.
inline constexpr std::size_t damages_max = 1'000;

class PartReader {
 public:
  explicit PartReader(const std::vector<std::string>& files, std::size_t bytes_max = part_bytes_max)
      : files_(files.begin(), files.end()), bytes_max_(bytes_max) {}

  /// The next part; notes before the first head of a file belong to its first part, and lines without their part's head
  /// form a part too. None: everything is read.
  [[nodiscard]] std::optional<Part> next();
  [[nodiscard]] const std::vector<Damage>& damages() const { return damages_; }
  /// True if a file could not be opened or read at all.
  [[nodiscard]] bool has_failed() const { return has_failed_; }

 private:
  [[nodiscard]] bool open_next();
  [[nodiscard]] bool take_lines();
  void tell(Damage damage);
  void end_hole();
  void end_file();

  std::deque<std::string> files_;
  std::size_t bytes_max_;
  std::string name_;
  OwnedFd fd_;
  std::unique_ptr<LineReader> reader_;
  Part growing_;
  std::optional<Part> whole_;
  std::vector<Damage> damages_;
  bool is_in_hole_ = false;  // lines are missing, and the following ones cannot be run before the next head
  bool is_in_part_ = false;  // growing_ contains more than notes
  bool has_failed_ = false;
};

}  // namespace bmu::replay

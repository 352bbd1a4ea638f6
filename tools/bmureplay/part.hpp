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

/// A place that could not be read, or not be run.
struct Damage {
  std::string file;
  std::uint64_t line = 0;  // 0: the file as a whole, or an offset that `text` names
  std::string text;
  std::uint64_t goes_on_line = 0;  // of the part that was read next; 0: none, or nothing was left out
  std::int64_t not_run_us = 0;     // of the recording's time, from here to there or to the file's end; 0: not known
};

struct Part {
  std::string file;
  std::uint64_t first_line = 1;  // of the file
  std::string text;              // whole lines with their line feeds
  bool ends_torn = false;        // lines behind it are missing
};

/// No part is larger: of one that goes on, the beginning is taken, and what follows up to the next part is left out and
/// told. What the daemon writes stays below 100 MB: a head of 4 MB; lines of 30 s, and of the minute that its thread
/// may be behind, at no more than 1 MB a second (RecordFeedOptions).
inline constexpr std::size_t part_bytes_max = std::size_t{256} << 20;
/// So many damages are told; of a file that is full of them nobody reads more.
inline constexpr std::size_t damages_max = 1'000;

class PartReader {
 public:
  explicit PartReader(const std::vector<std::string>& files, std::size_t bytes_max = part_bytes_max)
      : files_(files.begin(), files.end()), bytes_max_(bytes_max) {}

  /// The next part; notes before the first head of a file belong to its first part, and what is of a part whose head is
  /// missing is one. None: all is read.
  [[nodiscard]] std::optional<Part> next();
  [[nodiscard]] const std::vector<Damage>& damages() const { return damages_; }
  /// A file could not be opened or read at all.
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
  bool is_in_hole_ = false;  // lines are missing, and what comes cannot be run before the next head
  bool is_in_part_ = false;  // what grows is more than notes
  bool has_failed_ = false;
};

}  // namespace bmu::replay

// A recording cut into its parts, each of which can be run on its own (record_writer.hpp).
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "daemon/shell/owned_fd.hpp"
#include "tools/common/line_reader.hpp"

namespace bmu::replay {

/// A place that could not be read, or not be run.
struct Damage {
  std::string file;
  std::uint64_t line = 0;  // 0: the file as a whole, or an offset that `text` names
  std::string text;
};

struct Part {
  std::string file;
  std::uint64_t first_line = 1;  // of the file
  std::string text;              // whole lines with their line feeds
  bool ends_torn = false;        // lines behind it are missing
};

class PartReader {
 public:
  explicit PartReader(std::vector<std::string> files) : files_(files.begin(), files.end()) {}

  /// The next part; what comes before the first head of a file belongs to its first part. None: all is read.
  [[nodiscard]] std::optional<Part> next();
  [[nodiscard]] const std::vector<Damage>& damages() const { return damages_; }
  /// A file could not be opened or read at all.
  [[nodiscard]] bool has_failed() const { return has_failed_; }

 private:
  [[nodiscard]] bool open_next();
  [[nodiscard]] bool take_lines();
  void end_file();

  std::deque<std::string> files_;
  std::string name_;
  OwnedFd fd_;
  std::unique_ptr<LineReader> reader_;
  Part growing_;
  std::optional<Part> whole_;
  std::vector<Damage> damages_;
  bool is_in_hole_ = false;  // lines are missing, and what comes cannot be run before the next head
  bool has_head_ = false;    // of what grows
  bool has_failed_ = false;
};

}  // namespace bmu::replay

// Whether the parts of several files, or of one, are one recording: what is missing, twice, in another order or of
// another life of the daemon is said. Each part is run all the same, for it brings what it begins with.
//
// Black boxes overlap, as each begins minutes before what it is for: of one nothing is said about what comes before it.
#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "daemon/recording/record_reader.hpp"

namespace bmu::replay {

/// A part that has been run.
struct PartSpan {
  std::string file;
  std::uint64_t first_line = 1;
  RecordPartId id;
  std::int64_t from_log_us = 0;  // its first time and its last one; 0: it has none
  std::int64_t until_log_us = 0;
  bool is_black_box = false;  // the file is one
};

/// Where a part does not go on from the one before it.
struct Join {
  std::string file;
  std::uint64_t line = 0;
  std::string text;
};

class Joins {
 public:
  /// So many are told.
  static constexpr std::size_t joins_max = 1'000;

  /// One after the other, in the order in which they were given.
  void take(const PartSpan& span);
  [[nodiscard]] const std::vector<Join>& found() const { return found_; }

 private:
  [[nodiscard]] std::string text_of(const PartSpan& span) const;

  std::optional<PartSpan> before_;
  std::set<std::pair<std::int64_t, std::uint64_t>> seen_;
  std::vector<Join> found_;
};

}  // namespace bmu::replay

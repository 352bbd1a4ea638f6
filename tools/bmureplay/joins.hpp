// Whether the parts of several files, or of one, are one recording: what is missing, twice, in another order or of
// another life of the daemon is said. Each part is run all the same, for it brings what it begins with.
//
// Where the clock was set is noted, too, with its size: what lies between two parts of a life of the daemon is measured
// by the core's clock, which is not set.
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
#include "protocol/time.hpp"

namespace bmu::replay {

/// Where the recording's clock was set within a part, by a second or more.
struct ClockSetting {
  std::uint64_t line = 0;  // of the file
  std::int64_t by_us = 0;  // above 0: forward
};

/// A part that has been run.
struct PartSpan {
  std::string file;
  std::uint64_t first_line = 1;
  RecordPartId id;
  std::int64_t from_log_us = 0;  // its first time and its last one; 0: it has none
  std::int64_t until_log_us = 0;
  TimePoint from{};  // the same two on the core's clock, which is not set and goes on through a life of the daemon
  TimePoint until{};
  bool is_black_box = false;  // the file is one
  std::vector<ClockSetting> clock_settings{};

  [[nodiscard]] bool has_times() const { return from_log_us != 0; }
  [[nodiscard]] bool is_of_life(const PartSpan& other) const { return id.life != 0 && id.life == other.id.life; }
};

/// Where a part does not go on from the one before it, or on another clock.
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

  /// What a clock was set by is no less.
  static constexpr std::int64_t clock_setting_min_us = 1'000'000;

 private:
  void add(const std::string& file, std::uint64_t line, const std::string& text);
  [[nodiscard]] std::string text_of(const PartSpan& span) const;

  std::optional<PartSpan> before_;
  std::set<std::pair<std::int64_t, std::uint64_t>> seen_;
  std::vector<Join> found_;
};

}  // namespace bmu::replay

// Checks whether the parts of several files, or of one, form one recording, and reports parts that are missing,
// duplicate, out of order or of another session of the daemon. Each part is run nevertheless, because it contains its
// initial state.
//
// Changes of the wall clock are reported too, with their size: the time between two parts of a session is measured by
// the core's clock, which is never set.
//
// Black boxes overlap, because each starts minutes before its trigger: no discontinuity is reported before one.
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

/// A change of the recording's wall clock within a part, by a second or more.
struct ClockSetting {
  std::uint64_t line = 0;  // of the file
  std::int64_t by_us = 0;  // above 0: forward
};

/// A part that was run.
struct PartSpan {
  std::string file;
  std::uint64_t first_line = 1;
  RecordPartId id;
  std::int64_t from_log_us = 0;  // its first and last time; 0: it has none
  std::int64_t until_log_us = 0;
  TimePoint from{};  // the same two on the core's clock, which is never set and continues through a session
  TimePoint until{};
  bool is_black_box = false;  // the file is a black box
  std::vector<ClockSetting> clock_settings{};

  [[nodiscard]] bool has_times() const { return from_log_us != 0; }
  [[nodiscard]] bool is_of_life(const PartSpan& other) const { return id.life != 0 && id.life == other.id.life; }
};

/// A part that does not continue the one before it, or continues it on a changed clock.
struct Join {
  std::string file;
  std::uint64_t line = 0;
  std::string text;
};

class Joins {
 public:
  /// Maximum number of reported discontinuities.
  static constexpr std::size_t joins_max = 1'000;

  /// Adds the parts one by one, in the order of the command line.
  void take(const PartSpan& span);
  [[nodiscard]] const std::vector<Join>& found() const { return found_; }

  /// Smaller changes of the clock are not reported.
  static constexpr std::int64_t clock_setting_min_us = 1'000'000;

 private:
  void add(const std::string& file, std::uint64_t line, const std::string& text);
  [[nodiscard]] std::string text_of(const PartSpan& span) const;

  std::optional<PartSpan> before_;
  std::set<std::pair<std::int64_t, std::uint64_t>> seen_;
  std::vector<Join> found_;
};

}  // namespace bmu::replay

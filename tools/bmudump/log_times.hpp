// Converts the times of one log to one clock, in any form that candump writes:
//
//   -t a, a log       seconds since 1970, unchanged
//   -t A              a local date of the place of recording, interpreted in this time zone
//   -t z              seconds since the first frame, unchanged
//   -t d              seconds since the line before, accumulated
//   a screen without  none: a frame has a number instead, and the time of the frame before it
//
// A line does not show whether it has differences (-t d) or seconds since the first frame (-t z). The frames of one bus
// are in order: a time that goes back, or stands still twice, is a difference. The exception is after a hundred frames
// of a bus in order, because differences are never so: there the clock was set back (clock_jumps.hpp).
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/candump.hpp"
#include "protocol/candump_screen.hpp"

namespace bmu::dump {

class LogTimes {
 public:
  /// For the first frame with a time: true if all times need no correction. Else take() must be called for each.
  [[nodiscard]] static bool are_absolute(std::string_view line);

  /// Evaluates the time of a later frame, so that the kind of the times is known earlier.
  void look_ahead(const LogLine& line) { note_order(line); }
  void forget_order() {
    buses_.clear();
    are_in_order_ = false;
  }

  /// Corrects the time of `line`, or numbers the line.
  void take(LogLine& line, LogTimeForm form);
  /// Stores the time of each frame, after correction.
  void note(std::int64_t time_us) { last_us_ = time_us; }

  [[nodiscard]] bool are_added_up() const { return are_differences_; }
  [[nodiscard]] bool are_missing() const { return number_ > 0; }

 private:
  struct Bus {
    std::string name;
    std::int64_t last_us;
    bool stood_still;
    std::uint32_t in_order;  // number of consecutive frames in order
  };

  void note_order(const LogLine& line);
  [[nodiscard]] std::int64_t utc_us(std::int64_t local_us);

  std::vector<Bus> buses_;
  bool are_differences_ = false;
  bool are_in_order_ = false;  // many frames are: the times are no differences
  std::int64_t sum_us_ = 0;
  std::int64_t last_us_ = 0;
  std::uint32_t number_ = 0;
  std::int64_t quarter_ = -1;  // quarter of an hour to which offset_s_ applies
  std::int64_t offset_s_ = 0;
};

}  // namespace bmu::dump

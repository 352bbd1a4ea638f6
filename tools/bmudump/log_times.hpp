// The times of one log on one clock, whichever way candump wrote them:
//
//   -t a, a log       seconds since 1970, as they are
//   -t A              a date of the place where the log was written, which is taken for this place
//   -t z              seconds since the first frame, as they are
//   -t d              seconds since the line before, which are added up
//   a screen without  none: a frame has a number instead, and counts for the time of the frame before it
//
// A line does not show whether it has differences (-t d) or seconds since the first frame (-t z). The frames of one bus
// come in order: where a time goes back, or stands still twice, these are differences. Not so behind a hundred frames
// of a bus in their order, as no differences are: there the clock was set back (clock_jumps.hpp).
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
  /// Of the first frame with a time: whether all are as they should be. Else take() has to see each.
  [[nodiscard]] static bool are_absolute(std::string_view line);

  /// A time that a frame behind this one has; shows earlier what its kind is.
  void look_ahead(const LogLine& line) { note_order(line); }
  void forget_order() {
    buses_.clear();
    are_in_order_ = false;
  }

  /// Corrects the time of `line`, or numbers it.
  void take(LogLine& line, LogTimeForm form);
  /// The time of each frame, as it was corrected.
  void note(std::int64_t time_us) { last_us_ = time_us; }

  [[nodiscard]] bool are_added_up() const { return are_differences_; }
  [[nodiscard]] bool are_missing() const { return number_ > 0; }

 private:
  struct Bus {
    std::string name;
    std::int64_t last_us;
    bool stood_still;
    std::uint32_t in_order;  // so many frames behind each other
  };

  void note_order(const LogLine& line);
  [[nodiscard]] std::int64_t utc_us(std::int64_t local_us);

  std::vector<Bus> buses_;
  bool are_differences_ = false;
  bool are_in_order_ = false;  // too many are: these are no differences
  std::int64_t sum_us_ = 0;
  std::int64_t last_us_ = 0;
  std::uint32_t number_ = 0;
  std::int64_t quarter_ = -1;  // of an hour, whose offset is:
  std::int64_t offset_s_ = 0;
};

}  // namespace bmu::dump

// The start of each line: the time in the requested form, the bus, the direction of the frame.
#pragma once

#include <array>
#include <cstdint>
#include <ctime>
#include <optional>

#include "protocol/candump.hpp"
#include "tools/bmudump/text_writer.hpp"

namespace bmu::dump {

/// candump's -t.
enum class TimeForm : std::uint8_t {
  absolute,  // seconds, from the log or the system
  delta,     // since the line before
  zero,      // since the first line
  date,      // local date and time
  none,
};

class LineStart {
 public:
  struct Style {
    TimeForm time = TimeForm::absolute;
    bool has_direction = false;
  };

  explicit LineStart(const Style& style) : style_(style) {}

  void print(const LogLine& line, TextWriter& out);
  /// The log's clock was changed by this much, above 0 forward: the time did not elapse.
  void leave_out(std::int64_t jump_us) {
    if (since_us_) *since_us_ += jump_us;
  }

 private:
  void print_time(std::int64_t time_us, TextWriter& out);
  void print_date(std::int64_t time_us, TextWriter& out);
  void print_fd_flags(const LogLine& line, TextWriter& out);

  Style style_;
  std::size_t bus_width_ = 0;  // names are padded to the longest seen so far
  bool has_fd_flags_ = false;  // a frame of CAN FD was printed: from then on all lines have a column for its flags
  std::optional<std::int64_t> since_us_;
  std::int64_t date_s_ = -1;  // of date_
  std::array<char, 32> date_{};
};

}  // namespace bmu::dump

// Prints the lines of a recording one after another (record_line.hpp), with the state from the lines before. Does not
// allocate, once the string has room, except for the text of events.
#pragma once

#include <cstdint>
#include <string>
#include <utility>

#include "daemon/recording/line_sum.hpp"
#include "daemon/recording/record_line.hpp"

namespace bmu {

class RecordLines {
 public:
  explicit RecordLines(RecordBuses buses) : buses_(std::move(buses)) {}

  /// Starts a part: `unix_time_us` is the wall clock at `now`, `outputs` the commanded outputs of the core.
  void begin(TimePoint now, std::int64_t unix_time_us, const ContactorOutputs& outputs);
  void observed(const Observation& observation, std::string& to);
  void decided(TimePoint at, const Decisions& decisions, std::string& to);
  /// The wall clock has jumped: times follow it from here on.
  void set_wall_clock(TimePoint now, std::int64_t unix_time_us, std::string& to);

  [[nodiscard]] const RecordClock& clock() const { return clock_; }

 private:
  RecordBuses buses_;
  RecordClock clock_;
  ContactorOutputs outputs_;
  LineSum sum_;  // from the latest tick on
};

}  // namespace bmu

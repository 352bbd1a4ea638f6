#include "daemon/recording/record_lines.hpp"

#include <array>
#include <string_view>

namespace bmu {

void RecordLines::begin(TimePoint now, std::int64_t unix_time_us, const ContactorOutputs& outputs) {
  clock_.ahead_us = unix_time_us - RecordClock{}.to_log_us(now);
  outputs_ = outputs;
  sum_ = {};
}

void RecordLines::observed(const Observation& observation, std::string& to) {
  std::array<char, record_line_max> line{};
  const std::string_view text(line.data(), print_observation(observation, clock_, buses_, line));
  sum_.add_lines(text);
  to.append(text);
}

void RecordLines::decided(TimePoint at, const Decisions& decisions, std::string& to) {
  const std::size_t from = to.size();
  append_decisions(to, at, decisions, outputs_, sum_.value(), clock_, buses_);
  sum_ = {};
  sum_.add_lines(std::string_view(to).substr(from));
  outputs_ = decisions.outputs;
}

void RecordLines::set_wall_clock(TimePoint now, std::int64_t unix_time_us, std::string& to) {
  clock_.ahead_us = unix_time_us - RecordClock{}.to_log_us(now);
  const std::string line = "# ahead_us " + std::to_string(clock_.ahead_us) + "\n";
  sum_.add_lines(line);
  to += line;
}

}  // namespace bmu

#include "daemon/recording/record_lines.hpp"

#include <array>

namespace bmu {

void RecordLines::begin(TimePoint now, std::int64_t unix_time_us, const ContactorOutputs& outputs) {
  clock_.ahead_us = unix_time_us - RecordClock{}.to_log_us(now);
  outputs_ = outputs;
}

void RecordLines::observed(const Observation& observation, std::string& to) const {
  std::array<char, record_line_max> line{};
  to.append(line.data(), print_observation(observation, clock_, buses_, line));
}

void RecordLines::decided(TimePoint at, const Decisions& decisions, std::string& to) {
  append_decisions(to, at, decisions, outputs_, clock_, buses_);
  outputs_ = decisions.outputs;
}

void RecordLines::set_wall_clock(TimePoint now, std::int64_t unix_time_us, std::string& to) {
  clock_.ahead_us = unix_time_us - RecordClock{}.to_log_us(now);
  to += "# ahead_us " + std::to_string(clock_.ahead_us) + "\n";
}

}  // namespace bmu

#include "tools/bmudump/clock_jumps.hpp"

#include "tools/common/clock_set.hpp"

namespace bmu::dump {

ClockJump ClockJumps::jump_before(std::size_t bus, std::int64_t time_us) const {
  if (frames_ == 0) return {};
  const std::int64_t steady_us = time_us - left_out_us_;
  const std::int64_t step_us = steady_us - latest_us_;
  const Bus& before = buses_[bus];
  const bool is_back = before.frames >= back_min_frames && steady_us < before.latest_us - back_min_us;
  const bool is_first_setting = !is_clock_set(latest_us_ + left_out_us_) && is_clock_set(time_us);
  if (is_back || is_first_setting) return {.by_us = step_us};
  const bool is_forward =
      frames_ >= forward_min_frames && step_us >= forward_min_us && step_us / forward_min_longest >= longest_us_;
  return is_forward ? ClockJump{.by_us = step_us, .is_certain = false} : ClockJump{};
}

ClockJump ClockJumps::take_unusual(std::size_t bus, std::int64_t time_us) {
  const ClockJump jump = jump_before(bus, time_us);
  left_out_us_ += jump.by_us;
  count_ += jump.is_found() ? 1U : 0U;
  note(bus, time_us - left_out_us_);
  return jump;
}

}  // namespace bmu::dump

#include "protocol/ir155_capture.hpp"

#include <algorithm>
#include <chrono>

#include "protocol/units.hpp"

namespace bmu::ir155 {

namespace {

constexpr std::int64_t millihertz_period_ns = 1'000'000'000'000;  // 1000 s
constexpr std::int64_t frequency_max_mHz = 1'000'000'000;         // above any frequency of an input

}  // namespace

void Capture::begin(bool is_high) {
  *this = {};
  last_.is_high = is_high;
}

void Capture::observe(const Edge& edge) {
  last_.is_high = edge.is_rising;
  if (edge.is_after_loss) {
    rose_at_.reset();
    fell_at_.reset();
  }
  if (!edge.is_rising) {
    if (fell_at_) rose_at_.reset();  // the rise in between was lost
    fell_at_ = edge.at;
    return;
  }
  if (rose_at_ && fell_at_) take_period(*rose_at_, *fell_at_, edge.at);
  rose_at_ = edge.at;
  fell_at_.reset();
}

void Capture::take_period(TimePoint rose_at, TimePoint fell_at, TimePoint ended_at) {
  const Duration period = ended_at - rose_at;
  const Duration high = fell_at - rose_at;
  const bool is_in_order = Duration{} <= high && high <= period && period > Duration{};
  if (!is_in_order || period > edge_silence_max) return;
  const std::int64_t frequency_mHz = divide_to_nearest(millihertz_period_ns, period.count());
  last_.frequency_mHz = static_cast<std::int32_t>(std::min(frequency_mHz, frequency_max_mHz));
  last_.duty_permille = static_cast<std::int32_t>(divide_to_nearest(high.count() * 1'000, period.count()));
  ended_at_ = ended_at;
}

Pwm Capture::pwm(TimePoint now) const {
  Pwm pwm = last_;
  if (pwm.frequency_mHz > 0) pwm.since_edge = std::chrono::ceil<std::chrono::microseconds>(now - ended_at_);
  pwm.since_edge = std::max(pwm.since_edge, Duration{});
  return pwm;
}

}  // namespace bmu::ir155

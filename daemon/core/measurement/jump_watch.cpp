#include "daemon/core/measurement/jump_watch.hpp"

#include <algorithm>
#include <cstdlib>

#include "protocol/tables/internal_bus.hpp"

namespace bmu {

namespace {

/// Margin for a module clock that is slow by this much per sampling period.
constexpr Duration clock_margin = 5ms;
constexpr Duration next_sample_after = internal_bus::temperature_sampling_period + clock_margin;
/// Maximum age of an accepted value for judging a jump: older, it does not bound a later value. Also the maximum
/// duration of an implausible state.
constexpr Duration former_max = 1s;
/// Accumulated implausible time from which on the sensor counts as not measured.
constexpr Duration doubt_max = 1s;

}  // namespace

Measured<std::int32_t> JumpWatch::take(const Measured<std::int32_t>& told_dC, TimePoint polled_at) {
  const Duration since = std::min(told_dC.taken_at - told_at_, former_max);
  doubted_for_ += doubted_since_ != TimePoint{} ? since : -since / 2;
  doubted_for_ = std::clamp(doubted_for_, Duration{}, doubt_max);
  told_at_ = told_dC.taken_at;
  if (!told_dC.is_valid()) {
    doubted_since_ = {};
    return told_dC;
  }
  judge(told_dC, polled_at);
  if (doubted_since_ == TimePoint{}) return believed_dC_ = told_dC;
  return {told_dC.value, told_dC.taken_at, doubted_for_ < doubt_max ? Validity::doubtful : Validity::unknown};
}

/// Updates whether the value is implausible, and since when.
void JumpWatch::judge(const Measured<std::int32_t>& told_dC, TimePoint polled_at) {
  const std::int32_t jump_dC = told_dC.value - believed_dC_.value;
  const bool is_jump = believed_dC_.is_fresh(told_dC.taken_at, former_max) && std::abs(jump_dC) > temperature_jump_dC;
  const bool is_upwards = jump_dC > 0;
  const bool is_other_way = doubted_since_ == TimePoint{} || is_upwards != is_upwards_;
  if (!is_jump || (!is_other_way && polled_at - doubted_since_ >= next_sample_after)) {
    doubted_since_ = {};
  } else if (is_other_way) {
    doubted_since_ = told_dC.taken_at;
    is_upwards_ = is_upwards;
  }
}

bool JumpWatch::is_worth_asking(TimePoint now) const {
  const Duration in_doubt = now - doubted_since_;
  return doubted_since_ != TimePoint{} && in_doubt >= next_sample_after && in_doubt < former_max;
}

}  // namespace bmu

// Filter for temperature jumps. No cell and no board warms or cools by more than 5 K in the half second between two
// samples of a module: a runaway warms by kelvins per second, and a larger jump is a disturbed conversion or a loose
// wire. But a module repeats a sample in every answer until it takes the next, so a second answer alone confirms
// nothing.
//
//   sample      25     |     65     |     65     |
//   received 25 25 25 25 65 65 65 65 65 65 65 65 65
//                        '- implausible -'  accepted: polled more than a sampling period after it was first received
//
// A jump is `doubtful` (implausible) until an answer that can only contain a later sample confirms it. An implausible
// value counts neither as passed nor as failed, and is not "not measured": other values decide in the meantime. A value
// that is implausible for more than a third of the time over a longer period, as with a loose wire of the sensor, is
// not measured. A change of no more than 5 K per sample is accepted immediately.
#pragma once

#include <cstdint>

#include "daemon/core/types/measured.hpp"
#include "protocol/fields.hpp"

namespace bmu {

/// A larger difference between two samples is a jump: ten times the default fault threshold of limits.temperature_rise.
inline constexpr std::int32_t temperature_jump_dC = 50;

class JumpWatch {
 public:
  /// Filters a value of the sensor, in dC, as received (taken_at: when), with the time of the POLL that it answers.
  /// Returns the value for use: unchanged, or `doubtful`; `unknown` once it has been implausible too often.
  [[nodiscard]] Measured<std::int32_t> take(const Measured<std::int32_t>& told_dC, TimePoint polled_at);
  /// A poll now yields a sample that confirms or clears the implausible value; a module that does not answer is not
  /// polled permanently.
  [[nodiscard]] bool is_worth_asking(TimePoint now) const;

 private:
  void judge(const Measured<std::int32_t>& told_dC, TimePoint polled_at);

  Measured<std::int32_t> believed_dC_;
  TimePoint told_at_{};
  TimePoint doubted_since_{};  // when the jump was first received; zero: none
  bool is_upwards_ = false;
  Duration doubted_for_{};  // grows while implausible, shrinks at half the rate otherwise
  BMU_FIELDS(believed_dC_, told_at_, doubted_since_, is_upwards_, doubted_for_)
};

}  // namespace bmu

// Temperatures that jump. No cell and no board warms or cools by more than 5 K in the half second between two samples
// of a module: a runaway warms by kelvins a second, and what jumps further is a disturbed conversion or a loose wire.
// But a module repeats a sample to every POLL until it takes the next, so a second answer proves nothing yet.
//
//   sample      25     |     65     |     65     |
//   told     25 25 25 25 65 65 65 65 65 65 65 65 65
//                        '--- doubtful --'  believed: asked for more than a sampling period after it was first told
//
// A jump is doubtful until an answer that can only hold a later sample says so, too. Doubtful is neither good nor bad,
// and not "not measured": other values decide meanwhile. A value that is doubtful for more than a third of the time for
// long, as a sensor with a loose wire makes it, is not measured. What moves by no more than 5 K a sample is believed at
// once.
#pragma once

#include <cstdint>

#include "daemon/core/types/measured.hpp"
#include "protocol/fields.hpp"

namespace bmu {

/// More than this between two samples is a jump: ten times what limits.temperature_rise calls a fault by default.
inline constexpr std::int32_t temperature_jump_dC = 50;

class JumpWatch {
 public:
  /// A value of the sensor, in dC, as it came (taken_at: when), and when the POLL that it answers was sent. As it may
  /// be used: itself, or `doubtful`; `unknown` once it has been doubtful too often.
  [[nodiscard]] Measured<std::int32_t> take(const Measured<std::int32_t>& told_dC, TimePoint polled_at);
  /// Asked now, the module tells a sample that ends the doubt; one that does not answer is not asked for ever.
  [[nodiscard]] bool is_worth_asking(TimePoint now) const;

 private:
  void judge(const Measured<std::int32_t>& told_dC, TimePoint polled_at);

  Measured<std::int32_t> believed_dC_;
  TimePoint told_at_{};
  TimePoint doubted_since_{};  // when the jump was first told; zero: no doubt
  bool is_upwards_ = false;
  Duration doubted_for_{};  // grows in doubt, shrinks half as fast without
  BMU_FIELDS(believed_dC_, told_at_, doubted_since_, is_upwards_, doubted_for_)
};

}  // namespace bmu

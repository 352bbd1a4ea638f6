// When modules of another maker are asked: all of them once a period, those with a question each in one go.
//
// A start begins with rounds that ask for nothing, as their own master does (ModuleDriver::start_rounds); so does
// whatever counts as a start: the bus was away, we were stopped, the pack had rested.
//
// A module of another maker bleeds for as long as it was last told to, some of them for ever: who leaves asks whether
// they have been told to stop. What the bus did not take has told nobody.
//
// Cost: a compare a tick.
#pragma once

#include <cstdint>

#include "devices/module_driver.hpp"
#include "protocol/fields.hpp"
#include "protocol/time.hpp"

namespace bmu {

class ModuleRounds {
 public:
  void init(std::uint8_t start_rounds, TimePoint started_at) {
    start_rounds_ = start_rounds;
    start_over(started_at);
  }
  void start_over(TimePoint at) {
    count_ = 0;
    next_at_ = at;
  }
  /// Whether a round is due now; a period that became shorter counts from the last one on, and after a gap there is no
  /// burst to catch up.
  [[nodiscard]] bool is_due(TimePoint now, Duration period) {
    if (count_ > 0 && last_at_ + period < next_at_) next_at_ = last_at_ + period;
    if (now < next_at_) return false;
    next_at_ += period;
    if (next_at_ <= now) next_at_ = now + period;
    return true;
  }
  /// It is asked now, and told to bleed or not to.
  void begin(TimePoint now, bool is_told_to_bleed) {
    last_at_ = now;
    ++count_;
    was_told_to_bleed_ = is_told_to_bleed_;
    is_told_to_bleed_ = is_told_to_bleed;
  }
  /// A question of the last round did not get out: who was to hear it goes by the round before.
  void note_failed() { is_told_to_bleed_ = is_told_to_bleed_ || was_told_to_bleed_; }
  /// None goes on bleeding, for all that is known, when it hears nothing more: the last round said so, and the tick
  /// after it has not heard that it did not get out.
  [[nodiscard]] bool have_stopped_bleeding(TimePoint now) const {
    return !is_told_to_bleed_ && (count_ == 0 || last_at_ < now);
  }
  /// Rounds since the start; the number of the next one.
  [[nodiscard]] std::uint32_t count() const { return count_; }
  [[nodiscard]] bool is_start() const { return count_ < start_rounds_; }

 private:
  std::uint8_t start_rounds_ = 0;
  std::uint32_t count_ = 0;
  TimePoint last_at_{};
  TimePoint next_at_{};
  bool is_told_to_bleed_ = false;   // by the last round
  bool was_told_to_bleed_ = false;  // by the round before
  BMU_FIELDS(skipped(start_rounds_), count_, last_at_, next_at_, is_told_to_bleed_, was_told_to_bleed_)
};

}  // namespace bmu

// Poll rounds for modules of another manufacturer: all modules once a period; if each needs a poll of its own, all
// polls in one tick.
//
// A start begins with rounds that request nothing, as the manufacturer's master does (ModuleDriver::start_rounds); so
// does everything that counts as a start: the bus was down, the control loop stalled, the pack was asleep.
//
// A module of another manufacturer bleeds for the time of its last command, some of them permanently: a shutdown waits
// until they have been commanded to stop. A frame that the bus did not accept has commanded no module.
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
  /// Whether a round is due now; a period that became shorter counts from the last round on, and after a gap there is
  /// no burst to catch up.
  [[nodiscard]] bool is_due(TimePoint now, Duration period) {
    if (count_ > 0 && last_at_ + period < next_at_) next_at_ = last_at_ + period;
    if (now < next_at_) return false;
    next_at_ += period;
    if (next_at_ <= now) next_at_ = now + period;
    return true;
  }
  /// The round is sent now, with or without the command to bleed.
  void begin(TimePoint now, bool is_told_to_bleed) {
    last_at_ = now;
    ++count_;
    was_told_to_bleed_ = is_told_to_bleed_;
    is_told_to_bleed_ = is_told_to_bleed;
  }
  /// A poll of the last round was not sent: for its module the command of the round before still applies.
  void note_failed() { is_told_to_bleed_ = is_told_to_bleed_ || was_told_to_bleed_; }
  /// As far as is known, no module continues to bleed if it receives nothing more: the last round commanded a stop, and
  /// no failure to send it was reported until the tick after it.
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
  bool is_told_to_bleed_ = false;   // in the last round
  bool was_told_to_bleed_ = false;  // in the round before
  BMU_FIELDS(skipped(start_rounds_), count_, last_at_, next_at_, is_told_to_bleed_, was_told_to_bleed_)
};

}  // namespace bmu

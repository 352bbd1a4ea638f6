// Poll rate of the modules: as high as the state of the pack requires.
//
//   fast     poll.fast_period_ms    a fault is pending; or a pack that is not open is near a limit, or its current
//                                   changes quickly. Held for two seconds, so that the rate does not alternate.
//   active   poll.period_ms         contactors commanded; a close request is present or possible at any time (key on,
//                                   charger connected); cells are bled, which modules end after a second without POLL;
//                                   a value is near a limit or missing, or a module is not configured; or any of these
//                                   within 10 s
//   parked   poll.parked_period_ms  none of these for 10 s: open, complete, no fault pending, no request possible
//
// A rate without a period is not used. Asleep after an undervoltage no module is polled (rest_mode.hpp).
//
// Guarantees: reaction times are based on `active`, against which every age and confirm time is checked. At `parked`,
// the ages allow for the slow period; a value beyond its limit causes a single poll in the very next tick, at the fast
// rate; and a close request waits until complete cycles at the rate of that time have provided fresh values, as after a
// start (ModuleTable::requalify).
#pragma once

#include <cstdint>
#include <string_view>

#include "daemon/core/types/core_config.hpp"
#include "protocol/fields.hpp"
#include "protocol/time.hpp"

namespace bmu {

enum class PollPace : std::uint8_t { fast, active, parked };

[[nodiscard]] std::string_view to_text(PollPace pace);

struct PaceInputs {
  TimePoint now{};
  bool is_open = true;           // no contactor is commanded closed
  bool is_wanted = false;        // close request present or possible, or node assignment active
  bool is_bleeding = false;      // a balancing switch is on, or commanded on
  bool is_settled = false;       // every module answers, is identified and configured
  bool is_suspected = false;     // a fault is pending
  bool is_near_limit = false;    // beyond a warning threshold
  bool changes_current = false;  // by a current step, within a short time
};

class PollPacer {
 public:
  static constexpr Duration fast_for = 2s;
  static constexpr Duration parked_after = 10s;

  void init(const PollConfig& config, TimePoint started_at);
  /// One tick. Returns the new poll rate.
  PollPace step(const PaceInputs& in);
  /// As after a start: all values are unknown.
  void start_over(TimePoint at);

  [[nodiscard]] PollPace pace() const { return pace_; }
  [[nodiscard]] TimePoint since() const { return since_; }
  [[nodiscard]] Duration period() const;

 private:
  [[nodiscard]] PollPace next(TimePoint now) const;

  PollConfig config_;
  PollPace pace_ = PollPace::active;
  TimePoint since_{};
  TimePoint hurried_at_{};  // the last reason for `fast`; zero: none yet
  TimePoint busy_at_{};     // the last reason against `parked`
  BMU_FIELDS(skipped(config_), pace_, since_, hurried_at_, busy_at_)
};

/// Ages that apply at a poll rate: those of the configuration, or the time of two slow periods and an answer.
[[nodiscard]] AgeConfig ages_at(PollPace pace, const AgeConfig& configured, const PollConfig& poll);

}  // namespace bmu

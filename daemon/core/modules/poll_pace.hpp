// How fast the modules are asked: as fast as what happens in the pack wants it.
//
//   fast     poll.fast_period_ms    something is suspected; or a pack that is not open is near a limit, or its current
//                                   changes quickly. For two seconds more, so that the pace does not flutter.
//   active   poll.period_ms         contactors commanded, somebody asks or could ask at any moment (key on, charger
//                                   there), cells are bled, which modules end after a second without POLL, something is
//                                   near a limit, missing or not set up, or was within 10 s
//   parked   poll.parked_period_ms  none of these for 10 s: open, complete, good, and nobody there
//
// A pace without a period of its own is not entered. Asleep after an undervoltage nobody is polled at all
// (rest_mode.hpp).
//
// What may not suffer by it: reaction times count from `active`, which every age and confirm time is checked against.
// Parked, the ages allow what the slow period brings; a value beyond its limit makes the very next tick ask again, at
// the fast pace; and whoever asks for a closed pack waits until complete cycles at the pace of then have told fresh
// values, as after a start (ModuleTable::requalify).
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
  bool is_open = true;           // nothing is commanded closed
  bool is_wanted = false;        // somebody asks, could ask, or gives a node number
  bool is_bleeding = false;      // a balancing switch is on, or told to be
  bool is_settled = false;       // every module answers, is identified and set up; no fault is present
  bool is_suspected = false;     // a fault is, that is not yet believed
  bool is_near_limit = false;    // beyond a warning
  bool changes_current = false;  // by a step's worth, within a moment
};

class PollPacer {
 public:
  static constexpr Duration fast_for = 2s;
  static constexpr Duration parked_after = 10s;

  void init(const PollConfig& config, TimePoint started_at);
  /// One tick. Returns the pace from now on.
  PollPace step(const PaceInputs& in);
  /// Nothing is known any more: as after a start.
  void start_over(TimePoint at);

  [[nodiscard]] PollPace pace() const { return pace_; }
  [[nodiscard]] TimePoint since() const { return since_; }
  [[nodiscard]] Duration period() const;

 private:
  [[nodiscard]] PollPace next(TimePoint now) const;

  PollConfig config_;
  PollPace pace_ = PollPace::active;
  TimePoint since_{};
  TimePoint hurried_at_{};  // the last reason to be fast; zero: none yet
  TimePoint busy_at_{};     // the last reason not to be parked
  BMU_FIELDS(skipped(config_), pace_, since_, hurried_at_, busy_at_)
};

/// The ages that hold at a pace: those of the configuration, or what two of the slow periods and an answer take.
[[nodiscard]] AgeConfig ages_at(PollPace pace, const AgeConfig& configured, const PollConfig& poll);

}  // namespace bmu

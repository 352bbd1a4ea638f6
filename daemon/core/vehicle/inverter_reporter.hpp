// What an inverter is told of the pack: how much may flow, how full it is, what it measures and what is wrong with it;
// round by round, a frame every 10 ms.
//
// What may flow is the smallest of what the pack may give and take for long, as an inverter does, and what the pack
// file allows it; nothing while the pack is not closed and permitted to stay so, while a fault asks for no current,
// while the picture of the cells has a hole or the current is not known, and, where the pack file wants it so, while
// the inverter is not heard. A limit that falls is told as soon as the inverter may be told again; one that rises, with
// the next round: how fast it rises is the ramp's (limit_ramp.hpp). What did not get out has not been told: it is told
// again as soon.
//
// What is not known is told as the form documents or its frame is left out; it never leaves as a good number.
//
// Cost: some comparisons a tick; a look through the table of faults for each frame.
#pragma once

#include <cstdint>
#include <optional>

#include "daemon/core/contactors/permission.hpp"
#include "daemon/core/estimation/pack_estimate.hpp"
#include "daemon/core/faults/fault_memory.hpp"
#include "daemon/core/limits/limits.hpp"
#include "daemon/core/measurement/pack_state.hpp"
#include "daemon/core/types/core_config.hpp"
#include "devices/inverter.hpp"
#include "protocol/fields.hpp"

namespace bmu {

struct InverterView {
  TimePoint now{};
  bool may_charge = false;     // closed, and this tick's permission for it
  bool may_discharge = false;  // likewise
  bool is_held_back = false;   // nothing may flow as the inverter is not heard
  const PackState* pack = nullptr;
  const CurrentLimits* limits = nullptr;
  const FaultMemory* faults = nullptr;
  const StricterReactions* stricter = nullptr;  // of the pack file; not given: none
  Wish wish{};                                  // who asks for a closed pack
  bool is_closed = false;                       // by the sequence, whatever may flow
  bool is_plugged_in = false;                   // a charger
  std::optional<std::int32_t> soc_permille{};
  const PackEstimate* estimate = nullptr;  // not given: nothing is known of the cells' health
  std::int64_t capacity_uAs = 0;
  std::uint8_t module_count = 0;
};

/// Magnitudes in the direction of their names.
struct InverterLimits {
  std::int32_t charge_mA = 0;
  std::int32_t discharge_mA = 0;

  friend constexpr bool operator==(const InverterLimits&, const InverterLimits&) = default;
};

[[nodiscard]] InverterLimits inverter_limits(const InverterView& view, const InverterConfig& config);

/// What the faults are to an inverter: of each that is present its alarm if it opens the pack or keeps it open for who
/// asks now, else a warning; and of each that warns a warning. A pack that is too cold to be charged and goes on
/// discharging has no alarm: it would stop an SMA inverter.
struct BatteryAlarms {
  std::uint16_t alarms = 0;
  std::uint16_t warnings = 0;
};
[[nodiscard]] BatteryAlarms battery_alarms(const InverterView& view);

class InverterReporter {
 public:
  /// Frames of a round are so far apart: a bus with other traffic has room between them.
  static constexpr Duration spacing = 10ms;
  /// A fall of less waits for the next round; one to nothing does not.
  static constexpr std::int32_t step_mA = 500;
  /// Above the state of charge below which a charge is asked for, until no longer.
  static constexpr std::int32_t hysteresis_permille = 50;
  /// More than `full_charge_after_days` may be.
  static constexpr std::uint32_t hours_max = 24 * 366;
  /// A pack that has come so far has been full.
  static constexpr std::int32_t full_permille = 970;

  void init(const InverterConfig& config, TimePoint started_at);
  /// Of the daemon before this one: of more than `hours_max` that many.
  void restore(std::uint32_t hours_since_full);
  [[nodiscard]] bool is_there() const { return config_.driver != nullptr; }

  /// Once a tick, before step(): what is asked for, and whether what may flow has fallen.
  void follow(const InverterView& view);
  /// The frame due at `now`, or none.
  [[nodiscard]] std::optional<CanFrame> step(const InverterView& view);
  /// A frame that step() gave did not get out: the gate, the port or the bus did not take it.
  void note_failed(const CanFrame& frame);
  /// All that is told, as it is now.
  [[nodiscard]] BatteryReport report(const InverterView& view) const;
  /// What may flow, by the last follow().
  [[nodiscard]] const InverterLimits& limits() const { return limits_; }
  [[nodiscard]] bool asks_for_charge() const { return asks_for_charge_; }
  [[nodiscard]] bool asks_for_full_charge() const { return asks_for_full_charge_; }
  /// Whole hours in which daemons of this pack ran since it was last full; without any, since the first.
  [[nodiscard]] std::uint32_t hours_since_full(TimePoint now) const;

 private:
  void follow_requests(const InverterView& view);
  void advance(TimePoint now);

  InverterConfig config_;
  InverterLimits limits_;
  InverterLimits told_;  // by the last round's urgent frames: the most that the inverter goes by
  TimePoint round_at_{};
  TimePoint next_at_{};
  std::uint8_t index_ = 0;
  bool asks_for_charge_ = false;
  bool asks_for_full_charge_ = false;
  TimePoint full_at_{};             // last; the start counts as full ...
  std::uint32_t hours_before_ = 0;  // ... so many hours later
  [[nodiscard]] bool are_fields_possible() const { return index_ < inverter_frames_max && hours_before_ <= hours_max; }
  BMU_FIELDS(skipped(config_), limits_, told_, round_at_, next_at_, index_, asks_for_charge_, asks_for_full_charge_,
             full_at_, hours_before_)
};

}  // namespace bmu

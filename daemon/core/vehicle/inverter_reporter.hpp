// Report of the pack to an inverter: permitted currents, state of charge, measurements and faults; round by round, a
// frame every 10 ms.
//
// The permitted currents are the smallest of the pack's present limits, its continuous limits, since an inverter loads
// it continuously, and those of the pack file; zero while the pack is not closed and permitted to stay so, while a
// fault requires zero current, while the cell data is incomplete or the current unknown, and, if the pack file requires
// it, while the inverter is not received. A limit that falls is sent as soon as the inverter may be addressed again
// (`period_min`); one that rises, with the next round: the ramp sets how fast it rises (limit_ramp.hpp). Limits in a
// frame that was not sent do not count as sent: they are sent again as soon.
//
// An unknown value is sent as the protocol documents, or its frame is omitted; it is never sent as a valid number.
//
// Cost: some comparisons a tick; a pass over the fault table for each frame.
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
  bool may_charge = false;     // closed, and permitted in this tick
  bool may_discharge = false;  // likewise
  bool is_held_back = false;   // no current is permitted because the inverter is not received
  const PackState* pack = nullptr;
  const CurrentLimits* limits = nullptr;
  const FaultMemory* faults = nullptr;
  const StricterReactions* stricter = nullptr;  // of the pack file; null: none
  Wish wish{};                                  // source of the close request
  bool is_closed = false;                       // by the sequence, whatever current is permitted
  bool is_plugged_in = false;                   // a charger
  std::optional<std::int32_t> soc_permille{};
  const PackEstimate* estimate = nullptr;  // null: the state of health is unknown
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

/// Faults as reported to an inverter: for each confirmed fault its alarm if it opens the pack or keeps it open for the
/// present request, else a warning; for each active warning a warning. A pack that is too cold to charge and continues
/// to discharge has no alarm: it would stop an SMA inverter.
struct BatteryAlarms {
  std::uint16_t alarms = 0;
  std::uint16_t warnings = 0;
};
[[nodiscard]] BatteryAlarms battery_alarms(const InverterView& view);

class InverterReporter {
 public:
  /// Interval of the frames of a round: leaves room for other traffic on the bus.
  static constexpr Duration spacing = 10ms;
  /// A smaller decrease waits for the next round; one to zero does not.
  static constexpr std::int32_t step_mA = 500;
  /// A request for a charge ends this far above the state of charge below which it starts.
  static constexpr std::int32_t hysteresis_permille = 50;
  /// More than `full_charge_after_days` may be.
  static constexpr std::uint32_t hours_max = 24 * 366;
  /// State of charge from which the pack counts as having been full.
  static constexpr std::int32_t full_permille = 970;

  void init(const InverterConfig& config, TimePoint started_at);
  /// Hours of the previous session, limited to `hours_max`.
  void restore(std::uint32_t hours_since_full);
  [[nodiscard]] bool is_there() const { return config_.driver != nullptr; }

  /// Called once per tick, before step(): updates the requests for a charge, and whether a permitted current has
  /// fallen.
  void follow(const InverterView& view);
  /// The frame due at `now`, or none.
  [[nodiscard]] std::optional<CanFrame> step(const InverterView& view);
  /// A frame returned by step() was not sent: the gate, the port or the bus did not accept it.
  void note_failed(const CanFrame& frame);
  /// All reported values, at present.
  [[nodiscard]] BatteryReport report(const InverterView& view) const;
  /// The permitted currents, by the last follow().
  [[nodiscard]] const InverterLimits& limits() const { return limits_; }
  [[nodiscard]] bool asks_for_charge() const { return asks_for_charge_; }
  [[nodiscard]] bool asks_for_full_charge() const { return asks_for_full_charge_; }
  /// Whole hours for which daemons of this pack ran since it was last full; if it never was, since the first one
  /// started.
  [[nodiscard]] std::uint32_t hours_since_full(TimePoint now) const;

 private:
  void follow_requests(const InverterView& view);
  void advance(TimePoint now);

  InverterConfig config_;
  InverterLimits limits_;
  InverterLimits told_;  // maximum in the last round's urgent frames, which the inverter may use
  TimePoint round_at_{};
  TimePoint next_at_{};
  std::uint8_t index_ = 0;
  bool asks_for_charge_ = false;
  bool asks_for_full_charge_ = false;
  TimePoint full_at_{};             // when last full, or the start of the daemon ...
  std::uint32_t hours_before_ = 0;  // ... so many hours after the last full charge
  [[nodiscard]] bool are_fields_possible() const { return index_ < inverter_frames_max && hours_before_ <= hours_max; }
  BMU_FIELDS(skipped(config_), limits_, told_, round_at_, next_at_, index_, asks_for_charge_, asks_for_full_charge_,
             full_at_, hours_before_)
};

}  // namespace bmu

// Monitor of the chargers against the commands, and against the pack's current sensor.
//
// A charger needs time to follow a command: the reference is the maximum that was commanded within its `settle`, so
// that a charger that is slow to reduce is not detected as a runaway. After a stop it has to start reducing within two
// fifths of that time: one that then still gives as much as was commanded has not followed the command, and keeps on.
// Beyond the tolerance, a tenth of the current, at least an ampere, or two percent of the voltage, at least two volts,
// it is a runaway. The pack's sensor decides immediately where only the charger can bring current into the pack; where
// a vehicle may brake, the charger's own report decides, and for `keeps_on` both must agree. A charger that reports too
// much several times in a row is a runaway as well, whatever the sensor measures: a sensor that is reversed or frozen
// would hide it. With several units all must have reported for each of these times, and each has an ampere of its own.
// A report of less current, or of another voltage, than the sensor measures is only a contradiction. A charger that is
// not plugged in is never a runaway: a frame of a charger on the bus of a pack that is driven opens nothing.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "daemon/core/measurement/charger_table.hpp"
#include "daemon/core/measurement/pack_state.hpp"
#include "protocol/fields.hpp"

namespace bmu {

struct ChargerWatchInputs {
  TimePoint now{};
  bool is_plugged_in = false;
  bool is_alone = false;  // only a charger can bring current into the pack now
  bool is_enabled = false;
  std::int32_t asked_mA = 0;  // total of all units
  std::int32_t asked_mV = 0;
  const PackState* pack = nullptr;
  const ChargerTable* table = nullptr;
};

/// Excess of a charger that ran away: current in mA, voltage in mV.
struct ChargerExcess {
  bool is_voltage = false;
  std::int32_t given = 0;    // by the pack's sensor or the charger's own report
  std::int32_t asked = 0;    // current: maximum within the charger's settling time
  std::int32_t allowed = 0;  // including the tolerance

  [[nodiscard]] constexpr bool is_known() const { return allowed != 0; }
};

class ChargerWatch {
 public:
  static constexpr std::int32_t current_tolerance_min_mA = 1'000;
  static constexpr std::int32_t voltage_tolerance_min_mV = 2'000;
  static constexpr std::int32_t tolerance_permille = 100;
  static constexpr std::int32_t voltage_tolerance_permille = 20;
  /// Number of consecutive reports of too much that confirm it; a single one may be from any node.
  static constexpr std::uint8_t told_over_min = 3;
  /// A larger current into a pack that commands none is a charge.
  static constexpr std::int32_t stopped_mA = 1'000;
  /// Time after a stop, as a part of the settling time, from which a charger gives less than this share of the
  /// commanded current.
  [[nodiscard]] static constexpr Duration begins_within(Duration settle) { return settle * 2 / 5; }
  static constexpr std::int32_t unbegun_permille = 900;

  /// Once a tick, with the command of the previous tick.
  void update(const ChargerWatchInputs& in);
  void forget() { *this = {}; }

  /// A unit that was charging is lost: from 1, 0: none. Until it reports again or is unplugged.
  [[nodiscard]] std::uint8_t silent_unit() const { return silent_unit_; }
  /// More current or voltage than commanded.
  [[nodiscard]] bool runs_away() const { return runs_away_; }
  /// Time of the report or sample that shows it.
  [[nodiscard]] TimePoint runs_away_at() const { return runs_away_at_; }
  [[nodiscard]] bool is_plugged_in() const { return is_plugged_in_; }
  /// The same current, and no stop, has been commanded for as long as a charger may take to follow.
  [[nodiscard]] bool is_asked(TimePoint now, Duration settle) const {
    return is_plugged_in_ && stopped_since_ == TimePoint{} && now - steady_since_ >= settle;
  }
  /// Excess and its quantity: now, or when it last ran away.
  [[nodiscard]] const ChargerExcess& excess() const { return excess_; }
  /// It was commanded to stop, and continues.
  [[nodiscard]] bool keeps_on() const { return keeps_on_; }
  /// It reports another current than the pack's sensor, or another voltage.
  [[nodiscard]] bool contradicts() const { return contradicts_; }
  /// Last time at which the sensor measured as much current out of the pack as the charger reported to give, while only
  /// the charger could bring current into it; zero: never. Not used for any decision.
  [[nodiscard]] TimePoint mirrored_at() const { return mirrored_at_; }

 private:
  static constexpr std::size_t spans = 8;  // parts of a charger's settling time

  void look_for_silence(const ChargerWatchInputs& in);
  void follow_asked(const ChargerWatchInputs& in);
  void count_told(const Measured<std::int32_t>& told, std::int32_t most_mA, TimePoint now);
  [[nodiscard]] std::int32_t stopped_max_mA(const ChargerWatchInputs& in, std::int32_t least_mA) const;
  void look_for_excess(const ChargerWatchInputs& in);
  void look_for_contradiction(const ChargerWatchInputs& in);
  void look_for_mirror(const ChargerWatchInputs& in);

  [[nodiscard]] std::int32_t ceiling_mA() const { return *std::max_element(most_mA_.begin(), most_mA_.end()); }

  bool is_plugged_in_ = false;
  std::uint16_t charging_units_ = 0;  // that reported while commanded to charge: bit by unit
  std::uint8_t silent_unit_ = 0;
  std::array<std::int32_t, spans + 1> most_mA_{};  // commanded maximum of each span of the settling time: a ring
  std::size_t span_ = 0;                           // the current span
  TimePoint span_began_at_{};
  TimePoint stopped_since_{};         // zero: a current is commanded
  std::int32_t stopped_from_mA_ = 0;  // the maximum commanded before
  std::int32_t steady_mA_ = 0;        // the commanded current, within the tolerance, ...
  TimePoint steady_since_{};          // ... since then, and since charging was enabled
  bool runs_away_ = false;
  TimePoint runs_away_at_{};
  std::uint8_t told_over_ = 0;  // consecutive reports above the command, or of any current after the stop
  TimePoint told_over_at_{};    // when the last of them was counted
  bool keeps_on_ = false;
  bool contradicts_ = false;
  TimePoint mirrored_at_{};
  ChargerExcess excess_;
  [[nodiscard]] bool are_fields_possible() const {
    return span_ < most_mA_.size() && silent_unit_ <= charger_units_max;
  }
  BMU_FIELDS(is_plugged_in_, charging_units_, silent_unit_, most_mA_, span_, span_began_at_, stopped_since_,
             stopped_from_mA_, steady_mA_, steady_since_, runs_away_, runs_away_at_, told_over_, told_over_at_,
             keeps_on_, contradicts_, mirrored_at_, excess_)
};

}  // namespace bmu

// The chargers held against what was asked of them, and against the pack's own sensor.
//
// A charger takes a while to follow: what counts as asked is the most that was asked for within its `settle`, so that
// one that is slow to come down is not taken for one that runs away. After a stop it has to begin within two fifths of
// that: one that then gives as much as it was asked for has not obeyed, and keeps on. Beyond a tolerance of a tenth,
// and at least an ampere and two volts, it does. The pack's sensor judges at once where nobody but the charger can
// bring current into the pack; where a vehicle may brake the charger's own word does, and what both say. A charger that
// says several times in a row that it gives too much runs away, too, whatever the sensor sees: a sensor that is
// reversed or stands still would hide it. Of several units all have to have reported for each of these times, and each
// has an ampere of its own. Its word for less, or for another voltage, against the sensor's is a contradiction, and no
// more. Nothing runs away that is not plugged in: a frame of a charger on the bus of a pack that is driven opens
// nothing.
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
  bool is_alone = false;  // nobody but a charger can bring current into the pack now
  bool is_enabled = false;
  std::int32_t asked_mA = 0;  // of all units together
  std::int32_t asked_mV = 0;
  const PackState* pack = nullptr;
  const ChargerTable* table = nullptr;
};

/// How a charger ran away: current in mA, voltage in mV.
struct ChargerExcess {
  bool is_voltage = false;
  std::int32_t given = 0;    // by the pack's sensor or the charger's own word
  std::int32_t asked = 0;    // of a current the most within the charger's settling time
  std::int32_t allowed = 0;  // with the tolerance

  [[nodiscard]] constexpr bool is_known() const { return allowed != 0; }
};

class ChargerWatch {
 public:
  static constexpr std::int32_t current_tolerance_min_mA = 1'000;
  static constexpr std::int32_t voltage_tolerance_min_mV = 2'000;
  static constexpr std::int32_t tolerance_permille = 100;
  static constexpr std::int32_t voltage_tolerance_permille = 20;
  /// So many reports in a row that tell too much are believed; one may be anybody's.
  static constexpr std::uint8_t told_over_min = 3;
  /// More than this into a pack that asks for nothing is a charge.
  static constexpr std::int32_t stopped_mA = 1'000;
  /// So long after a stop, of its time to follow, a charger gives less than this of what it was asked for.
  [[nodiscard]] static constexpr Duration begins_within(Duration settle) { return settle * 2 / 5; }
  static constexpr std::int32_t unbegun_permille = 900;

  /// Once a tick, with what was asked for in the tick before.
  void update(const ChargerWatchInputs& in);
  void forget() { *this = {}; }

  /// A unit that was charging has fallen silent: from 1, 0 for none. Until it talks again or is unplugged.
  [[nodiscard]] std::uint8_t silent_unit() const { return silent_unit_; }
  /// More current or voltage than was asked for.
  [[nodiscard]] bool runs_away() const { return runs_away_; }
  /// When what shows it was told or measured.
  [[nodiscard]] TimePoint runs_away_at() const { return runs_away_at_; }
  [[nodiscard]] bool is_plugged_in() const { return is_plugged_in_; }
  /// The same has been asked for, and not to stop, for as long as a charger may take to follow.
  [[nodiscard]] bool is_asked(TimePoint now, Duration settle) const {
    return is_plugged_in_ && stopped_since_ == TimePoint{} && now - steady_since_ >= settle;
  }
  /// By how much more, of what: now, or when it last did.
  [[nodiscard]] const ChargerExcess& excess() const { return excess_; }
  /// It was told to stop, and goes on.
  [[nodiscard]] bool keeps_on() const { return keeps_on_; }
  /// It tells another current than the pack's sensor, or another voltage.
  [[nodiscard]] bool contradicts() const { return contradicts_; }
  /// When the sensor last saw as much leave the pack as the charger told to give, while nobody else could bring current
  /// into it; zero: never. It decides nothing.
  [[nodiscard]] TimePoint mirrored_at() const { return mirrored_at_; }

 private:
  static constexpr std::size_t spans = 8;  // that a charger's settling time is divided into

  void look_for_silence(const ChargerWatchInputs& in);
  void follow_asked(const ChargerWatchInputs& in);
  void count_told(const Measured<std::int32_t>& told, std::int32_t most_mA, TimePoint now);
  [[nodiscard]] std::int32_t stopped_max_mA(const ChargerWatchInputs& in, std::int32_t least_mA) const;
  void look_for_excess(const ChargerWatchInputs& in);
  void look_for_contradiction(const ChargerWatchInputs& in);
  void look_for_mirror(const ChargerWatchInputs& in);

  [[nodiscard]] std::int32_t ceiling_mA() const { return *std::max_element(most_mA_.begin(), most_mA_.end()); }

  bool is_plugged_in_ = false;
  std::uint16_t charging_units_ = 0;  // that talked while they were asked to charge: bit by unit
  std::uint8_t silent_unit_ = 0;
  std::array<std::int32_t, spans + 1> most_mA_{};  // asked for, in each span of the settling time: a ring
  std::size_t span_ = 0;                           // that is going on
  TimePoint span_began_at_{};
  TimePoint stopped_since_{};         // zero: something is asked for
  std::int32_t stopped_from_mA_ = 0;  // the most that was asked for before
  std::int32_t steady_mA_ = 0;        // what has been asked for, within the tolerance, ...
  TimePoint steady_since_{};          // ... since then, and since charging is asked for at all
  bool runs_away_ = false;
  TimePoint runs_away_at_{};
  std::uint8_t told_over_ = 0;  // reports in a row that tell more than is asked for, or any current after the stop
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

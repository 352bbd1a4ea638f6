// Whether the cells follow a current that has changed since it was calm: the direction of the current sensor, and a
// sensor that stays at zero.
//
//   current    --------.                       calm: within `calm_mA` of its first picture, 2 s or more
//                       :                      change: 5 A, or two and a half times that, by less than a fifth to the
//                        .-------                other side
//   cells      --- -- --.                      drift: goes on at most as fast as in the calm, as what a former load
//                       :                      leaves behind fades
//                        .------               seen: what is beyond the drift points the other way than the change
//
// StepResponse compares voltages that lie 600 ms apart, which needs a large step. A load that swells over seconds, as a
// charger's, has none, and a small one is seen by what it does in seconds. Here the voltages are compared with those of
// two calms: the last one, and the last at zero, which is that of the open pack where a load comes soon after the
// closing or grows so slowly that it is calm all the way. At zero a calm counts from 1 s on, and of two the one that
// can be compared with for longer. As long as the change keeps its sign, all that it does to a cell has one sign: the
// drop at once, the polarisation and the charge that has flowed. So the drop at once, by the cell model, is the least
// that has to be seen. What a fifth of it to the other side leaves behind is less than half of that; as it takes time
// to come up, the current to that side counts as its mean of the last two seconds, and a precharge for next to nothing.
// Where the pack voltage is known it has to move, too.
//
//   direction:  |change * R| >= 1 mV a cell; contradiction: voltages moved with the change, by more than the bound and
//               half of the answer. That the direction is right is known when they moved against it by as much.
//   frozen:     the current stays within the calm of zero, and the voltages move by more than the bound and
//               `unseen_uV` a cell, as the pack voltage does.
//   bound:      the drift, 1 mV a cell, and four times R by the current that flowed lately.
//
// A sensor that is right is taken for a reversed one if all cells move against the answer by as much as that: they are
// then off by one and a half times the answer and the bound together, 2.5 mV at least, in three pictures in a row, and
// the pack voltage with them. The steps of the coarsest modules are 1 mV, and the noise of a calm is averaged. A
// reversed one is named at once where the answer is 2 mV: 5 A by 0.4 mOhm. Less is seen once the polarisation has made
// it that much, if the calm was watched for long enough to be compared with then. An answer of 1 mV, 5 A by 0.2 mOhm,
// is in the noise.
//
// What several former loads leave behind may have both signs: the voltage turns, the drift of a calm is zero there, and
// then it moves by tens of millivolts. That is at most what all of the polarisation is, which in fitted cells is up to
// 3.2 times R by the current; so the first load after a rest is judged, and later ones if they are eight times as large
// as what flowed before. The current that flowed lately fades in 400 s; before the daemon began none is known.
//
// The lowest and the highest cell have to move, too, by half as much: a fault of one cell is none of the sensor.
// Drift counts for four times as long as it has been watched, for 60 s, and until the current of the calm has moved a
// permille of the capacity: at the ends of a cell's curve a current that stays makes a voltage fall faster and faster.
// Valid for pictures of one instant; a cell whose balancing switch changes moves by its wires' drop, so the caller
// calls `forget` then: while cells are balanced in a rhythm nothing is judged. A sensor whose noise is larger than
// `calm_mA` is never calm, and is not judged. Nor is a change of less than 5 A, as the sensor's offset may be a part of
// it; nor a sensor that stays at zero while so little flows that `unseen_uV` is not reached, as in many a charge from
// the mains.
//
// Source: the rule that the first load above 5 A is compared with the cells is that of batteries whose sensor has no
// marked direction; the bounds are this program's own, held by
// tests/unit/daemon/core/estimation/health/current_ramp_monitor_test.cpp and, for the packs as shipped,
// tests/scenario/first_load_test.cpp.
//
// Cost: a pass over 32 pictures a poll cycle.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "daemon/core/measurement/current_window.hpp"
#include "daemon/core/types/fault_reading.hpp"
#include "daemon/core/types/measured.hpp"
#include "protocol/fields.hpp"
#include "protocol/time.hpp"

namespace bmu {

/// The pack voltage moved as the cells did together, by at least half as much. Where it is not known, true: the cells
/// alone count.
[[nodiscard]] bool is_move_of_pack(std::int64_t cells_moved_uV, const Measured<std::int32_t>& before_mV,
                                   const Measured<std::int32_t>& now_mV);

/// All cells and the current at one instant.
struct PackPicture {
  TimePoint taken_at{};
  CurrentRange current;     // between the samples around the instant
  CurrentRange since_last;  // between the samples from the picture before until now
  std::int64_t sum_uV = 0;
  std::int32_t lowest_uV = 0;
  std::int32_t highest_uV = 0;
  Measured<std::int32_t> pack_mV{};
};

class CurrentRampMonitor {
 public:
  /// `unseen_uV`: what the voltage of a cell has to move by at a current of zero.
  struct Cells {
    std::int64_t count = 0;
    std::int64_t resistance_uOhm = 0;  // of each, at once
    std::int64_t unseen_uV = 0;
    std::int64_t capacity_As = 0;
    std::int64_t calm_mA = 0;  // what the sensor's noise and a standby consumption change by
  };

  /// Once for each poll cycle, in order of time. A picture whose `since_last` is not known begins anew: between two
  /// that are 600 ms apart anything may have flowed.
  void take(const PackPicture& now, const Cells& cells);
  /// Each sample of the current: what may still move the cells after a load.
  void follow_current(const Measured<std::int32_t>& current_mA);
  /// The pictures, not the current that flowed lately.
  void forget();

  /// 1: the cells contradict the current; 0: they follow it; not known while neither shows in this picture.
  [[nodiscard]] const Reading& implausible_current() const { return implausible_current_; }
  /// Of an implausible one: the voltages moved against the current; else they moved without it.
  [[nodiscard]] bool is_against_current() const { return is_against_current_; }

 private:
  /// A picture of a calm; of the latest time, current and sum are means, in which the last counts for a quarter.
  struct Calm {
    TimePoint taken_at{};  // zero: none
    std::int32_t current_mA = 0;
    std::int64_t lately_mA = 0;  // had flowed
    std::int64_t sum_uV = 0;
    std::int32_t lowest_uV = 0;
    std::int32_t highest_uV = 0;
    Measured<std::int32_t> pack_mV{};
    [[nodiscard]] constexpr bool are_fields_possible() const {
      constexpr std::int64_t sum_max_uV = 1'000'000'000'000;
      return lately_mA >= 0 && lately_mA <= INT32_MAX && sum_uV >= -sum_max_uV && sum_uV <= sum_max_uV;
    }
  };
  /// What a change of the current is compared with: first and last picture of the calm before it.
  struct Reference {
    Calm first;
    Calm last;
    std::int64_t risen_uA = 0;   // above the current of `last`, at most, as the mean of two seconds
    std::int64_t fallen_uA = 0;  // below it
    [[nodiscard]] constexpr bool are_fields_possible() const {
      constexpr std::int64_t change_max_uA = std::int64_t{2} * UINT32_MAX * 1'000;
      return risen_uA >= 0 && risen_uA <= change_max_uA && fallen_uA >= 0 && fallen_uA <= change_max_uA;
    }
  };

  [[nodiscard]] const Calm& oldest() const;
  void follow_calm(const PackPicture& now, const Cells& cells);
  void end_calm(const Calm& first, const Cells& cells);
  void keep_calm();
  static void follow_sides(Reference& reference, const CurrentRange& range, Duration since);
  [[nodiscard]] static std::int64_t bound_uV(std::int64_t drift_uV, const Calm& last, const Cells& cells);
  /// All cells moved the same way, together by at least `least_uV`.
  [[nodiscard]] static bool has_moved(const PackPicture& now, const Calm& last, std::int64_t least_uV,
                                      const Cells& cells);
  void check_direction(const Reference& reference, const PackPicture& now, const Cells& cells);
  void check_frozen(const PackPicture& now, const Cells& cells);

  static constexpr std::size_t ring_size = 32;
  std::array<Calm, ring_size> ring_{};  // of the calm that goes on, at least `ring_step` apart
  std::size_t head_ = 0;                // the latest of them
  Calm latest_;                         // of the calm
  Calm waiting_;                        // the latest picture of all, part of no calm yet
  Reference reference_;
  Reference at_zero_;
  std::int64_t lately_uA_ = 0;  // the largest current, fading
  TimePoint lately_at_{};
  Reading implausible_current_;
  bool is_against_current_ = false;
  [[nodiscard]] bool are_fields_possible() const { return head_ < ring_.size() && lately_uA_ >= 0; }
  BMU_FIELDS(ring_, head_, latest_, waiting_, reference_, at_zero_, lately_uA_, lately_at_, implausible_current_,
             is_against_current_)
};

}  // namespace bmu

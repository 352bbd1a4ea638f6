// Checks whether the cells follow a change of the current after a calm: detects a current sensor with the wrong
// direction, and one that stays at zero.
//
//   current    --------.                       calm: within `calm_mA` of its first sample set, 2 s or more
//                       :                      change: 5 A, or two and a half times `calm_mA`, less than a fifth of it
//                        .-------                to the other side
//   cells      --- -- --.                      drift: continues at most as fast as in the calm, as the polarisation of
//                       :                      an earlier load decays
//                        .------               seen: the movement beyond the drift has the other sign than the change
//
// StepResponse compares voltages that lie 600 ms apart, which requires a large step. A load that increases over
// seconds, as a charger's does, has no step, and a small one is detected by its effect over seconds. Here the voltages
// are compared with those of two calms: the last one, and the last at zero, which is that of the open pack where a load
// comes soon after the closing or grows so slowly that it is calm all the way. At zero a calm counts from 1 s on, and
// of two the one with the longer time for comparison is used. As long as the change keeps its sign, all its effects on
// a cell have one sign: the immediate drop, the polarisation and the charge that has flowed. So the immediate drop, by
// the cell model, is the minimum movement expected. The polarisation left by a fifth of it to the other side is less
// than half of that; as it takes time to build up, the current to that side counts as its mean of the last two seconds,
// and a precharge for next to nothing. Where the pack voltage is known it has to move, too.
//
//   direction:  |change * R| >= 1 mV a cell; contradiction: voltages moved with the change, by more than the bound and
//               half of the expected movement. The direction is confirmed as right if they moved against it by as much.
//   frozen:     the current stays within the calm of zero, and the voltages move by more than the bound and
//               `unseen_uV` a cell, as the pack voltage does.
//   bound:      the drift, 1 mV a cell, and four times R by the recent current.
//
// A correct sensor is taken for a reversed one if all cells move against the expected movement by that much: they then
// deviate by one and a half times the expected movement and the bound together, 2.5 mV at least, in three sample sets
// in a row, and the pack voltage with them. The steps of the coarsest modules are 1 mV, and the noise of a calm is
// averaged. A reversed sensor is detected at once where the expected movement is 2 mV: 5 A by 0.4 mOhm. A smaller one
// is detected once the polarisation has made it that large, if the calm was observed for long enough to be compared
// with then. A movement of 1 mV, 5 A by 0.2 mOhm, is in the noise.
//
// The polarisation of several earlier loads may have both signs: the voltage reverses, the drift of a calm is zero
// there, and then it moves by tens of millivolts. The maximum is the whole polarisation, which in fitted cells is up to
// 3.2 times R by the current; so the first load after a rest is checked, and later ones if they are eight times as
// large as the current before. The recent current decays in 400 s; from before the start of the daemon none is known.
//
// The lowest and the highest cell have to move, too, by half as much: a fault of one cell is none of the sensor. A
// drift is extrapolated for four times as long as it has been observed, for 60 s at most, and until the current of the
// calm has moved a permille of the capacity: at the ends of a cell's curve a constant current makes a voltage fall
// faster and faster. Valid for sample sets of one instant; a cell moves by its wires' drop when its balancing switch
// changes, so the caller calls `forget` then: while cells are balanced periodically nothing is checked. A sensor with
// noise above `calm_mA` is never calm, and is not checked. Nor is a change of less than 5 A, as the sensor's offset may
// be a part of it; nor a sensor that stays at zero while so little flows that `unseen_uV` is not reached, as in many
// charges from the mains.
//
// Source: batteries with a sensor without a marked direction compare the first load above 5 A with the cells; the
// bounds are this program's own, verified by tests/unit/daemon/core/estimation/health/current_ramp_monitor_test.cpp
// and, for the packs as shipped, tests/scenario/first_load_test.cpp.
//
// Cost: a pass over 32 sample sets a poll cycle.
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

/// True if the pack voltage moved as the cells did together, by at least half as much. Also true if it is unknown: then
/// only the cells count.
[[nodiscard]] bool is_move_of_pack(std::int64_t cells_moved_uV, const Measured<std::int32_t>& before_mV,
                                   const Measured<std::int32_t>& now_mV);

/// All cells and the current at one instant.
struct PackPicture {
  TimePoint taken_at{};
  CurrentRange current;     // between the samples around the instant
  CurrentRange since_last;  // between the samples from the previous sample set until now
  std::int64_t sum_uV = 0;
  std::int32_t lowest_uV = 0;
  std::int32_t highest_uV = 0;
  Measured<std::int32_t> pack_mV{};
};

class CurrentRampMonitor {
 public:
  /// `unseen_uV`: minimum movement of a cell's voltage at a current of zero.
  struct Cells {
    std::int64_t count = 0;
    std::int64_t resistance_uOhm = 0;  // of each, immediate
    std::int64_t unseen_uV = 0;
    std::int64_t capacity_As = 0;
    std::int64_t calm_mA = 0;  // change of the current by the sensor's noise and a standby consumption
  };

  /// Once for each poll cycle, in order of time. A sample set with an unknown `since_last` restarts the monitor:
  /// between two that are 600 ms apart any current may have flowed.
  void take(const PackPicture& now, const Cells& cells);
  /// Each sample of the current, for the polarisation that remains after a load.
  void follow_current(const Measured<std::int32_t>& current_mA);
  /// Discards the sample sets, not the recent current.
  void forget();

  /// 1: the cells contradict the current; 0: they follow it; not known while this sample set shows neither.
  [[nodiscard]] const Reading& implausible_current() const { return implausible_current_; }
  /// Kind of an implausible current. True: the voltages moved against it; false: they moved without it.
  [[nodiscard]] bool is_against_current() const { return is_against_current_; }

 private:
  /// A sample set of a calm. In the latest one, time, current and sum are means, in which the last set counts for a
  /// quarter.
  struct Calm {
    TimePoint taken_at{};  // zero: none
    std::int32_t current_mA = 0;
    std::int64_t lately_mA = 0;  // recent current then
    std::int64_t sum_uV = 0;
    std::int32_t lowest_uV = 0;
    std::int32_t highest_uV = 0;
    Measured<std::int32_t> pack_mV{};
    [[nodiscard]] constexpr bool are_fields_possible() const {
      constexpr std::int64_t sum_max_uV = 1'000'000'000'000;
      return lately_mA >= 0 && lately_mA <= INT32_MAX && sum_uV >= -sum_max_uV && sum_uV <= sum_max_uV;
    }
  };
  /// Reference for a change of the current: first and last sample set of the calm before it.
  struct Reference {
    Calm first;
    Calm last;
    std::int64_t risen_uA = 0;   // maximum above the current of `last`, as the mean of two seconds
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
  /// True if all cells moved the same way, together by at least `least_uV`.
  [[nodiscard]] static bool has_moved(const PackPicture& now, const Calm& last, std::int64_t least_uV,
                                      const Cells& cells);
  void check_direction(const Reference& reference, const PackPicture& now, const Cells& cells);
  void check_frozen(const PackPicture& now, const Cells& cells);

  static constexpr std::size_t ring_size = 32;
  std::array<Calm, ring_size> ring_{};  // of the present calm, at least `ring_step` apart
  std::size_t head_ = 0;                // index of the latest of them
  Calm latest_;                         // of the present calm
  Calm waiting_;                        // the latest sample set, not yet part of a calm
  Reference reference_;
  Reference at_zero_;
  std::int64_t lately_uA_ = 0;  // largest recent current, decaying
  TimePoint lately_at_{};
  Reading implausible_current_;
  bool is_against_current_ = false;
  [[nodiscard]] bool are_fields_possible() const { return head_ < ring_.size() && lately_uA_ >= 0; }
  BMU_FIELDS(ring_, head_, latest_, waiting_, reference_, at_zero_, lately_uA_, lately_at_, implausible_current_,
             is_against_current_)
};

}  // namespace bmu

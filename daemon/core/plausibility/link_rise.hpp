// Rise of the DC link voltage during a precharge. If it charges through a resistor, the voltage missing to the pack
// voltage falls as exp(-t / tau), tau = R C. From that follow suitable values for the precharge keys, for the texts of
// faults; they are not used for any decision.
//
//   missing  ---.                        first, half, last: from when the contactor had its time to close. If the DC
//               :                        link charges, its missing voltage falls as fast from half to last as from
//               .---first                first to half; under a load slower, behind an open resistor not at all.
//                    .---half            before, followed: the last voltage away from the pack voltage, and the
//                           .-----last   first one at it. With no DC link, or behind a shorted resistor or a welded
//                                        contactor, there is no sample in between.
//
// Inputs are those of the contactor sequence. State: five voltages, kept until the next precharge starts.
#pragma once

#include <cstdint>
#include <optional>

#include "daemon/core/types/contactors.hpp"
#include "daemon/core/types/core_config.hpp"
#include "protocol/fields.hpp"

namespace bmu {

/// Rise of a DC link that charges, and has not reached the pack voltage.
struct SlowRise {
  Duration time_constant{};
  Duration began_after{};  // after the command of the precharge contactor: latest start of the rise
  std::int32_t pack_mV = 0;
  bool is_ended_by_heat = false;  // of the resistor, before the timeout
};

class LinkRise {
 public:
  /// Once a tick, with the state and the inputs of the sequence before its step. Without effect outside of a precharge.
  void update(const SequenceState& state, const SequenceInputs& in, const ContactorConfig& config);

  /// No value before 200 ms have elapsed, or for a DC link that does not rise, or not like one that charges.
  [[nodiscard]] std::optional<SlowRise> slow_rise() const;
  /// Time from the command of the precharge contactor until the DC link was at pack voltage; none if there was no
  /// sample of the rise in between.
  [[nodiscard]] std::optional<Duration> followed_after() const;

 private:
  struct Sample {
    Duration since{};             // since the command of the precharge contactor; zero: none
    std::int32_t missing_mV = 0;  // pack voltage minus DC link voltage
  };
  void take_rise(const Sample& sample);

  TimePoint began_at_{};
  Sample first_;
  Sample half_;  // at a quarter to a half of the time from first to last
  Sample next_half_;
  Sample last_;
  Sample before_;
  Sample followed_;
  std::int32_t missing_at_start_mV_ = 0;
  std::int32_t apart_max_mV_ = 0;  // tolerance to the pack voltage
  std::int32_t pack_mV_ = 0;
  bool is_resistor_hot_ = false;
  [[nodiscard]] bool are_fields_possible() const {
    const auto is_possible = [](const Sample& sample) { return sample.since >= 0s && sample.since <= 1h; };
    return is_possible(first_) && is_possible(half_) && is_possible(next_half_) && is_possible(last_) &&
           is_possible(before_) && is_possible(followed_) && pack_mV_ >= 0;
  }
  BMU_FIELDS(began_at_, first_, half_, next_half_, last_, before_, followed_, missing_at_start_mV_, apart_max_mV_,
             pack_mV_, is_resistor_hot_)
};

/// Value of precharge_min for which a DC link that reaches the pack voltage after this time is not too fast: two thirds
/// of the time, or the minimum of a pack file (precharge_min_least) if that leaves a margin of a tenth. A result below
/// that minimum is not permitted in a pack file.
[[nodiscard]] Duration precharge_min_that_would_do(Duration followed_after);

/// Value of precharge_timeout in which such a DC link reaches the pack voltage from empty and the current falls: the
/// time for that, and half as much again, in tenths of a second. It may exceed the maximum of the pack file
/// (precharge_timeout_max).
[[nodiscard]] Duration precharge_timeout_that_would_do(const SlowRise& rise, const ContactorConfig& config);

/// Energy in the resistor after charging such a DC link from empty, E = U^2 tau / (2 R), and a fifth more, in tens of
/// joules; 0 without the resistance.
[[nodiscard]] std::int32_t precharge_energy_that_would_do_J(const SlowRise& rise, const ContactorConfig& config);

}  // namespace bmu

// How the DC link rises in a precharge. Of a link that charges through a resistor, what is missing to the pack's
// voltage falls as exp(-t / tau), tau = R C. From that follows what the keys of the precharge would have to be, for the
// texts of faults; it decides nothing.
//
//   missing  ---.                        first, half, last: from when the contactor had its time to close. A link that
//               :                        charges falls as fast from half to last as from first to half; under a load it
//               .---first                slows down, and behind an open resistor it does not fall.
//                    .---half            before, followed: the last voltage that did not follow the pack, and the first
//                           .-----last   that did. A link that is none, or one behind a shorted resistor or a welded
//                                        contactor, is not seen on its way.
//
// Inputs are those of the contactor sequence. State: five voltages, kept until the next precharge begins.
#pragma once

#include <cstdint>
#include <optional>

#include "daemon/core/types/contactors.hpp"
#include "daemon/core/types/core_config.hpp"
#include "protocol/fields.hpp"

namespace bmu {

/// Of a link that rises as one that charges, and has not followed the pack.
struct SlowRise {
  Duration time_constant{};
  Duration began_after{};  // after the precharge contactor was commanded: it rises from then on at the latest
  std::int32_t pack_mV = 0;
  bool is_ended_by_heat = false;  // of the resistor, before the time was over
};

class LinkRise {
 public:
  /// Once a tick, with the state and the inputs of the sequence before its step. Beside a precharge nothing changes.
  void update(const SequenceState& state, const SequenceInputs& in, const ContactorConfig& config);

  /// Nothing before 200 ms have passed, and of a link that does not rise, or not as one that charges.
  [[nodiscard]] std::optional<SlowRise> slow_rise() const;
  /// From the command of the precharge contactor until the link followed the pack; nothing if it was not seen on its
  /// way there.
  [[nodiscard]] std::optional<Duration> followed_after() const;

 private:
  struct Sample {
    Duration since{};             // the precharge contactor was commanded; zero: none
    std::int32_t missing_mV = 0;  // pack less link
  };
  void take_rise(const Sample& sample);

  TimePoint began_at_{};
  Sample first_;
  Sample half_;  // a quarter to a half of the time from first to last
  Sample next_half_;
  Sample last_;
  Sample before_;
  Sample followed_;
  std::int32_t missing_at_start_mV_ = 0;
  std::int32_t apart_max_mV_ = 0;  // from the pack, to follow it
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

/// A precharge_min below which a link that follows after this long does not fall: two thirds of it, or the least that a
/// pack file takes (precharge_min_least) where that leaves a tenth. Less than that least: no pack file takes it.
[[nodiscard]] Duration precharge_min_that_would_do(Duration followed_after);

/// A precharge_timeout in which such a link follows from empty and the current falls: the time that takes, and half as
/// much again, in tenths of a second. It may be more than the pack file takes (precharge_timeout_max).
[[nodiscard]] Duration precharge_timeout_that_would_do(const SlowRise& rise, const ContactorConfig& config);

/// What charging such a link from empty leaves in the resistor, E = U^2 tau / (2 R), and a fifth more, in tens of
/// joules; 0 without the resistance.
[[nodiscard]] std::int32_t precharge_energy_that_would_do_J(const SlowRise& rise, const ContactorConfig& config);

}  // namespace bmu

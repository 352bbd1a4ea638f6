// When the modules are asked, and for what. One broadcast POLL a period: arbitration then orders the answers, nothing
// waits for a silent module, and SYNC makes all cell voltages samples of one instant.
//
// Temperatures and identities have periods of their own, in time and not in polls: modules sample temperatures twice a
// second however often they are asked, and a module swapped while live gives itself away within ten seconds.
//
// Who owes an answer shortly before the next broadcast is asked alone, so that one lost frame is made good within its
// cycle; no more than two a cycle, and nobody if nobody answers. Then everybody is asked again when all answers have
// had their time: modules stop what they do when they hear no POLL for a second, and at a slow pace one lost POLL is
// that.
#pragma once

#include <cstdint>

#include "daemon/core/measurement/module_table.hpp"
#include "daemon/core/types/core_config.hpp"
#include "protocol/fields.hpp"
#include "protocol/frame.hpp"

namespace bmu {

struct Poll {
  bool is_due = false;
  CanFrame frame;
  PollWants wants;
};

/// Once known, identities are asked again this often.
inline constexpr Duration identity_period = 10s;
/// Modules asked alone for what they owe, in one cycle.
inline constexpr std::uint8_t singles_per_cycle = 2;

class PollSchedule {
 public:
  /// The first POLL has `first_counter`.
  void init(const PollConfig& config, TimePoint started_at, std::uint8_t first_counter = 0);
  /// The POLL of this tick, if one is due. Deadlines advance by `period`; after a gap they start anew, and a period
  /// that became shorter counts from the last POLL on. `identities_known`: every module has said who it is; until then
  /// each POLL asks.
  [[nodiscard]] Poll step(TimePoint now, Duration period, bool identities_known);
  /// Whether a module that owes something is to be asked alone now. Counts: ask whenever it says so.
  [[nodiscard]] bool may_ask_silent(TimePoint now, Duration period);
  /// The next step has a POLL, or the one with which the answers to the last one have had their time.
  void hurry() { is_hurried_ = true; }
  /// Whoever answers the last broadcast has done so: who has heard nobody by now has lost it, or the bus.
  [[nodiscard]] bool is_answer_over(TimePoint now) const;
  /// A POLL to one module, beside the schedule.
  [[nodiscard]] CanFrame single(std::uint8_t node, const PollWants& wants);

 private:
  [[nodiscard]] TimePoint hurried_at(TimePoint now, Duration period) const;

  PollConfig config_;
  TimePoint next_at_{};
  TimePoint last_at_{};          // of the last broadcast
  TimePoint temperatures_at_{};  // when they are due
  TimePoint identities_at_{};
  bool is_hurried_ = false;
  std::uint8_t singles_ = 0;  // in this cycle
  std::uint8_t counter_ = 0;
  BMU_FIELDS(skipped(config_), next_at_, last_at_, temperatures_at_, identities_at_, is_hurried_, singles_, counter_)
};

}  // namespace bmu

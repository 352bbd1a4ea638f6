// Schedule of the polls and their contents. One broadcast POLL a period: arbitration then orders the answers, nothing
// waits for a module that does not answer, and SYNC makes all cell voltages samples of one instant.
//
// Temperatures and identities have periods of their own, in time and not in polls: modules sample temperatures twice a
// second at any poll rate, and a module replaced in operation is detected within ten seconds.
//
// A module with a missing answer shortly before the next broadcast is polled singly, so that one lost frame is
// recovered within its cycle; no more than two a cycle, and none if no module answers. In that case all are polled
// again at the end of the answer window: modules stop their activity when they receive no POLL for a second, and at a
// slow rate one lost POLL is enough for that.
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

/// Period of the identity polls once all identities are known.
inline constexpr Duration identity_period = 10s;
/// Maximum number of single polls for missing answers in one cycle.
inline constexpr std::uint8_t singles_per_cycle = 2;

class PollSchedule {
 public:
  /// The first POLL has `first_counter`.
  void init(const PollConfig& config, TimePoint started_at, std::uint8_t first_counter = 0);
  /// The POLL of this tick, if one is due. Deadlines advance by `period`; after a gap they restart, and a period that
  /// became shorter counts from the last POLL on. `identities_known`: every module has sent its identity; until then
  /// each POLL requests it.
  [[nodiscard]] Poll step(TimePoint now, Duration period, bool identities_known);
  /// Whether a module with a missing answer is to be polled singly now. Counts the call: if true, the poll must be
  /// sent.
  [[nodiscard]] bool may_ask_silent(TimePoint now, Duration period);
  /// Advances the next POLL to the next step, or to the end of the answer window of the last one.
  void hurry() { is_hurried_ = true; }
  /// The answer window of the last broadcast is over: if no module has answered by now, the POLL or the bus was lost.
  [[nodiscard]] bool is_answer_over(TimePoint now) const;
  /// A POLL to one module, in addition to the schedule.
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

// When the modules are asked, and for what. One broadcast POLL a period: arbitration then orders the answers, nothing
// waits for a silent module, and SYNC makes all cell voltages samples of one instant.
#pragma once

#include <cstdint>

#include "daemon/core/core_config.hpp"
#include "daemon/core/module_table.hpp"
#include "protocol/frame.hpp"

namespace bmu {

struct Poll {
  bool is_due = false;
  CanFrame frame;
  PollWants wants;
};

class PollSchedule {
 public:
  void init(const PollConfig& config, TimePoint started_at);
  /// The POLL of this tick, if one is due. Deadlines advance by the period; after a gap they start anew.
  /// `identities_known`: every module has said who it is; until then each POLL asks, later one in a hundred.
  [[nodiscard]] Poll step(TimePoint now, bool identities_known);
  /// A POLL to one module, beside the schedule.
  [[nodiscard]] CanFrame single(std::uint8_t node, const PollWants& wants);
  /// When the next broadcast is due.
  [[nodiscard]] TimePoint next_at() const { return next_at_; }

 private:
  PollConfig config_;
  TimePoint next_at_{};
  std::uint64_t cycle_ = 0;
  std::uint8_t counter_ = 0;
};

}  // namespace bmu

// Charge and energy of the period in which the pack was last closed: for users interested in the range.
#pragma once

#include <cstdint>

#include "daemon/core/core.hpp"

namespace bmu {

struct DriveRecord {
  bool has_run = false;
  bool is_running = false;
  TimePoint closed_at{};
  Duration lasted{};
  std::int64_t charge_used_uAs = 0;  // negative: charged
  std::int64_t energy_out_mWh = 0;
  std::int64_t energy_in_mWh = 0;
};

class DriveRecorder {
 public:
  /// To be called after every decision.
  void update(const Core& core);
  [[nodiscard]] const DriveRecord& record() const { return record_; }

 private:
  DriveRecord record_;
  ChargeState at_closing_;
};

}  // namespace bmu

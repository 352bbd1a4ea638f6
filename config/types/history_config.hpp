// Settings of the pack's history (daemon/history/), which is not part of the core.
#pragma once

#include <cstdint>

namespace bmu {

struct HistoryConfig {
  std::int32_t keep_days = 30;
  std::int32_t size_max_MB = 200;
  std::int32_t period_s = 60;
};

}  // namespace bmu

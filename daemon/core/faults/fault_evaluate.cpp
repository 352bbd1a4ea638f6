#include "daemon/core/faults/fault_evaluate.hpp"

namespace bmu {

Thresholds thresholds_of(const FaultRow& row, const LimitsConfig& limits) {
  if (!row.has_limit()) {
    const Duration confirm = row.confirm_time != nullptr ? limits.confirm.*row.confirm_time : row.confirm;
    return {.warn = 1, .open = 1, .has_warning = false, .confirm = confirm, .clear = row.clear};
  }
  const LimitConfig& limit = limits.*row.limit;
  return {.warn = limit.warn,
          .open = limit.open,
          .hysteresis = limit.hysteresis,
          .has_warning = true,
          .warn_confirm = row.confirms_warning ? limit.confirm : Duration{},
          .confirm = limit.confirm,
          .clear = limit.clear};
}

}  // namespace bmu

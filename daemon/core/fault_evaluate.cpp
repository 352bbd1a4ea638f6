#include "daemon/core/fault_evaluate.hpp"

namespace bmu {

Thresholds thresholds_of(const FaultRow& row, const LimitsConfig& limits) {
  if (!row.has_limit()) {
    return {.warn = 1, .open = 1, .has_warning = false, .confirm = row.confirm, .clear = row.clear};
  }
  const LimitConfig& limit = row.limit != nullptr ? limits.*row.limit : *row.fixed;
  return {.warn = limit.warn,
          .open = limit.open,
          .hysteresis = limit.hysteresis,
          .has_warning = true,
          .confirm = limit.confirm,
          .clear = limit.clear};
}

}  // namespace bmu

// The pack at the instant a fault was believed, as JSON: for the status socket and for the heads of black boxes.
#pragma once

#include "daemon/core/fault_table.hpp"
#include "daemon/core/freeze_frame.hpp"
#include "daemon/shell/core_view.hpp"

namespace bmu {

/// 0 is what a time is called that nobody has told.
[[nodiscard]] Json time_json(std::int64_t unix_time_ms);
/// What was not known then is null. `element`: where the fault was, in the words of whoever asks.
[[nodiscard]] Json freeze_json(const FreezeFrame& frame, const FaultRow& row, Json element);

}  // namespace bmu

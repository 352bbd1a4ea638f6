// The pack at the instant a fault was believed, as JSON: for the status socket and for the heads of black boxes.
#pragma once

#include <optional>
#include <string_view>

#include "daemon/core/faults/fault_table.hpp"
#include "daemon/core/records/freeze_frame.hpp"
#include "daemon/shell/json/core_view.hpp"

namespace bmu {

/// 0 is what a time is called that nobody has told.
[[nodiscard]] std::optional<std::int64_t> time_or_nothing(std::int64_t unix_time_ms);
/// Members; what was not known then is null. `place`: where the fault was, in the words of whoever asks.
void put_freeze(JsonText& to, const FreezeFrame& frame, const FaultRow& row, std::string_view place);

}  // namespace bmu

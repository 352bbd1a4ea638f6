// The freeze frame of a fault as JSON: for the status socket and for the heads of black boxes.
#pragma once

#include <optional>
#include <string_view>

#include "daemon/core/faults/fault_table.hpp"
#include "daemon/core/records/freeze_frame.hpp"
#include "daemon/shell/json/core_view.hpp"

namespace bmu {

/// No value for 0, which stands for an unknown time.
[[nodiscard]] std::optional<std::int64_t> time_or_nothing(std::int64_t unix_time_ms);
/// Writes the members; an unknown value is null. `place`: place of the fault, as the caller words it.
void put_freeze(JsonText& to, const FreezeFrame& frame, const FaultRow& row, std::string_view place);

}  // namespace bmu

// Explanation of the current limits: each as a chain from the signal over the limiting row to the remaining current.
#pragma once

#include <string>
#include <string_view>

#include "daemon/core/faults/fault_table.hpp"
#include "daemon/core/limits/limits.hpp"
#include "daemon/shell/json/core_view.hpp"

namespace bmu {

/// For the cause `component`: its name in the pack file.
[[nodiscard]] std::string part_text(const CurrentLimit& limit, const CoreConfig& config);

/// {"limit_mA", "cause"} and, by the cause: "part"; "target_mA"; "pack_voltage_mV" and "power_max_W"; or value, input,
/// element, "unhindered_mA" and the effect on the current: "derates_from" and "threshold" of a line, "share_permille"
/// of a table, "holds" of a voltage.
[[nodiscard]] Json limit_json(const CurrentLimit& limit, const CoreConfig& config);

/// {"text": a sentence, "steps": [signal, limit, decision]}. `direction` is charge or discharge.
[[nodiscard]] Json limit_chain(Concerns direction, const CoreView& view);

}  // namespace bmu

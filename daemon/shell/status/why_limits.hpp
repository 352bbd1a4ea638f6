// Why no more current: each limit as a chain from the signal over the row that limits to the current that is left.
#pragma once

#include <string>
#include <string_view>

#include "daemon/core/faults/fault_table.hpp"
#include "daemon/core/limits/limits.hpp"
#include "daemon/shell/json/core_view.hpp"

namespace bmu {

/// Of the cause `component`: its name in the pack file.
[[nodiscard]] std::string part_text(const CurrentLimit& limit, const CoreConfig& config);

/// {"limit_mA", "cause"} and, by the cause: "part"; "target_mA"; or value, input, element, "unhindered_mA" and what it
/// does with the current: "derates_from" and "threshold" of a line, "share_permille" of a table, "holds" of a voltage.
[[nodiscard]] Json limit_json(const CurrentLimit& limit, const CoreConfig& config);

/// {"text": a sentence, "steps": [signal, limit, decision]}. `direction` is charge or discharge.
[[nodiscard]] Json limit_chain(Concerns direction, const CoreView& view);

}  // namespace bmu

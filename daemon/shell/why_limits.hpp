// Why no more current: each limit as a chain from the signal over the row that limits to the current that is left.
#pragma once

#include <string_view>

#include "daemon/core/fault_table.hpp"
#include "daemon/core/limits.hpp"
#include "daemon/shell/core_view.hpp"

namespace bmu {

/// Unit of what caused a limit; none for causes that are not measurements.
[[nodiscard]] Unit unit_of(LimitCause cause);
/// What is looked at, in words: "lowest cell voltage"; "" for causes that are not measurements.
[[nodiscard]] std::string_view input_of(LimitCause cause);

/// {"text": a sentence, "steps": [signal, limit, decision]}. `direction` is charge or discharge.
[[nodiscard]] Json limit_chain(Concerns direction, const CoreView& view);

}  // namespace bmu

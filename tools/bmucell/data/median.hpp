// The middle one of some numbers.
#pragma once

#include <optional>
#include <vector>

namespace bmu::cell {

/// Of an even number of them the upper middle one; none of none. No NaN. Cost: linear.
[[nodiscard]] std::optional<double> median(std::vector<double> values);

}  // namespace bmu::cell

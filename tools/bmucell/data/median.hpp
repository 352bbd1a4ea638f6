// Median of a list of numbers.
#pragma once

#include <optional>
#include <vector>

namespace bmu::cell {

/// The upper middle value if their count is even; none for an empty list. Precondition: no NaN. Cost: linear.
[[nodiscard]] std::optional<double> median(std::vector<double> values);

}  // namespace bmu::cell

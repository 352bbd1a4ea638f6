// Samples as columns of a picture: each sample one as long as there are few, else so many columns of the same time,
// each with the lowest, the highest and the mean of what fell into it.
#pragma once

#include <cstdint>
#include <vector>

#include "tools/report/data.hpp"

namespace bmu::report {

inline constexpr std::size_t columns_max = 900;
/// More are so narrow that a step is none to the eye.
inline constexpr std::size_t step_columns_max = 240;

struct Column {
  std::int64_t at_us = 0;  // its middle
  std::int64_t from_us = 0;
  std::int64_t to_us = 0;
  std::size_t first = 0;  // samples
  std::size_t last = 0;   // behind the last
  bool has_gap_before = false;
};

/// A hole of the data, as far as it is in the picture.
struct ColumnHole {
  std::int64_t from_us = 0;
  std::int64_t to_us = 0;
};

struct Columns {
  std::int64_t from_us = 0;
  std::int64_t to_us = 0;
  std::vector<Column> columns;
  std::vector<ColumnHole> holes{};
  bool has_steps = false;  // few and wide ones, of means: a line between them would tell what nobody knows
};

[[nodiscard]] Columns columns_of(const ReportData& data);

/// Of each column; not_known where nothing in it was known. A series that has no samples has no columns.
[[nodiscard]] Series reduced(const Series& series, const Columns& columns);

/// Of each column the value that so many of the series are below, 0 to 1, of their means; 0 and 1 are the lowest of the
/// lows and the highest of the highs. All series are reduced already.
[[nodiscard]] std::vector<float> quantile(const std::vector<Series>& reduced, double share);

}  // namespace bmu::report

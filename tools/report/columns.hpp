// Samples as columns of a chart: one column per sample if there are few, else a fixed number of columns of equal
// duration, each with the lowest, the highest and the mean of its samples.
#pragma once

#include <cstdint>
#include <vector>

#include "tools/report/data.hpp"

namespace bmu::report {

inline constexpr std::size_t columns_max = 900;
/// With more columns they are so narrow that a step is invisible.
inline constexpr std::size_t step_columns_max = 240;

struct Column {
  std::int64_t at_us = 0;  // its middle
  std::int64_t from_us = 0;
  std::int64_t to_us = 0;
  std::size_t first = 0;  // samples
  std::size_t last = 0;   // one past the last
  bool has_gap_before = false;
};

/// A gap of the data, as far as it is in the chart.
struct ColumnHole {
  std::int64_t from_us = 0;
  std::int64_t to_us = 0;
};

struct Columns {
  std::int64_t from_us = 0;
  std::int64_t to_us = 0;
  std::vector<Column> columns;
  std::vector<ColumnHole> holes{};
  bool has_steps = false;  // few and wide columns of means: a line between them would suggest unknown values
};

[[nodiscard]] Columns columns_of(const ReportData& data);

/// The values of each column; not_known if all its samples are unknown. A series without samples has no columns.
[[nodiscard]] Series reduced(const Series& series, const Columns& columns);

/// For each column the value below which a share of the series lies, 0 to 1, by their means; 0 and 1 are the lowest of
/// the lows and the highest of the highs. Precondition: all series are reduced.
[[nodiscard]] std::vector<float> quantile(const std::vector<Series>& reduced, double share);

}  // namespace bmu::report

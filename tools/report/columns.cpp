#include "tools/report/columns.hpp"

#include <algorithm>
#include <cmath>

namespace bmu::report {

namespace {

float extreme_of(const std::vector<Series>& reduced, std::size_t column, bool wants_high) {
  float value = not_known;
  for (const Series& one : reduced) {
    if (column >= one.size()) continue;
    value = wants_high ? higher(value, one.high[column]) : lower(value, one.low[column]);
  }
  return value;
}

}  // namespace

Columns columns_of(const ReportData& data) {
  Columns result{.from_us = data.from_us(), .to_us = data.to_us(), .columns = {}};
  for (const HoleReport& hole : data.holes) {
    if (!hole.from_us || !hole.to_us) continue;
    const std::int64_t from_us = std::max(*hole.from_us, result.from_us);
    const std::int64_t to_us = std::min(*hole.to_us, result.to_us);
    if (from_us < to_us) result.holes.push_back({from_us, to_us});
  }
  const std::size_t samples = data.times_us.size();
  const bool is_one_each = samples <= columns_max;
  const double width_us = static_cast<double>(result.to_us - result.from_us) / static_cast<double>(columns_max);
  const auto column_of = [&](std::size_t sample) {
    if (is_one_each) return sample;
    return static_cast<std::size_t>(static_cast<double>(data.times_us[sample] - result.from_us) / width_us);
  };
  for (std::size_t first = 0; first < samples;) {
    const std::size_t column = column_of(first);
    std::size_t last = first + 1;
    bool has_gap = data.has_gap_before(first);
    while (last < samples && column_of(last) == column) {
      has_gap = has_gap || data.has_gap_before(last);
      ++last;
    }
    // Samples may be shorter than the others: the last of a source, or one before the next full minute.
    const std::int64_t next_us = last < samples ? data.times_us[last] : result.to_us;
    const std::int64_t from_us = data.times_us[first];
    const std::int64_t to_us = std::min(data.times_us[last - 1] + data.sample_us, next_us);
    result.columns.push_back({.at_us = (from_us + to_us) / 2,
                              .from_us = from_us,
                              .to_us = to_us,
                              .first = first,
                              .last = last,
                              .has_gap_before = has_gap});
    first = last;
  }
  result.has_steps = data.is_of_means && result.columns.size() <= step_columns_max;
  return result;
}

Series reduced(const Series& series, const Columns& columns) {
  Series result;
  if (series.size() == 0) return result;
  for (const Column& column : columns.columns) {
    float low = not_known;
    float high = not_known;
    double sum = 0;
    int count = 0;
    for (std::size_t i = column.first; i < column.last; ++i) {
      low = lower(low, series.low[i]);
      high = higher(high, series.high[i]);
      if (std::isnan(series.mean[i])) continue;
      sum += static_cast<double>(series.mean[i]);
      ++count;
    }
    result.add(low, count > 0 ? static_cast<float>(sum / count) : not_known, high);
  }
  return result;
}

std::vector<float> quantile(const std::vector<Series>& reduced, double share) {
  std::vector<float> result;
  const std::size_t columns = reduced.empty() ? 0 : reduced.front().size();
  std::vector<float> known;
  for (std::size_t column = 0; column < columns; ++column) {
    if (share <= 0.0 || share >= 1.0) {
      result.push_back(extreme_of(reduced, column, share >= 1.0));
      continue;
    }
    known.clear();
    for (const Series& one : reduced) {
      if (column < one.size() && !std::isnan(one.mean[column])) known.push_back(one.mean[column]);
    }
    if (known.empty()) {
      result.push_back(not_known);
      continue;
    }
    const auto nth = known.begin() + std::lround(share * static_cast<double>(known.size() - 1));
    std::nth_element(known.begin(), nth, known.end());
    result.push_back(*nth);
  }
  return result;
}

}  // namespace bmu::report

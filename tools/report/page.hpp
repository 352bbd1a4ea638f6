// The page: one self-contained HTML file, readable on a telephone, on paper and without scripts.
//
// Long spans are drawn by the extremes of about 900 columns (columns.hpp); 30 days of 96 cells stay below 2 MB.
#pragma once

#include <cstdint>
#include <string>

#include "tools/report/columns.hpp"
#include "tools/report/data.hpp"

namespace bmu::report {

struct PageOptions {
  std::string made_by;          // "bmuctl 0.1.0"
  std::int64_t made_at_us = 0;  // since 1970; 0: not shown
};

/// Precondition: `data` has at least one sample. All text in it is escaped.
[[nodiscard]] std::string page_html(const ReportData& data, const PageOptions& options);

// --- parts of the page ----------------------------------------------------------------------------------------------

/// The figures at the top. In summary.cpp.
[[nodiscard]] std::string summary_html(const ReportData& data);
/// Outlier cells, by index in `data`: the lowest and the highest at any time, then those with the largest mean
/// deviation from the median, if that is large. At most four. `reduced` are their voltages. In cells.cpp.
[[nodiscard]] std::vector<std::size_t> outliers_of(const std::vector<Series>& reduced);
/// Voltages over time. In cells.cpp.
[[nodiscard]] std::string voltages_html(const ReportData& data, const Columns& columns);
/// The state of each cell at the end. In cell_figures.cpp.
[[nodiscard]] std::string cell_figures_html(const ReportData& data);
/// Phases, contactors and faults, and the causes of the limits. In timeline.cpp.
[[nodiscard]] std::string timeline_html(const ReportData& data, const Columns& columns);
[[nodiscard]] std::string causes_html(const ReportData& data, const Columns& columns);
[[nodiscard]] std::string events_html(const ReportData& data);

}  // namespace bmu::report

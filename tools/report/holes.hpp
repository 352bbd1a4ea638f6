// Gaps of a report: their texts, the list below the figures, and their marks in every chart.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "tools/report/data.hpp"

namespace bmu::report {

/// "2026-03-01 17:05:09 to 17:05:12 UTC", "before ...", "behind ...".
[[nodiscard]] std::string when_text(const HoleReport& hole);
/// "nothing is known from TIME to TIME (2.4 s): drive.log, line 4711: ...", with times formatted by `time`.
[[nodiscard]] std::string hole_text(const HoleReport& hole, const std::function<std::string(std::int64_t at_us)>& time);
/// Sum of all gaps between the report's start and end.
[[nodiscard]] std::int64_t missing_us(const ReportData& data);
/// A table of the gaps; "" if there are none. Few gaps are listed at the top of a page, many further down.
[[nodiscard]] std::string holes_html(const ReportData& data);
inline constexpr std::size_t holes_at_top_max = 8;

}  // namespace bmu::report

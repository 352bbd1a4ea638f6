// Holes of a report: how they are told in words, in the list below the figures, and in every picture.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "tools/report/report_data.hpp"

namespace bmu::report {

/// "nothing is known from 2026-03-01 17:05:09 to 17:05:12 UTC (2.4 s): drive.log, line 4711: ...".
[[nodiscard]] std::string hole_text(const HoleReport& hole);
/// The same with times as `time` has them.
[[nodiscard]] std::string hole_text(const HoleReport& hole, const std::function<std::string(std::int64_t at_us)>& time);
/// All that is missing between the report's begin and end.
[[nodiscard]] std::int64_t missing_us(const ReportData& data);
/// A table of them; "" if there are none.
[[nodiscard]] std::string holes_html(const ReportData& data);

}  // namespace bmu::report

// bmuctl report: a recording as one page.
#pragma once

#include <string>

namespace bmu {

struct ReportOptions {
  std::string file;  // the recording
  std::string out;   // "": beside it; "-": to standard output
  std::string from;  // UTC, "": its begin
  std::string to;
};

/// Exit code: 0 written; 1 it could not be read or written, or nothing is in it; 2 a time that is none; 3 written, but
/// the recording is damaged somewhere, and the page ends there.
[[nodiscard]] int write_report(const ReportOptions& options);

}  // namespace bmu

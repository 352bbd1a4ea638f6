// bmuctl report: a recording, or a stretch of the history, as one page.
#pragma once

#include <string>

namespace bmu {

struct ReportOptions {
  std::string file;    // the recording or the database; "": the daemon's history
  std::string out;     // "": beside it; "-": to standard output
  std::string from;    // UTC, "": its begin; of a history the last day
  std::string to;      //
  std::string socket;  // of a daemon that may know where its history is
};

/// Exit code: 0 written; 1 it could not be read or written, or nothing is in it; 2 a time that is none; 3 written, but
/// it is damaged somewhere, and the page says so.
[[nodiscard]] int write_report(const ReportOptions& options);

}  // namespace bmu

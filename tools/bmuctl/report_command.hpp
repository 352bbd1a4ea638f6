// bmuctl report: recordings, or a stretch of the history, as one page.
#pragma once

#include <string>
#include <vector>

namespace bmu {

struct ReportOptions {
  std::vector<std::string> files;  // recordings, or one database; none: the daemon's history
  std::string out;                 // "": beside the first of them; "-": to standard output
  std::string from;                // as in time_words.hpp, "": its begin; of a history the last day
  std::string to;                  //
  std::string socket;              // of a daemon that may know where its history is
};

/// Exit code: 0 written; 1 it could not be read or written, or nothing is in it; 2 a time that is none, or files that
/// do not go together; 3 written, but something is damaged or no recording, and the page says so.
[[nodiscard]] int write_report(const ReportOptions& options);

}  // namespace bmu

// bmuctl report: recordings, or a span of the history, as one page.
#pragma once

#include <string>
#include <vector>

namespace bmu {

struct ReportOptions {
  std::vector<std::string> files;  // recordings, or one database; none: the daemon's history
  std::string out;                 // "": beside the first of them, without files history.html; "-": to standard output
  std::string from;                // as in time_words.hpp, "": the start; of a history the last day if `to` is "" too
  std::string to;                  //
  std::string socket;              // of a daemon that may report the path of its history
};

/// Exit code: 0 written; 1 it could not be read or written, or nothing is in it; 2 an invalid time, or files that
/// cannot be combined; 3 written, but a file is damaged or no recording, and the page lists it.
[[nodiscard]] int write_report(const ReportOptions& options);

}  // namespace bmu

// Duration of the recording that was not run: between a damaged part and the next one, or the end of the file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "tools/bmureplay/joins.hpp"
#include "tools/bmureplay/part.hpp"

namespace bmu::replay {

class RunSpans {
 public:
  /// Adds each part in order, including those of which nothing was run: these have no times, and consecutive ones form
  /// one span. `end_log_us`: of the last line, if the part was not run to its end; 0: unknown.
  void take(const PartSpan& span, std::int64_t end_log_us);
  [[nodiscard]] std::size_t size() const { return spans_.size(); }
  /// True if a part of this file was run.
  [[nodiscard]] bool has_run(const std::string& file) const;

  /// For a part of the span number `index`, from 0, that could not be run to its end: sets the line at which the file
  /// resumes, and the duration that was not run.
  void complete(Damage& damage, std::size_t index) const;
  /// The same for a range that could not be read.
  void complete(Damage& damage) const;

 private:
  std::vector<PartSpan> spans_;
  std::vector<std::int64_t> ends_log_us_;
};

}  // namespace bmu::replay

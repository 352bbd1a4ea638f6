// How much of a file was not run: between the part that is damaged and the next one, or the file's end.
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
  /// Each part in its order, also one of which nothing was run: that has no times, and several of them are one span.
  /// `end_log_us`: of its last line, if it was not run to its end; 0: not known.
  void take(const PartSpan& span, std::int64_t end_log_us);
  [[nodiscard]] std::size_t size() const { return spans_.size(); }
  /// Something of this file was run.
  [[nodiscard]] bool has_run(const std::string& file) const;

  /// A part of the span number `index`, from 0, could not be run to its end: says where the file goes on, and how much
  /// was not run.
  void complete(Damage& damage, std::size_t index) const;
  /// The same for a place that could not be read.
  void complete(Damage& damage) const;

 private:
  std::vector<PartSpan> spans_;
  std::vector<std::int64_t> ends_log_us_;
};

}  // namespace bmu::replay

#include "tools/bmureplay/joins.hpp"

#include <array>
#include <cstdio>
#include <cstdlib>

namespace bmu::replay {

namespace {

std::string seconds_text(std::int64_t duration_us) {
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%.1f s", static_cast<double>(std::llabs(duration_us)) * 1e-6);
  return text.data();
}

std::string missing_text(std::int64_t gap_us) {
  return gap_us < 0 ? "lines are missing before this part, and the clock went back by " + seconds_text(gap_us)
                    : seconds_text(gap_us) + " are missing before this part";
}

std::string other_life_text(std::int64_t gap_us) {
  const std::string when = seconds_text(gap_us);
  return gap_us < 0
             ? "another life of the daemon, which began " + when + " before what stands ahead of it had ended"
             : "another life of the daemon, which began " + when + " after what is recorded of the one before ends";
}

}  // namespace

std::string Joins::text_of(const PartSpan& span) const {
  if (seen_.count({span.id.life, span.id.part}) > 0) return "this part comes once more";
  if (!before_) return "";
  const std::int64_t gap_us = span.from_log_us - before_->until_log_us;
  if (span.id.follows(before_->id)) return "";
  if (span.id.life != before_->id.life) return other_life_text(gap_us);
  if (span.id.part < before_->id.part) return "this part comes before the one ahead of it: not in their order";
  return missing_text(gap_us);
}

void Joins::take(const PartSpan& span) {
  if (span.id.life == 0 || span.from_log_us == 0) return;
  const bool is_other_file = before_ && before_->file != span.file;
  const bool may_overlap = is_other_file && (span.is_black_box || before_->is_black_box);
  const std::string text = may_overlap ? "" : text_of(span);
  if (!text.empty() && found_.size() < joins_max) {
    found_.push_back({.file = span.file, .line = span.first_line, .text = text});
  }
  if (!span.is_black_box) seen_.insert({span.id.life, span.id.part});
  before_ = span;
}

}  // namespace bmu::replay

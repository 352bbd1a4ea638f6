#include "tools/bmureplay/joins.hpp"

#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>

#include "tools/common/clock_set.hpp"

namespace bmu::replay {

namespace {

std::string seconds_text(std::int64_t duration_us) {
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%.1f s", static_cast<double>(std::llabs(duration_us)) * 1e-6);
  return text.data();
}

std::string setting_text(std::int64_t set_by_us) {
  return "the clock was set " + std::string(set_by_us < 0 ? "back" : "forward") + " by " + seconds_text(set_by_us);
}

/// Change of the wall clock beyond the time elapsed between two parts of a session; less than a second is 0.
std::int64_t set_between(const PartSpan& before, const PartSpan& span) {
  if (!span.is_of_life(before) || span.from < before.until) return 0;
  const auto passed = std::chrono::floor<std::chrono::microseconds>(span.from - before.until);
  const std::int64_t set_by_us = span.from_log_us - before.until_log_us - passed.count();
  return std::llabs(set_by_us) < Joins::clock_setting_min_us ? 0 : set_by_us;
}

std::string other_life_text(const PartSpan& before, const PartSpan& span) {
  if (is_clock_set(before.until_log_us) != is_clock_set(span.from_log_us)) {
    return "new session; the clock of one session was not set, the time between them is unknown";
  }
  const std::int64_t gap_us = span.from_log_us - before.until_log_us;
  const std::string when = seconds_text(gap_us);
  return gap_us < 0 ? "new session, started " + when + " before the end of the previous one"
                    : "new session, started " + when + " after the end of the previous one";
}

}  // namespace

std::string Joins::text_of(const PartSpan& span) const {
  if (seen_.count({span.id.life, span.id.part}) > 0) return "duplicate part";
  if (!before_) return "";
  if (span.id.follows(before_->id)) return "";
  if (span.id.life != before_->id.life) return other_life_text(*before_, span);
  if (span.id.part < before_->id.part) return "parts out of order";
  const auto gap = std::chrono::floor<std::chrono::microseconds>(span.from - before_->until);
  return seconds_text(gap.count()) + " are missing before this part";
}

void Joins::add(const std::string& file, std::uint64_t line, const std::string& text) {
  if (found_.size() < joins_max) found_.push_back({.file = file, .line = line, .text = text});
}

void Joins::take(const PartSpan& span) {
  if (span.id.life == 0 || span.from_log_us == 0) return;
  const bool is_other_file = before_ && before_->file != span.file;
  const bool may_overlap = is_other_file && (span.is_black_box || before_->is_black_box);
  const std::string text = may_overlap ? "" : text_of(span);
  if (!text.empty()) add(span.file, span.first_line, text);
  const std::int64_t set_by_us = before_ && !may_overlap ? set_between(*before_, span) : 0;
  if (set_by_us != 0) add(span.file, span.first_line, setting_text(set_by_us) + " before this part");
  for (const ClockSetting& setting : span.clock_settings) add(span.file, setting.line, setting_text(setting.by_us));
  if (!span.is_black_box) seen_.insert({span.id.life, span.id.part});
  before_ = span;
}

}  // namespace bmu::replay

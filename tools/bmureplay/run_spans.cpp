#include "tools/bmureplay/run_spans.hpp"

#include <algorithm>
#include <chrono>

#include "tools/common/clock_set.hpp"

namespace bmu::replay {

namespace {

/// 0 also if one of the clocks was not set: the difference is unknown then.
std::int64_t between(std::int64_t from_log_us, std::int64_t to_log_us) {
  const bool is_known = from_log_us != 0 && to_log_us != 0 && is_clock_set(from_log_us) == is_clock_set(to_log_us);
  return is_known ? std::max<std::int64_t>(0, to_log_us - from_log_us) : 0;
}

/// By the core's clock within a session, because the wall clock may have been set.
std::int64_t between(const PartSpan& before, const PartSpan& next) {
  if (!before.is_of_life(next) || !before.has_times() || !next.has_times()) {
    return between(before.until_log_us, next.from_log_us);
  }
  const auto gap = std::chrono::floor<std::chrono::microseconds>(next.from - before.until);
  return std::max<std::int64_t>(0, gap.count());
}

}  // namespace

void RunSpans::take(const PartSpan& span, std::int64_t end_log_us) {
  const bool is_behind_one = !spans_.empty() && spans_.back().file == span.file && spans_.back().from_log_us == 0;
  if (is_behind_one && span.from_log_us == 0) {
    ends_log_us_.back() = std::max(ends_log_us_.back(), end_log_us);
    return;
  }
  spans_.push_back(span);
  ends_log_us_.push_back(end_log_us);
}

bool RunSpans::has_run(const std::string& file) const {
  return std::any_of(spans_.begin(), spans_.end(),
                     [&file](const PartSpan& span) { return span.file == file && span.from_log_us != 0; });
}

void RunSpans::complete(Damage& damage, std::size_t index) const {
  const PartSpan& damaged = spans_[index];
  std::int64_t end_log_us = ends_log_us_[index];
  for (std::size_t next = index + 1; next < spans_.size() && spans_[next].file == damaged.file; ++next) {
    end_log_us = std::max(end_log_us, ends_log_us_[next]);
    if (spans_[next].from_log_us == 0) continue;
    damage.goes_on_line = spans_[next].first_line;
    damage.not_run_us = between(damaged, spans_[next]);
    return;
  }
  damage.not_run_us = between(damaged.until_log_us, end_log_us);
}

void RunSpans::complete(Damage& damage) const {
  for (std::size_t next = 1; next < spans_.size(); ++next) {
    const bool goes_on = spans_[next].file == damage.file && spans_[next].first_line == damage.goes_on_line;
    if (!goes_on || spans_[next - 1].file != damage.file) continue;
    damage.not_run_us = between(spans_[next - 1], spans_[next]);
    return;
  }
}

}  // namespace bmu::replay

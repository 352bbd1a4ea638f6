#include "tools/report/time.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <ctime>

namespace bmu::report {

namespace {

constexpr std::int64_t ms = 1'000;
constexpr std::int64_t s = 1'000 * ms;
constexpr std::int64_t min = 60 * s;
constexpr std::int64_t h = 60 * min;
constexpr std::int64_t d = 24 * h;

constexpr std::array<std::int64_t, 30> steps_us{
    100 * ms, 200 * ms, 500 * ms, s,        2 * s,    5 * s,  10 * s, 20 * s,  30 * s,  min,
    2 * min,  5 * min,  10 * min, 20 * min, 30 * min, h,      2 * h,  3 * h,   6 * h,   12 * h,
    d,        2 * d,    5 * d,    7 * d,    14 * d,   28 * d, 56 * d, 112 * d, 224 * d, 448 * d};

std::string formatted(std::int64_t at_us, const char* format) {
  // Rounds down, also before 1970.
  const std::time_t seconds = at_us >= 0 ? at_us / s : (at_us - s + 1) / s;
  std::tm parts{};
  std::array<char, 40> text{};
  if (::gmtime_r(&seconds, &parts) == nullptr) return "?";
  return {text.data(), std::strftime(text.data(), text.size(), format, &parts)};
}

std::string two_parts(std::int64_t first, const char* first_unit, std::int64_t second, const char* second_unit) {
  return std::to_string(first) + " " + first_unit +
         (second == 0 ? "" : " " + std::to_string(second) + " " + second_unit);
}

}  // namespace

std::string time_text(std::int64_t at_us) {
  return formatted(at_us, "%Y-%m-%d %H:%M:%S");
}

std::string clock_text_ms(std::int64_t at_us) {
  std::array<char, 8> fraction{};
  std::snprintf(fraction.data(), fraction.size(), ".%03d", static_cast<int>(at_us % s / ms));
  return formatted(at_us, "%H:%M:%S") + fraction.data();
}

std::string sample_name(std::int64_t sample_us) {
  return sample_us == min ? "minute" : span_text(sample_us);
}

std::string sample_text(std::int64_t at_us, std::int64_t sample_us) {
  if (sample_us <= s) return time_text(at_us);
  const bool is_of_minutes = sample_us % min == 0;
  return "in the " + sample_name(sample_us) + " from " +
         formatted(at_us, is_of_minutes ? "%Y-%m-%d %H:%M" : "%Y-%m-%d %H:%M:%S");
}

std::string stretch_text(std::int64_t from_us, std::int64_t to_us) {
  const bool is_same_day = from_us / d == to_us / d;
  return formatted(from_us, "%Y-%m-%d %H:%M:%S") + " to " +
         formatted(to_us, is_same_day ? "%H:%M:%S" : "%Y-%m-%d %H:%M:%S") + " UTC";
}

std::string span_text(std::int64_t span_us) {
  if (span_us < min) {
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), span_us < s ? "%.2g s" : "%.1f s", static_cast<double>(span_us) / s);
    return text.data();
  }
  if (span_us < h) return two_parts(span_us / min, "min", span_us % min / s, "s");
  if (span_us < d) return two_parts(span_us / h, "h", span_us % h / min, "min");
  return two_parts(span_us / d, "d", span_us % d / h, "h");
}

std::vector<TimeTick> time_ticks(std::int64_t from_us, std::int64_t to_us, int count) {
  const std::int64_t wanted_us = std::max<std::int64_t>((to_us - from_us) / std::max(count, 1), 1);
  const auto* const found = std::lower_bound(steps_us.begin(), steps_us.end(), wanted_us);
  const std::int64_t step_us = found == steps_us.end() ? steps_us.back() : *found;
  const char* const clock = step_us < min ? "%H:%M:%S" : "%H:%M";
  std::vector<TimeTick> ticks;
  const bool is_one_day = from_us / d == (to_us - 1) / d;
  for (std::int64_t at_us = (from_us + step_us - 1) / step_us * step_us; at_us <= to_us; at_us += step_us) {
    const bool is_new_day = !is_one_day && (ticks.empty() || at_us / d != ticks.back().at_us / d);
    std::string text = formatted(at_us, step_us >= d || (is_new_day && at_us % d == 0) ? "%e %b" : clock);
    if (step_us < s) text += "." + std::to_string(at_us % s / (100 * ms));
    text.erase(0, text.find_first_not_of(' '));
    ticks.push_back({.at_us = at_us, .text = std::move(text)});
  }
  return ticks;
}

}  // namespace bmu::report

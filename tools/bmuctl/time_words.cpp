#include "tools/bmuctl/time_words.hpp"

#include <array>
#include <charconv>
#include <chrono>
#include <cstdio>
#include <ctime>

namespace bmu {

namespace {

constexpr std::int64_t ms_per_s = 1'000;

struct SpanUnit {
  std::string_view name;
  std::int64_t seconds;
};
constexpr std::array span_units{SpanUnit{"s", 1}, SpanUnit{"min", 60}, SpanUnit{"h", 3'600}, SpanUnit{"d", 86'400}};
// Longer than any history: a larger span is a typing error.
constexpr std::int64_t span_max_s = std::int64_t{86'400} * 366 * 100;

/// "2h" in ms.
std::optional<std::int64_t> span_ms(std::string_view text) {
  std::int64_t count = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), count);
  if (error != std::errc{} || count < 0) return std::nullopt;
  const std::string_view name = text.substr(static_cast<std::size_t>(end - text.data()));
  for (const SpanUnit& unit : span_units) {
    if (unit.name == name && count <= span_max_s / unit.seconds) return count * unit.seconds * ms_per_s;
  }
  return std::nullopt;
}

std::tm local_parts(std::int64_t unix_ms) {
  const std::time_t seconds = unix_ms / ms_per_s;
  std::tm parts{};
  ::localtime_r(&seconds, &parts);
  return parts;
}

/// Midnight of the day `days_before` days ago.
std::int64_t midnight_ms(std::int64_t now_unix_ms, int days_before) {
  std::tm parts = local_parts(now_unix_ms);
  parts.tm_mday -= days_before;
  parts.tm_hour = parts.tm_min = parts.tm_sec = 0;
  parts.tm_isdst = -1;
  return std::int64_t{std::mktime(&parts)} * ms_per_s;
}

/// Removes `count` digits from the front.
bool take_digits(std::string_view& text, std::size_t count, int& to) {
  if (text.size() < count) return false;
  const auto [end, error] = std::from_chars(text.data(), text.data() + count, to);
  if (error != std::errc{} || end != text.data() + count || to < 0) return false;
  text.remove_prefix(count);
  return true;
}
bool take(std::string_view& text, std::string_view any_of) {
  if (text.empty() || any_of.find(text.front()) == std::string_view::npos) return false;
  text.remove_prefix(1);
  return true;
}

/// Removes the date and, if there is one, the time; false if the text has no valid date.
bool take_date_and_time(std::string_view& text, std::tm& parts) {
  if (!take_digits(text, 4, parts.tm_year) || !take(text, "-") || !take_digits(text, 2, parts.tm_mon) ||
      !take(text, "-") || !take_digits(text, 2, parts.tm_mday)) {
    return false;
  }
  if (text.empty()) return true;
  if (!take(text, "T ") || !take_digits(text, 2, parts.tm_hour) || !take(text, ":") ||
      !take_digits(text, 2, parts.tm_min)) {
    return false;
  }
  return !take(text, ":") || take_digits(text, 2, parts.tm_sec);
}

/// "Z" or "+01:00", in seconds ahead of UTC.
std::optional<std::int64_t> zone_s(std::string_view text) {
  if (text == "Z") return 0;
  const bool is_behind = text.starts_with('-');
  int hours = 0;
  int minutes = 0;
  if (!take(text, "+-") || !take_digits(text, 2, hours) || !take(text, ":") || !take_digits(text, 2, minutes) ||
      !text.empty() || hours > 14 || minutes > 59) {
    return std::nullopt;
  }
  const std::int64_t ahead_s = (hours * std::int64_t{60} + minutes) * 60;
  return is_behind ? -ahead_s : ahead_s;
}

std::optional<std::int64_t> calendar_time(std::string_view text) {
  std::tm parts{};
  if (!take_date_and_time(text, parts)) return std::nullopt;
  const std::optional<std::int64_t> ahead_s = zone_s(text);
  const bool is_possible = parts.tm_year >= 1970 && parts.tm_mon >= 1 && parts.tm_mon <= 12 && parts.tm_mday >= 1 &&
                           parts.tm_hour <= 23 && parts.tm_min <= 59 && parts.tm_sec <= 60;
  if ((!text.empty() && !ahead_s) || !is_possible) return std::nullopt;
  parts.tm_year -= 1'900;
  parts.tm_mon -= 1;
  parts.tm_isdst = -1;
  const int day = parts.tm_mday;
  const std::int64_t seconds = ahead_s ? ::timegm(&parts) : std::mktime(&parts);
  // A 31st of a month with fewer days became another day.
  return parts.tm_mday == day ? std::optional((seconds - ahead_s.value_or(0)) * ms_per_s) : std::nullopt;
}

std::string text_of(const std::tm& parts, const char* format) {
  std::array<char, 32> text{};
  return std::strftime(text.data(), text.size(), format, &parts) == 0 ? "?" : text.data();
}

}  // namespace

std::optional<std::int64_t> time_from_words(std::string_view text, std::int64_t now_unix_ms) {
  if (text == "now") return now_unix_ms;
  if (text == "today") return midnight_ms(now_unix_ms, 0);
  if (text == "yesterday") return midnight_ms(now_unix_ms, 1);
  if (text.starts_with('-')) {
    const auto before_ms = span_ms(text.substr(1));
    return before_ms ? std::optional(now_unix_ms - *before_ms) : std::nullopt;
  }
  return calendar_time(text);
}

Result<TimeSpan, std::string> time_span_from_words(std::string_view from, std::string_view to,
                                                   std::int64_t now_unix_ms) {
  TimeSpan span;
  if (!from.empty() && from != "begin") {
    span.from_unix_ms = time_from_words(from, now_unix_ms);
    if (!span.from_unix_ms) return failure("--from: found '" + std::string(from) + "', expected " + time_words_form);
  }
  if (!to.empty()) {
    span.to_unix_ms = time_from_words(to, now_unix_ms);
    if (!span.to_unix_ms) return failure("--to: found '" + std::string(to) + "', expected " + time_words_form);
  }
  if (span.from_unix_ms && span.to_unix_ms && *span.from_unix_ms > *span.to_unix_ms) {
    return failure(std::string("--from is later than --to"));
  }
  return span;
}

std::string local_time_text(std::int64_t unix_ms) {
  std::string text = text_of(local_parts(unix_ms), "%Y-%m-%d %H:%M:%S%z");
  return text.size() > 2 ? text.insert(text.size() - 2, ":") : text;
}

std::string utc_time_text(std::int64_t unix_ms) {
  const std::time_t seconds = unix_ms / ms_per_s;
  std::tm parts{};
  ::gmtime_r(&seconds, &parts);
  return text_of(parts, "%Y-%m-%dT%H:%M:%SZ");
}

std::int64_t now_in_unix_ms() {
  const auto since_1970 = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::milliseconds>(since_1970).count();
}

}  // namespace bmu

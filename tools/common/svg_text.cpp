#include "tools/common/svg_text.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace bmu::svg {

std::string number(double value, int digits) {
  std::array<char, 40> text{};
  const int length = std::snprintf(text.data(), text.size(), "%.*f", digits, value);
  return {text.data(), std::min(static_cast<std::size_t>(std::max(length, 0)), text.size() - 1)};
}

void append(std::string& to, std::initializer_list<std::string_view> parts) {
  for (const std::string_view part : parts) to += part;
}

namespace {

/// Number of bytes of the character that starts here; 0 if it is invalid.
std::size_t character_length(std::string_view text) {
  const auto first = static_cast<unsigned char>(text.front());
  if (first < 0x80) return 1;
  const std::size_t length = first < 0xC2 ? 0 : first < 0xE0 ? 2 : first < 0xF0 ? 3 : first < 0xF5 ? 4 : 0;
  if (length == 0 || text.size() < length) return 0;
  const auto continues = [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) == 0x80U; };
  return std::all_of(text.begin() + 1, text.begin() + static_cast<std::ptrdiff_t>(length), continues) ? length : 0;
}

void append_escaped(std::string& to, char c) {
  switch (c) {
    case '&': to += "&amp;"; break;
    case '<': to += "&lt;"; break;
    case '>': to += "&gt;"; break;
    case '"': to += "&quot;"; break;
    case '\'': to += "&#39;"; break;
    default: to += c < 0x20 || c == 0x7F ? ' ' : c;
  }
}

}  // namespace

std::string escaped(std::string_view text) {
  std::string result;
  result.reserve(text.size());
  while (!text.empty()) {
    const std::size_t length = character_length(text);
    if (length == 0) {
      result += '?';
    } else if (length == 1) {
      append_escaped(result, text.front());
    } else {
      result += text.substr(0, length);
    }
    text.remove_prefix(std::max<std::size_t>(length, 1));
  }
  return result;
}

void Range::take(double value) {
  if (!std::isfinite(value)) return;
  if (is_empty()) *this = {value, value};
  low = std::min(low, value);
  high = std::max(high, value);
}

void Range::widen(double width_min) {
  if (is_empty()) *this = {0.0, 1.0};
  const double missing = std::max(width_min, low == high ? 1.0 : 0.0) - (high - low);
  if (missing > 0.0) *this = {low - missing / 2, high + missing / 2};
}

double tick_step(const Range& range, double count) {
  const double rough = (range.high - range.low) / count;
  const double power = std::pow(10.0, std::floor(std::log10(rough)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= rough) return factor * power;
  }
  return 10.0 * power;
}

std::vector<double> ticks_of(const Range& range, double step) {
  constexpr double slack = 1e-9;  // for an end that is a tick itself
  const auto first = std::llround(std::ceil(range.low / step - slack));
  const auto last = std::llround(std::floor(range.high / step + slack));
  std::vector<double> ticks;
  for (auto k = first; k <= last; ++k) ticks.push_back(static_cast<double>(k) * step);
  return ticks;
}

int digits_for(double step) {
  return std::max(0, static_cast<int>(std::ceil(-std::log10(step) - 1e-9)));
}

}  // namespace bmu::svg

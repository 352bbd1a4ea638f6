// Helpers of every SVG chart: escaped numbers and texts, the range of the data, and round numbers for its axes.
#pragma once

#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

namespace bmu::svg {

[[nodiscard]] std::string number(double value, int digits = 1);
void append(std::string& to, std::initializer_list<std::string_view> parts);

/// Escapes any text for the content and the attributes of SVG and HTML.
[[nodiscard]] std::string escaped(std::string_view text);

struct Range {
  double low = 0.0;
  double high = -1.0;  // below `low`: no value yet

  [[nodiscard]] bool is_empty() const { return high < low; }
  /// Values that are not finite are ignored.
  void take(double value);
  /// Afterwards the range is neither empty nor narrower than `width_min`.
  void widen(double width_min = 0.0);
};

/// 1, 2 or 5 times a power of ten, so that there are about `count` ticks.
[[nodiscard]] double tick_step(const Range& range, double count = 6.0);
/// Multiples of the step, from end to end.
[[nodiscard]] std::vector<double> ticks_of(const Range& range, double step);
/// Number of decimals that distinguishes two ticks.
[[nodiscard]] int digits_for(double step);

}  // namespace bmu::svg

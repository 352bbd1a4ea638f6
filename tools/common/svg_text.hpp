// What every picture in SVG needs: numbers and texts as they may stand in it, the range of what is drawn, and round
// numbers for its axes.
#pragma once

#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

namespace bmu::svg {

[[nodiscard]] std::string number(double value, int digits = 1);
void append(std::string& to, std::initializer_list<std::string_view> parts);

/// Fit for the text and for the attributes of SVG and HTML, whatever is in it.
[[nodiscard]] std::string escaped(std::string_view text);

struct Range {
  double low = 0.0;
  double high = -1.0;  // below `low`: nothing was taken yet

  [[nodiscard]] bool is_empty() const { return high < low; }
  /// What is not finite is left out.
  void take(double value);
  /// Never empty afterwards, nor narrower than `width_min`.
  void widen(double width_min = 0.0);
};

/// 1, 2 or 5 times a power of ten, so that there are some `count` of them.
[[nodiscard]] double tick_step(const Range& range, double count = 6.0);
/// Multiples of the step, from end to end.
[[nodiscard]] std::vector<double> ticks_of(const Range& range, double step);
/// Decimals that tell two ticks apart.
[[nodiscard]] int digits_for(double step);

}  // namespace bmu::svg

// Scrolling text: lines of styled words, and tables with aligned columns.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tools/common/style.hpp"

namespace bmu {

struct Span {
  std::string text;
  Style style = Style::normal;
};
using Line = std::vector<Span>;

/// Text with the normal style.
[[nodiscard]] Span plain(std::string text);

/// Number of columns on a terminal; every character that bmud prints takes one.
[[nodiscard]] std::size_t width_of(std::string_view text);

/// The same in lines of at most `width` columns, broken between words; lines after the first are indented by `indent`.
/// A longer word is broken anywhere.
[[nodiscard]] std::vector<Line> wrapped(const Line& line, std::size_t width, std::size_t indent);

class Page {
 public:
  void add(Line line) { lines_.push_back(std::move(line)); }
  /// "label     words": a heading of fixed width and its text.
  void add_field(std::string_view label, Line words);
  /// Rows of equal length. Columns listed in `right` are right-aligned.
  void add_table(const std::vector<Line>& rows, const std::vector<std::size_t>& right);

  [[nodiscard]] std::string text(bool with_colour) const;
  [[nodiscard]] const std::vector<Line>& lines() const { return lines_; }

 private:
  std::vector<Line> lines_;
};

}  // namespace bmu

// A screen of characters to draw on. Text that does not fit a row is cut off, so that drawing needs no checks; the row
// then ends with a mark.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tools/common/page.hpp"
#include "tools/common/style.hpp"

namespace bmu {

class Canvas {
 public:
  Canvas(int width, int height, std::string_view cut_mark);

  /// Writes UTF-8 text; returns the column after it. Control characters become '?': drawn text cannot control a
  /// terminal.
  int put(int row, int column, std::string_view text, Style style = Style::normal);
  int put(int row, int column, const Line& line);
  /// The same within `room` columns: longer text is cut off with the mark. Returns the column after them.
  int put_within(int row, int column, int room, std::string_view text, Style style = Style::normal);
  /// One style for a whole row, from its first to its last column.
  void fill(int row, Style style);

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }

  /// A row without trailing blanks; "" for a row outside.
  [[nodiscard]] std::string row_text(int row, bool with_colour) const;
  /// All rows down to the last that is not blank, a line each.
  [[nodiscard]] std::string text(bool with_colour) const;

 private:
  struct Cell {
    std::string character = " ";
    Style style = Style::normal;
  };

  int put_until(int row, int column, int end, std::string_view text, Style style);
  [[nodiscard]] const Cell& at(int row, int column) const {
    return cells_[static_cast<std::size_t>(row) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(column)];
  }
  [[nodiscard]] Cell& at(int row, int column) { return const_cast<Cell&>(std::as_const(*this).at(row, column)); }

  int width_;
  int height_;
  std::string cut_mark_;
  std::vector<Cell> cells_;
};

}  // namespace bmu

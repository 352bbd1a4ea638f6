// The live view: a whole pack on one screen, drawn from one "watch" reply, and further pages for details that do not
// fit on the screen.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tools/bmuctl/bus_trend.hpp"
#include "tools/bmuctl/reply.hpp"
#include "tools/common/canvas.hpp"
#include "tools/common/glyphs.hpp"

namespace bmu {

enum class PictureTopic : std::uint8_t { overview, faults, limits, buses, help };
enum class CellsForm : std::uint8_t {
  fitting,  // the most detailed form in which all modules fit
  bars,     // large bars with numbers, as many modules as fit
  numbers,  // three decimals
};

/// Page, form and scroll position that the user selected.
struct PictureView {
  PictureTopic topic = PictureTopic::overview;
  CellsForm form = CellsForm::fitting;
  bool bars_span_cells = false;  // from the lowest cell to the highest; otherwise from limit to limit
  int first = 0;                 // line of cells or of a page
};

/// Extent of the scrollable content: visible lines of all lines.
struct PictureExtent {
  int shown = 0;
  int total = 0;
};

/// Draws what fits: 100 by 30 shows 48 cells in full, smaller windows and larger packs get narrower forms of the same.
/// Omissions are marked. `notice` is about the connection ("the daemon has gone"), "" for none. `view.first` may be
/// beyond the end: the last line is then at the bottom.
PictureExtent draw_picture(const Reply& reply, const PictureView& view, const BusTrend& trend, std::string_view notice,
                           const Glyphs& glyphs, Canvas& canvas);

/// The same in one line, for logs.
[[nodiscard]] std::string compact_line(const Reply& reply);

// --- parts of the live view -----------------------------------------------------------------------------------------

/// Replaces a row by the number of lines that do not fit the window.
void put_more(int count, int row, Canvas& canvas);

struct CellsDrawn {
  int rows = 0;  // of the canvas
  PictureExtent extent;
  std::string modules;  // "modules 1 to 8 of 16" if not all are shown
};
/// Draws cells into these rows of the canvas. In picture_cells.cpp.
CellsDrawn draw_cells(const Reply& cells, const PictureView& view, const Glyphs& glyphs, int first_row, int rows,
                      Canvas& canvas);

/// Faults, close inhibits, buses, the drive and the last opening. In picture_foot.cpp.
[[nodiscard]] std::vector<Line> foot_lines(const Reply& reply, const BusTrend& trend, const Glyphs& glyphs, int width);
/// Lines of the pages behind the overview. In picture_foot.cpp.
[[nodiscard]] std::vector<Line> topic_lines(PictureTopic topic, const Reply& reply, const BusTrend& trend,
                                            const Glyphs& glyphs, int width);

}  // namespace bmu

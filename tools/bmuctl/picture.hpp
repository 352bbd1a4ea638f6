// The live picture: a whole pack on one screen, drawn from one "watch" reply.
#pragma once

#include <string>
#include <string_view>

#include "tools/bmuctl/reply.hpp"
#include "tools/common/canvas.hpp"
#include "tools/common/glyphs.hpp"

namespace bmu {

/// Draws what fits: 100 by 30 shows 48 cells in full, smaller windows and larger packs get narrower forms of the same.
/// What is left out is marked. `notice` is about the connection ("the daemon has gone"), "" for none.
void draw_picture(const Reply& reply, std::string_view notice, const Glyphs& glyphs, Canvas& canvas);

/// The same in one line, for logs.
[[nodiscard]] std::string compact_line(const Reply& reply);

/// A row that says what the window has no room for, in the place of what stood there.
void put_more(int count, std::string_view things, int row, Canvas& canvas);

/// Every cell of every module into these rows of the canvas, in the most detailed form that fits. Returns the rows
/// used.
int draw_cells(const Reply& cells, const Glyphs& glyphs, int first_row, int rows, Canvas& canvas);

}  // namespace bmu

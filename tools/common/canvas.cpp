#include "tools/common/canvas.hpp"

#include <algorithm>

namespace bmu {

namespace {

/// Number of bytes of the character that starts here; 1 for an invalid first byte.
std::size_t character_length(std::string_view text) {
  const auto first = static_cast<unsigned char>(text.front());
  const std::size_t wanted = first < 0xC0 ? 1 : first < 0xE0 ? 2 : first < 0xF0 ? 3 : 4;
  return std::min(wanted, text.size());
}

bool is_control(std::string_view character) {
  const auto first = static_cast<unsigned char>(character.front());
  const bool is_c1 = character.size() == 2 && first == 0xC2 && static_cast<unsigned char>(character[1]) < 0xA0;
  const bool is_stray = character.size() == 1 && first >= 0x80;
  return first < 0x20 || first == 0x7F || is_c1 || is_stray;
}

}  // namespace

Canvas::Canvas(int width, int height, std::string_view cut_mark)
    : width_(std::max(width, 1)),
      height_(std::max(height, 1)),
      cut_mark_(cut_mark),
      cells_(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_)) {}

int Canvas::put(int row, int column, std::string_view text, Style style) {
  return put_until(row, column, width_, text, style);
}

int Canvas::put_within(int row, int column, int room, std::string_view text, Style style) {
  const int end = std::min(column + std::max(room, 0), width_);
  if (column < end) put_until(row, column, end, text, style);
  return end;
}

/// Returns the column after the text, as if all of it had been put.
int Canvas::put_until(int row, int column, int end, std::string_view text, Style style) {
  while (!text.empty()) {
    const std::string_view character = text.substr(0, character_length(text));
    text.remove_prefix(character.size());
    const bool is_inside = row >= 0 && row < height_ && column >= 0;
    if (is_inside && column < end) {
      at(row, column) = {is_control(character) ? "?" : std::string(character), style};
    } else if (is_inside && character != " ") {
      at(row, end - 1).character = cut_mark_;
    }
    ++column;
  }
  return column;
}

int Canvas::put(int row, int column, const Line& line) {
  for (const Span& span : line) column = put(row, column, span.text, span.style);
  return column;
}

void Canvas::fill(int row, Style style) {
  if (row < 0 || row >= height_) return;
  for (int column = 0; column < width_; ++column) at(row, column).style = style;
}

std::string Canvas::row_text(int row, bool with_colour) const {
  if (row < 0 || row >= height_) return "";
  int end = width_;
  while (end > 0 && at(row, end - 1).character == " " && (!with_colour || at(row, end - 1).style == Style::normal))
    --end;
  std::string text;
  Style style = Style::normal;
  for (int column = 0; column < end; ++column) {
    const Cell& cell = at(row, column);
    if (with_colour && cell.style != style) text += escape_code(cell.style);
    style = cell.style;
    text += cell.character;
  }
  if (with_colour && style != Style::normal) text += escape_code(Style::normal);
  return text;
}

std::string Canvas::text(bool with_colour) const {
  int rows = height_;
  while (rows > 0 && row_text(rows - 1, false).empty()) --rows;
  std::string all;
  for (int row = 0; row < rows; ++row) all += row_text(row, with_colour) + "\n";
  return all;
}

}  // namespace bmu

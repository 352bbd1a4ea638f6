#include "tools/common/page.hpp"

#include <algorithm>

namespace bmu {

namespace {

constexpr std::size_t label_width = 12;

std::string spaces(std::size_t count) {
  return std::string(count, ' ');
}

bool is_continuation(char byte) {
  return (static_cast<unsigned char>(byte) & 0xC0U) == 0x80U;
}

}  // namespace

std::size_t width_of(std::string_view text) {
  return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), [](char b) { return !is_continuation(b); }));
}

void Page::add_field(std::string_view label, Line words) {
  const std::size_t used = std::min(width_of(label), label_width - 1);
  words.insert(words.begin(), {std::string(label) + spaces(label_width - used), Style::dim});
  add(std::move(words));
}

void Page::add_table(const std::vector<Line>& rows, const std::vector<std::size_t>& right) {
  std::vector<std::size_t> widths;
  for (const Line& row : rows) {
    widths.resize(std::max(widths.size(), row.size()));
    for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], width_of(row[i].text));
  }
  for (const Line& row : rows) {
    Line line;
    for (std::size_t i = 0; i < row.size(); ++i) {
      const bool is_right = std::find(right.begin(), right.end(), i) != right.end();
      const std::string room = spaces(widths[i] - width_of(row[i].text));
      line.push_back({is_right ? room + row[i].text : row[i].text + room, row[i].style});
      line.push_back({"  "});
    }
    add(std::move(line));
  }
}

std::string Page::text(bool with_colour) const {
  std::string all;
  for (const Line& line : lines_) {
    std::string text;
    for (const Span& span : line) {
      const bool is_styled = with_colour && span.style != Style::normal;
      if (is_styled) text += escape_code(span.style);
      text += span.text;
      if (is_styled) text += escape_code(Style::normal);
    }
    if (!with_colour) text.erase(text.find_last_not_of(' ') + 1);
    all += text + "\n";
  }
  return all;
}

}  // namespace bmu

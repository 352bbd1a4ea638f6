#include "tools/common/page.hpp"

#include <algorithm>
#include <utility>

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

Span plain(std::string text) {
  return {.text = std::move(text)};
}

std::size_t width_of(std::string_view text) {
  return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), [](char b) { return !is_continuation(b); }));
}

namespace {

/// Collects pieces of text into lines.
class Wrapping {
 public:
  Wrapping(std::size_t width, std::size_t indent) : width_(std::max<std::size_t>(width, indent + 1)), indent_(indent) {}

  void take(std::string_view text, Style style) {
    while (!text.empty()) {
      const bool is_space = text.front() == ' ';
      const std::size_t end = is_space ? text.find_first_not_of(' ') : text.find(' ');
      const std::string_view piece = text.substr(0, end);
      text.remove_prefix(piece.size());
      if (is_space) {
        put(piece.substr(0, std::min(piece.size(), width_ - std::min(used_, width_))), style);
      } else {
        take_word(piece, style);
      }
    }
  }
  std::vector<Line> lines() && {
    lines_.push_back(std::move(line_));
    return std::move(lines_);
  }

 private:
  void take_word(std::string_view word, Style style) {
    if (used_ + width_of(word) > width_ && used_ > indent_) begin_line();
    while (used_ + width_of(word) > width_) {
      std::size_t bytes = 0;
      for (std::size_t room = width_ - used_; room > 0; --room) {
        do ++bytes;
        while (bytes < word.size() && is_continuation(word[bytes]));
      }
      put(word.substr(0, bytes), style);
      word.remove_prefix(bytes);
      begin_line();
    }
    put(word, style);
  }
  void put(std::string_view text, Style style) {
    line_.push_back({std::string(text), style});
    used_ += width_of(text);
  }
  void begin_line() {
    lines_.push_back(std::move(line_));
    line_ = {{spaces(indent_)}};
    used_ = indent_;
  }

  std::size_t width_;
  std::size_t indent_;
  std::size_t used_ = 0;
  Line line_;
  std::vector<Line> lines_;
};

}  // namespace

std::vector<Line> wrapped(const Line& line, std::size_t width, std::size_t indent) {
  Wrapping wrapping(width, indent);
  for (const Span& span : line) wrapping.take(span.text, span.style);
  return std::move(wrapping).lines();
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

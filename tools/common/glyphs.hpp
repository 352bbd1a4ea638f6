// The signs pictures are drawn with: the pretty ones where the terminal speaks UTF-8, plain ones elsewhere.
#pragma once

#include <array>
#include <string_view>

namespace bmu {

struct Glyphs {
  std::string_view contact_closed;
  std::string_view contact_open;
  std::string_view contact_differs;  // commanded closed, not (yet) fed back, or the other way round
  std::string_view contact_unknown;
  std::string_view line;
  std::string_view corner_down;  // a branch that goes down from a line
  std::string_view corner_end;   // where it comes back
  std::string_view low_left;
  std::string_view low_right;
  std::string_view bar_full;
  std::string_view bar_empty;
  std::string_view lowest;
  std::string_view highest;
  std::string_view bullet;
  std::string_view minus;
  std::string_view cut;                    // at the end of what does not fit
  std::array<std::string_view, 8> levels;  // a value between its limits, as one column
};

extern const Glyphs pretty_glyphs;
extern const Glyphs plain_glyphs;

/// By the environment: its locale, and the kind of terminal.
[[nodiscard]] const Glyphs& glyphs_for_locale();

}  // namespace bmu

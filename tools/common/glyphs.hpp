// The characters of live views and charts: pretty_glyphs if the terminal uses UTF-8, plain_glyphs otherwise.
#pragma once

#include <array>
#include <string_view>

namespace bmu {

struct Glyphs {
  std::string_view contact_closed;
  std::string_view contact_open;
  std::string_view contact_differs;  // commanded closed and feedback pending, or the reverse
  std::string_view contact_unknown;
  std::string_view line;
  std::string_view corner_down;  // a branch down from a line
  std::string_view corner_end;   // the end of the branch
  std::string_view low_left;
  std::string_view low_right;
  std::string_view bar_full;
  std::string_view bar_empty;
  std::string_view lowest;
  std::string_view highest;
  std::string_view bullet;
  std::string_view minus;
  std::string_view cut;                    // at the end of text that does not fit
  std::array<std::string_view, 8> levels;  // a value between its limits, as one column
};

extern const Glyphs pretty_glyphs;
extern const Glyphs plain_glyphs;

/// Selected by the environment: its locale, and the type of terminal.
[[nodiscard]] const Glyphs& glyphs_for_locale();

}  // namespace bmu
